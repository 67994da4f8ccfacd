"""Distances of given poses: robots to obstacles and bounds, and to one another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from mrmg.plans import Trajectory
from mrmg.scene.types import Robot, Scene
from mrmg.verification.motion_rules import changing_steps


def obstacle_distance(scene: Scene, robot: Robot, poses: np.ndarray) -> np.ndarray:
    """Return the distance to the nearest obstacle that stops a robot, or to the bounds.

    Args:
        scene: gives obstacles and bounds.
        robot: whose footprint it is.
        poses: (x, y, theta, ...), shape (n, k).

    Returns:
        Distance [m], 0 on contact and outside the bounds, shape (n,).
    """
    changes = changing_steps(poses[:, :3])  # a robot that stays is looked at once
    outlines = robot.model.footprint_at(poses[changes])
    low, high = np.reshape(scene.bounds, (2, 2))
    outside = ((outlines < low) | (outlines > high)).any(axis=(1, 2))
    shapes = shapely.polygons(outlines)
    blocking = [item.shape for item in scene.barriers if item.stops(robot.id)]
    tree = shapely.STRtree([shapely.box(*scene.bounds).exterior, *blocking])
    _, distance = tree.query_nearest(shapes, return_distance=True, all_matches=False)
    distance[outside] = 0.0
    return np.asarray(distance[np.cumsum(changes) - 1])


def robot_distance(robots: Sequence[Robot], poses: Sequence[np.ndarray]) -> np.ndarray:
    """Return each robot's distance to the nearest other one.

    Args:
        robots: at least two.
        poses: of each robot (x, y, theta, ...), shape (n, k) each.

    Returns:
        Distance [m], shape (R, n).
    """
    shapes = [
        shapely.polygons(robot.model.footprint_at(at))
        for robot, at in zip(robots, poses, strict=True)
    ]
    nearest = np.full((len(shapes), len(shapes[0])), np.inf)
    for one in range(len(shapes)):
        for other in range(one):
            apart = shapely.distance(shapes[one], shapes[other])
            nearest[one] = np.minimum(nearest[one], apart)
            nearest[other] = np.minimum(nearest[other], apart)
    return nearest


def boxes_apart_m(trajectories: Sequence[Trajectory]) -> np.ndarray:
    """Return what boxes around reference points' motions are apart [m], (R, R)."""
    points = [item.state[:, :2] for item in trajectories]
    low, high = (np.array([f(own, axis=0) for own in points]) for f in (np.min, np.max))
    gap = np.maximum(low[:, None] - high, low - high[:, None]).clip(min=0.0)
    return np.asarray(np.hypot(gap[..., 0], gap[..., 1]))
