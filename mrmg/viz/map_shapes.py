"""What covers a map, for pictures of it: obstacles, regions, robots and paths."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from shapely import box
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from mrmg.plans import Plan
from mrmg.scene.region import Region
from mrmg.scene.robot_model import placed
from mrmg.scene.types import Robot, Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz.label_placement import Occupied

_SIMPLIFIED_EM = 0.1
_BEYOND_WEIGHT = 10.0
"""What leaving the map costs a label, against overlapping something on it."""
_MARK_EM = 0.55
_END_RING_EM, _END_GAP_EM = 0.7, 0.25


def end_poses(
    plan: Plan | None, log: ExecutionLog | None
) -> dict[str, tuple[float, float, float]]:
    """Return where each robot comes to rest (x [m], y [m], yaw [rad])."""
    ends = {item.robot: item.state[-1] for item in plan.trajectories} if plan else {}
    if log is not None:
        ends = dict(zip(log.robots, log.state[:, -1], strict=True))
    return {robot: tuple(state[:3].tolist()) for robot, state in ends.items()}


def heading_arrow(region: Region, heading_rad: float) -> Polygon:
    """Return a triangle beside a region that points where a robot's nose shall."""
    reach_m = float(
        np.hypot(*(np.array(region.shape.exterior.coords) - region.center).T).max()
    )
    ahead = np.array([np.cos(heading_rad), np.sin(heading_rad)])
    aside = np.array([-ahead[1], ahead[0]])
    corners = [1.1 * ahead + 0.5 * aside, 2.0 * ahead, 1.1 * ahead - 0.5 * aside]
    return Polygon(region.center + reach_m * np.array(corners))


def wanted_headings(scene: Scene) -> Iterator[tuple[str, Polygon, float]]:
    """Yield whose heading it is (of a goal, or a robot's finish), its arrow and it."""
    ends = [(f"finish of {robot.id}", robot.finish) for robot in scene.robots]
    for name, place in [*((goal.id, goal) for goal in scene.goals), *ends]:
        if place and place.heading_rad is not None:
            arrow = heading_arrow(place.region, place.heading_rad)
            yield name, arrow, place.heading_rad


def enclosing_circle(
    robot: Robot, pose: tuple[float, float, float]
) -> tuple[np.ndarray, float]:
    """Return centre [m], shape (2,), and radius [m] of a circle about a robot."""
    return placed(robot.model.middle_m[None], pose)[0], robot.model.radius_m


def end_ring(
    robot: Robot, pose: tuple[float, float, float], em_m: float
) -> tuple[np.ndarray, float]:
    """Return centre and radius [m] of the mark about a robot that has come to rest.

    It goes around the robot, so that it hides nothing of it.
    """
    middle, radius_m = enclosing_circle(robot, pose)
    return middle, max(radius_m + _END_GAP_EM * em_m, _END_RING_EM * em_m)


def occupied(
    scene: Scene, plan: Plan | None, log: ExecutionLog | None, em_m: float
) -> tuple[list[Occupied], list[Occupied]]:
    """Return the shapes that labels keep off, and the lines they rather do not cross.

    Args:
        scene: the map.
        plan: adds paths and ends.
        log: moves the ends to where they were driven.
        em_m: size of the picture's letters on the ground.
    """
    x_min, y_min, x_max, y_max = scene.bounds
    beyond = x_max - x_min + y_max - y_min
    bounds = box(*scene.bounds)
    around = bounds.buffer(beyond, join_style="mitre") - bounds
    shapes = [Occupied(around, "", weight=_BEYOND_WEIGHT)]
    shapes += [Occupied(item.shape, item.id) for item in scene.barriers]
    shapes += [
        Occupied(drawn_region(item.region, em_m), item.id) for item in scene.targets()
    ]
    shapes += [Occupied(drawn_start(robot, em_m), robot.id) for robot in scene.robots]
    for robot_id, pose in end_poses(plan, log).items():
        middle, radius_m = end_ring(scene.robot(robot_id), pose, em_m)
        shapes.append(Occupied(Point(middle).buffer(radius_m), robot_id))
    lines = []
    for item in plan.trajectories if plan else ():
        if len(item.state) > 1:
            path = LineString(item.state[:, :2]).simplify(_SIMPLIFIED_EM * em_m)
            lines.append(Occupied(path, path_of(item.robot)))
    return shapes, lines


def path_of(robot: str) -> str:
    """Return what a robot's path is called among the things on a map."""
    return f"path of {robot}"


def drawn_region(region: Region, em_m: float) -> BaseGeometry:
    """Return a region together with the mark in its middle, which has a least size."""
    return region.shape.union(Point(region.center).buffer(_MARK_EM * em_m))


def drawn_start(robot: Robot, em_m: float) -> BaseGeometry:
    """Return a robot's outline at its start, together with a mark of a least size."""
    mark = Point(robot.pose[:2]).buffer(_MARK_EM * em_m)
    return Polygon(robot.model.footprint_at(robot.pose)).union(mark)
