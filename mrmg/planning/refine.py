"""Refinement: a plan's robots drive again, along paths drawn tight.

Each robot's way is drawn tight (`band`) and driven in closed loop under committed
braking, as the motion tree does it, so that margins to obstacles and robots, dynamics
and limits hold by construction. The result is taken only if it visits the same targets
in the same order as deep, keeps every battery above its reserve, and costs less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrmg.mission import Plan, Trajectory
from mrmg.motion._kernels import USER
from mrmg.planning._mission_kernels import in_target
from mrmg.planning.assembly import make_plan
from mrmg.planning.band import (
    Path,
    path_of,
    smooth_terrain,
    surface_of,
    tightened,
    visit_steps,
    wary,
)
from mrmg.planning.motion_tree import Problem
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.roadmap import planned_regions
from mrmg.planning.targets import TARGET_MARGIN_M
from mrmg.planning.tracking import redriven

TRIES = 12
"""Times that driving is repeated with what went wrong put right."""

DEEPER_M = 0.02
"""How much deeper than it was missed by a target is entered the next time."""

SWERVES = 3
"""Times that a robot's path is led round a place before it drives as before."""

NEAR_M = 3.0
"""How near to each other two places are the same."""

REPEATED_S = 4.0
"""How long after the place where a robot got stuck it still drives as before."""


def refine(
    problem: Problem, params: PlannerParams, plan: Plan, halt: np.ndarray
) -> Plan:
    """Return a plan that is cheaper than `plan`, or `plan` itself.

    Where a robot does not get along its path (it is stuck in a tight place, or in the
    way of another), its path is led farther from obstacles there, and if that does not
    help it drives as before up to behind that place; where it misses a target, its path
    is led deeper into it.

    Args:
        problem: the mission.
        params: parameters.
        plan: a valid plan.
        halt: shape (1,); refinement ends soon after it has turned true.
    """
    targets = problem.mission.targets
    if _stays_somewhere(problem):
        return plan
    smooth = smooth_terrain(problem.mission.terrain.multiplier)
    surfaces = [surface_of(problem, r, smooth) for r in range(len(plan.trajectories))]
    tours = tour_numbers(problem, plan)
    visits = [
        visit_steps(targets, tour, trajectory)
        for tour, trajectory in zip(tours, plan.trajectories, strict=True)
    ]
    if any(len(v) < len(tour) for v, tour in zip(visits, tours, strict=True)):
        return plan
    given = np.where(_drives_as_before(problem), len(plan.trajectories[0].control), 0)
    swerves: list[list[np.ndarray]] = [[] for _ in tours]
    paths: list[Path | None] = [None] * len(tours)
    for _ in range(TRIES):
        for r, path in enumerate(paths):
            if path is None:
                raw = path_of(tours[r], visits[r], plan.trajectories[r], given[r])
                paths[r] = tightened(targets, surfaces[r], raw)[0]
        drawn = [path for path in paths if path is not None]
        outcome = redriven(problem, params, plan.trajectories, drawn, given, halt)
        if halt[0]:
            return plan
        if outcome.stuck >= 0:
            r = outcome.stuck
            before = [p for p in swerves[r] if np.hypot(*(p - outcome.place)) < NEAR_M]
            if len(before) < SWERVES:
                swerves[r].append(outcome.place)
                surfaces[r] = wary(surfaces[r], outcome.place)
                paths[r] = tightened(targets, surfaces[r], drawn[r])[0]
                continue
            more = _behind(plan.trajectories[r], outcome.place, given[r])
            if more is None:
                return plan
            given[r], paths[r] = more, None
            continue
        missed = False
        for r, trajectory in enumerate(outcome.trajectories):
            found = _deeper(problem, tours[r], trajectory, drawn[r])
            if found is not drawn[r]:
                paths[r] = tightened(targets, surfaces[r], found)[0]
                missed = True
        if not missed:
            return _cheaper(problem, params, plan, outcome.trajectories)
    return plan


def _stays_somewhere(problem: Problem) -> bool:
    """Tell whether robots stay at targets: driving along paths knows no pauses."""
    battery = [robot.battery for robot in problem.scene.robots]
    return bool(
        (problem.mission.targets.dwell > 0.0).any()
        or any(item.takes_time_to_fill for item in battery)
    )


def tour_numbers(problem: Problem, plan: Plan) -> list[list[int]]:
    """Return each robot's targets by number; where it must end comes last."""
    number = {target.id: i for i, target in enumerate(problem.scene.targets())}
    finish = problem.mission.targets.finish
    return [
        [number[name] for name in plan.tours[trajectory.robot]] + [int(f)] * int(f >= 0)
        for trajectory, f in zip(plan.trajectories, finish, strict=True)
    ]


def _drives_as_before(problem: Problem) -> np.ndarray:
    """Tell which robots' ways are kept: a user's models, and ends with a heading."""
    targets = problem.mission.targets
    turned = (targets.finish >= 0) & (targets.tolerance < np.pi)
    return np.asarray(turned | (problem.mission.fleet["model"] == USER))


def _behind(trajectory: Trajectory, place: np.ndarray, given: int) -> int | None:
    """Return the step up to which a robot that got stuck at a place drives as before.

    None if it did so to the end already.
    """
    n = len(trajectory.control)
    if given >= n:
        return None
    rest = trajectory.state[given + 1 :, :2]
    nearest = int(np.hypot(*(rest - place).T).argmin())
    return min(n, given + 1 + nearest + int(REPEATED_S / trajectory.dt_s))


def _deeper(
    problem: Problem, tour: Sequence[int], trajectory: Trajectory, path: Path
) -> Path:
    """Return the path led deeper into the first target that was missed, if any was."""
    visits = visit_steps(problem.mission.targets, tour, trajectory)
    if len(visits) == len(tour):
        return path
    t = tour[len(visits)]
    region = planned_regions(problem.scene)[t]
    first = visits[-1] if visits else 0
    reached = float(region.depth(trajectory.state[first:, :2]).max())
    i = len(visits) - (len(tour) - len(path.target))
    needed = TARGET_MARGIN_M - reached
    deeper = path.deeper.copy()
    deeper[i] += max(needed, 0.0) + DEEPER_M
    return replace(path, deeper=deeper)


def _cheaper(
    problem: Problem,
    params: PlannerParams,
    plan: Plan,
    trajectories: Sequence[Trajectory],
) -> Plan:
    """Return the plan of new trajectories if it is valid and cheaper, else `plan`."""
    targets = problem.mission.targets
    for trajectory, finish in zip(trajectories, targets.finish, strict=True):
        if finish >= 0 and not in_target(targets, finish, *trajectory.state[-1, :2]):
            return plan
    found = make_plan(problem, plan.seed, params, trajectories, plan.tours)
    if found is None or found.cost_J >= plan.cost_J:
        return plan
    return found
