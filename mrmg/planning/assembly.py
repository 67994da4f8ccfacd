"""Putting a plan together from the trajectories that were found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from math import inf
from typing import NamedTuple

from mrmg import extensions
from mrmg.energy.ledger import EnergyLedger, LedgerEntry
from mrmg.energy.metering import visits_and_energy
from mrmg.energy.visits import crowded_stations
from mrmg.planning.endings import listed
from mrmg.planning.feasibility import energy_and_metres
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.problem.problem import Problem
from mrmg.plans import Plan, Trajectory, Visit
from mrmg.scene.types import Robot


class Refusal(NamedTuple):
    """Why trajectories are no plan; the least is that of which least is missing.

    Attributes:
        missing_J: what a battery is short of; inf if that is not why.
        why: in words.
    """

    missing_J: float
    why: str


def make_plan(
    problem: Problem,
    seed: int,
    params: PlannerParams,
    trajectories: Sequence[Trajectory],
    tours: Mapping[str, tuple[str, ...]],
) -> tuple[Plan | None, Refusal | None]:
    """Return the plan of trajectories, or None and why exact accounting refuses it.

    Kernels meter terrain on a grid; the ledger uses the exact areas.

    Args:
        problem: the mission.
        seed: of the search that the plan belongs to.
        params: of that search.
        trajectories: of all robots.
        tours: targets each robot visits, in order.
    """
    scene = problem.scene
    visits: list[Visit] = []
    entries: list[LedgerEntry] = []
    for trajectory in trajectories:
        robot, tour = scene.robot(trajectory.robot), tours[trajectory.robot]
        own, content_J, drawn = visits_and_energy(scene, trajectory, tour)
        if len(own) < len(tour):
            return None, Refusal(inf, f"{robot.id} misses {tour[len(own)]}")
        short = _short(robot, content_J.min(), problem.soc_margin)
        if short is not None:
            return None, short
        visits += own
        entries += drawn
    ways = {item.robot: item.state[:, :2] for item in trajectories}
    if any(crowded_stations(scene, ways)):
        return None, Refusal(inf, "two robots are at a station for one at a time")
    visited = {visit.target for visit in visits}
    left_out = [goal.id for goal in scene.goals if goal.id not in visited]
    if left_out:
        return None, Refusal(inf, f"nobody visits {listed(left_out)}")
    plan = Plan(
        scene_name=scene.name,
        scene_digest=scene.digest,
        seed=seed,
        profile=params.profile,
        parameters_digest=params.digest,
        planner=params.planner,
        router=params.router.method,
        versions=_versions(params),
        dt_s=params.dt_s,
        trajectories=tuple(
            replace(each, motion=scene.robot(each.robot).model.motion_name)
            for each in trajectories
        ),
        tours=tours,
        visits=tuple(sorted(visits, key=lambda visit: (visit.step, visit.robot))),
        ledger=EnergyLedger(tuple(entries)),
    )
    return plan, None


def _short(robot: Robot, least_J: float, soc_margin: float) -> Refusal | None:
    """Return what a battery's least content lacks of reserve and margin, or None."""
    battery = robot.battery
    missing_J = battery.reserve_J + soc_margin * battery.capacity_J - least_J
    if missing_J <= 0.0:
        return None
    less = energy_and_metres(missing_J, robot)
    return Refusal(
        missing_J, f"{robot.id} ends {less} short of what its battery must keep"
    )


@cache
def _own_versions() -> Mapping[str, str]:
    names = ("mrmg", "numba", "numpy", "scipy", "shapely")
    return {name: version(name) for name in names}


def _versions(params: PlannerParams) -> dict[str, str]:
    """Return the versions of the packages that decide a plan."""
    own = dict(_own_versions())
    added = (
        extensions.origin(extensions.PLANNERS, params.planner),
        extensions.origin(extensions.ROUTERS, params.router.method),
    )
    return own | dict(package.rsplit(" ", 1) for package in added if package)
