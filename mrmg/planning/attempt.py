"""One attempt at a mission: tours, a motion tree along them, the plan it found."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version

import numpy as np

from mrmg import seeding
from mrmg.accounting import battery_profile, find_visits, plan_ledger
from mrmg.mission import Plan, Trajectory, Visit
from mrmg.planning.motion_tree import Problem, grow_tree
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.routing import solve_routing

MARGINS = (1.0, 0.0, 2.0)
"""Multiples of the route margin that successive trees are grown with."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """What one attempt gave.

    Attributes:
        plan: the plan; None if there is none.
        found_at: `time.perf_counter()` when it was found.
        routing_s: time the tours took.
        counts: of the tree; empty if there were no tours to grow it along.
    """

    plan: Plan | None
    found_at: float
    routing_s: float
    counts: Mapping[str, int] = field(default_factory=dict)


def attempt_plan(
    problem: Problem, seed: int, params: PlannerParams, number: int, halt: np.ndarray
) -> Attempt:
    """Draw tours and grow a tree along them; a function of seed and number alone.

    The surcharge on the roadmap's energies changes from draw to draw: batteries may
    leave no room for it, or driving may take more than it allows for.

    Args:
        problem: the mission.
        seed: of the whole search.
        params: parameters.
        number: of the attempt; each has its own random streams.
        halt: shape (1,); growing ends soon after it has turned true.
    """
    began = time.perf_counter()
    margin = MARGINS[number % len(MARGINS)] * params.route_margin
    problem = problem.with_margin(margin)
    draw = seeding.stream_seed(seed, "tours", number)
    routing = solve_routing(problem.mission.routing, params.router, draw)
    routed = time.perf_counter()
    if not routing.feasible or halt[0]:
        return Attempt(None, routed, routed - began)
    growth = grow_tree(
        problem, params, routing, seeding.stream_seed(seed, "tree", number), halt
    )
    plan = None
    if growth.solved:
        plan = make_plan(problem, seed, params, growth.trajectories, growth.tours)
    return Attempt(plan, time.perf_counter(), routed - began, growth.counts)


def make_plan(
    problem: Problem,
    seed: int,
    params: PlannerParams,
    trajectories: Sequence[Trajectory],
    tours: Mapping[str, tuple[str, ...]],
) -> Plan | None:
    """Return the plan of trajectories, or None if exact accounting refuses it.

    Kernels meter terrain on a grid; the ledger uses the exact areas.
    """
    scene = problem.scene
    visits: list[Visit] = []
    for trajectory in trajectories:
        own = find_visits(scene, trajectory, tours[trajectory.robot])
        battery = scene.robot(trajectory.robot).battery
        if battery_profile(scene, trajectory, own).min() < battery.reserve_J:
            return None
        visits += own
    visits.sort(key=lambda visit: (visit.step, visit.robot))
    return Plan(
        scene_name=scene.name,
        scene_digest=scene.digest,
        seed=seed,
        profile=params.profile,
        parameters_digest=params.digest,
        versions={
            name: version(name)
            for name in ("mrmg", "numba", "numpy", "scipy", "shapely")
        },
        dt_s=params.dt_s,
        trajectories=tuple(trajectories),
        tours=tours,
        visits=tuple(visits),
        ledger=plan_ledger(scene, trajectories, visits),
    )
