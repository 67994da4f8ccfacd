"""Rules of margins: what a plan states to keep at its time steps, it keeps.

A plan may keep less than its margins only on stretches that it names, and there no less
than the certified minimum of the robot's model. How near to others a robot starts is
the scene's doing; it must not come nearer than that before it has got away.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import shapely

from mrmg.plans import Plan, Trajectory
from mrmg.scene.margins import certified_minimum_m
from mrmg.scene.types import Scene
from mrmg.verification.distances import boxes_apart_m, obstacle_distance
from mrmg.verification.motion_rules import violation_at, worst_of_runs
from mrmg.verification.verdict import Violation, ViolationKind

ROUNDING_M = 1e-6
"""Missing distance that is forgiven: rounding of coordinates and of sums [m]."""


def check_margins(scene: Scene, plan: Plan) -> Iterator[Violation]:
    """Yield where a plan keeps less than the margins it states."""
    yield from _stated_too_small(scene, plan)
    own = [item for item in plan.trajectories if item.robot in plan.margins]
    reach_m = [scene.robot(item.robot).model.circumscribed_radius_m for item in own]
    for trajectory in own:
        robot = scene.robot(trajectory.robot)
        distance_m = obstacle_distance(scene, robot, trajectory.state)
        wanted_m = plan.margins[robot.id][0]
        least_m = min(certified_minimum_m(robot.model), wanted_m)
        needed_m = np.full(len(distance_m), wanted_m)
        for narrow in plan.narrow:
            if narrow.robot == robot.id:
                first, last = (
                    round(time_s / plan.dt_s)
                    for time_s in (narrow.start_s, narrow.end_s)
                )
                needed_m[first : last + 1] = narrow.margin_m
        away = np.logical_or.accumulate(distance_m >= least_m)  # from the start
        needed_m[away] = np.maximum(needed_m[away], least_m)
        still = _steps_still(trajectory)
        yield from _violations(trajectory, distance_m, needed_m, still, "an obstacle")
    boxes_m = boxes_apart_m(own) if own else np.zeros((0, 0))
    for (i, one), (j, other) in combinations(enumerate(own), 2):
        spacing_m = max(plan.margins[item.robot][1] for item in (one, other))
        if boxes_m[i, j] >= spacing_m + reach_m[i] + reach_m[j]:
            continue
        distance_m = _distance_m(scene, one, other, spacing_m)
        needed_m = np.full(len(distance_m), spacing_m)
        still = _steps_still(one, other)
        yield from _violations(one, distance_m, needed_m, still, other.robot)


def _distance_m(
    scene: Scene, one: Trajectory, other: Trajectory, needed_m: float
) -> np.ndarray:
    """Return the distance of two robots at each step [m].

    Where circles around their footprints are apart as far as is needed, it is theirs.
    """
    models = [scene.robot(item.robot).model for item in (one, other)]
    reach_m = sum(model.circumscribed_radius_m for model in models)
    distance_m = np.hypot(*(one.state[:, :2] - other.state[:, :2]).T) - reach_m
    near = distance_m < needed_m
    shapes = [
        shapely.polygons(model.footprint_at(item.state[near]))
        for model, item in zip(models, (one, other), strict=True)
    ]
    distance_m[near] = shapely.distance(*shapes)
    return np.asarray(distance_m)


def _stated_too_small(scene: Scene, plan: Plan) -> Iterator[Violation]:
    """Yield the stretches that keep less than the certified minimum."""
    for narrow in plan.narrow:
        robot = scene.robot(narrow.robot)
        wanted_m = plan.margins.get(narrow.robot, (np.inf, np.inf))[0]
        least_m = min(certified_minimum_m(robot.model), wanted_m)
        if round(narrow.start_s / plan.dt_s) <= 0:
            start = plan.trajectory(robot.id).state[:1]
            least_m = min(least_m, float(obstacle_distance(scene, robot, start)[0]))
        if narrow.margin_m < least_m - ROUNDING_M:
            yield Violation(
                kind=ViolationKind.MARGIN,
                robot=narrow.robot,
                time_s=narrow.start_s,
                x_m=narrow.x_m,
                y_m=narrow.y_m,
                amount=least_m - narrow.margin_m,
                message=f"{narrow.robot}: keeps {narrow.margin_m:.3f} m in a "
                f"passage, less than the certified minimum of {least_m:.3f} m",
            )


def _steps_still(*trajectories: Trajectory) -> int:
    """Return for how many states from the start on nobody moves."""
    poses = np.hstack([item.state[:, :3] for item in trajectories])
    moved = (poses != poses[0]).any(axis=1)
    return int(moved.argmax()) if moved.any() else len(moved)


def _violations(
    trajectory: Trajectory,
    distance_m: np.ndarray,
    needed_m: np.ndarray,
    still: int,
    other: str,
) -> list[Violation]:
    """Return where a distance is less than needed.

    From a start that is nearer than needed a robot may stay as near, but not come
    nearer, until it has got away; if it never does, while it stands there.
    """
    missing_m = needed_m - distance_m
    broken = missing_m > ROUNDING_M
    leaving = still if broken.all() else int(broken.argmin())
    broken[:leaving] = distance_m[:leaving] < distance_m[0] - ROUNDING_M
    return [
        violation_at(
            trajectory,
            step,
            ViolationKind.MARGIN,
            f"is {distance_m[step]:.3f} m from {other}, and its margin there is "
            f"{needed_m[step]:.3f} m",
            amount=float(missing_m[step]),
        )
        for step in worst_of_runs(missing_m, broken)
    ]
