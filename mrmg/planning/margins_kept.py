"""The margins that a plan states to keep, and where it keeps less."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import shapely

from mrmg.energy.visits import runs
from mrmg.planning.roadmap.fleet import margins_of
from mrmg.plans import Plan, Trajectory
from mrmg.scene.margins import Margins, NarrowPassage, certified_minimum_m
from mrmg.scene.types import Robot, Scene

ROUNDING_M = 1e-7
"""Distance that a margin may be missed by for rounding alone [m]."""

STRETCH = 50
"""States in a row, which are looked at one by one only if a box about them is near an
obstacle: for 64 robots that takes a tenth of the time."""


def with_least_spacing(scene: Scene, margins: Margins) -> Scene:
    """Return a scene whose robots keep no more from each other than both may stray.

    Args:
        scene: the mission.
        margins: stated for all robots; those of the scene's robots hold them.
    """
    robots = []
    for robot in scene.robots:
        obstacle_m, robot_m = margins_of(robot, margins)
        if len(scene.robots) > 1:
            robot_m = min(robot_m, 2.0 * certified_minimum_m(robot.model))
        own = Margins(obstacle_m=obstacle_m, robot_m=robot_m)
        robots.append(replace(robot, margins=own))
    return replace(scene, robots=tuple(robots))


def with_margins(scene: Scene, plan: Plan, margins: Margins) -> Plan:
    """Return a plan that states its margins, and where robots keep less.

    Args:
        scene: the mission.
        plan: of it.
        margins: stated for all robots.
    """
    kept = {robot.id: margins_of(robot, margins) for robot in scene.robots}
    narrow = [
        passage
        for trajectory in plan.trajectories
        for passage in _narrow(
            scene,
            scene.robot(trajectory.robot),
            trajectory,
            kept[trajectory.robot][0],
        )
    ]
    return replace(plan, margins=kept, narrow=tuple(narrow))


def _narrow(
    scene: Scene, robot: Robot, trajectory: Trajectory, margin_m: float
) -> Iterator[NarrowPassage]:
    """Yield the stretches on which a robot keeps less than its margin."""
    bounds = shapely.box(*scene.bounds).boundary
    shapes = [item.shape for item in scene.barriers if item.stops(robot.id)]
    tree = shapely.STRtree([bounds, *shapes])
    least_m = margin_m - ROUNDING_M
    within_m = robot.model.circumscribed_radius_m + least_m
    place, n = trajectory.state[:, :2], len(trajectory.state)
    begins = np.arange(0, n, STRETCH)
    low = np.minimum.reduceat(place, begins) - within_m
    high = np.maximum.reduceat(place, begins) + within_m
    near = tree.query(shapely.box(*low.T, *high.T), predicate="intersects")[0]
    close = np.flatnonzero(np.isin(np.arange(n) // STRETCH, near))
    bodies = shapely.polygons(robot.model.footprint_at(trajectory.state[close]))
    less = np.unique(tree.query(bodies, predicate="dwithin", distance=least_m)[0])
    found, distance = tree.query_nearest(
        bodies[less], return_distance=True, all_matches=False
    )
    distance_m = np.full(n, np.inf)
    distance_m[close[less[found[0]]]] = distance
    for first, end in runs(distance_m < least_m):
        tightest = first + int(distance_m[first:end].argmin())
        x_m, y_m = trajectory.state[tightest, :2].tolist()
        yield NarrowPassage(
            robot=robot.id,
            start_s=round(float(first * trajectory.dt_s), 9),
            end_s=round(float((end - 1) * trajectory.dt_s), 9),
            x_m=x_m,
            y_m=y_m,
            margin_m=float(distance_m[tightest]),
        )
