"""Where a body has room at a place, or a proof that it has none: a search over poses.

A box of poses (x, y, yaw) is given up where the body in its middle meets an obstacle
even when it is shrunk by as far as its points move within the box: it then does so in
every pose of the box. So is one that has no more room than another pose, even where it
has most. Other boxes are divided (branch and bound).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import inf, pi
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import Polygon

from mrmg.planning.free_ground import FreeGround
from mrmg.scene.region import Region
from mrmg.scene.robot_model import placed
from mrmg.scene.types import Finish, Goal, Robot, Scene

ACCURACY_M = 0.008
"""How much more room there may be in another pose, unless it is asked for better."""

FINEST_SHARE = 0.25
"""How far points of the body move within boxes that are no longer divided, as a share
of that."""

MOST_BOXES = 20_000
"""Boxes that are looked at together at most: a fifth of a second, and 20 MB."""


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses of a robot: the reference point in a region, the yaw about a heading.

    Attributes:
        region: of the reference point.
        heading_rad: of the robot.
        tolerance_rad: by which the yaw may differ from it, at most pi.
    """

    region: Region
    heading_rad: float
    tolerance_rad: float

    @staticmethod
    def at(place: Goal | Finish) -> Poses:
        """Return the poses that count as being at a place."""
        if place.heading_rad is None:
            return Poses(place.region, 0.0, pi)
        return Poses(place.region, place.heading_rad, place.heading_tolerance_rad)


class Room(NamedTuple):
    """How much room there is in some poses.

    Attributes:
        pose: the best one known: (x [m], y [m], yaw [rad]), shape (3,).
        room_m: how far the body is from obstacles there; -inf if no pose is known that
            meets no obstacle.
        most_m: no pose has more.
    """

    pose: np.ndarray
    room_m: float
    most_m: float


def roomiest_pose(
    scene: Scene,
    robot: Robot,
    poses: Poses,
    enough_m: float = 0.0,
    accuracy_m: float = ACCURACY_M,
) -> Room | None:
    """Return the pose in which a body has most room, or enough of it.

    None if it surely meets an obstacle, or leaves the map, in every pose.

    Args:
        scene: gives obstacles and bounds.
        robot: the body.
        poses: from which one is chosen.
        enough_m: room that is enough.
        accuracy_m: by which it may be less than the most.
    """
    outline, reach_m = robot.model.footprint_m, robot.model.circumscribed_radius_m
    low_m, high_m = np.reshape(shapely.bounds(poses.region.shape), (2, 2))
    boxes = np.array([[*(low_m + high_m) / 2.0, poses.heading_rad]])
    half = np.array([*(high_m - low_m) / 2.0, poses.tolerance_rad])
    ground = FreeGround.of(scene, robot)
    land = shapely.box(*ground.bounds)
    near = shapely.box(*low_m, *high_m).buffer(reach_m + enough_m)
    walls = shapely.intersection(ground.obstacles, near)
    edges = shapely.union(walls, land.exterior)
    shapely.prepare([walls, land])

    def meets(bodies: np.ndarray) -> np.ndarray:
        outside = ~shapely.covers(land, bodies)
        return np.asarray(outside | shapely.intersects(walls, bodies))

    best, best_m, bound_m = boxes[0], -inf, np.array([inf])
    while len(boxes) <= MOST_BOXES:
        depth_m, off_m = poses.region.depth(boxes[:, :2]), float(np.hypot(*half[:2]))
        moved_m = half * (1.0, 1.0, reach_m)
        stray_m = off_m + moved_m[2]
        bodies = shapely.polygons(placed(outline, boxes))
        room_m = np.where(meets(bodies), -inf, shapely.distance(edges, bodies))
        inside_m = np.where(depth_m >= 0.0, room_m, -inf)
        if inside_m.max() > best_m:
            best, best_m = boxes[inside_m.argmax()], float(inside_m.max())
        if best_m >= enough_m:
            return Room(best, best_m, inf)
        bound_m = room_m.clip(0.0) + stray_m
        left = (depth_m >= -off_m) & (bound_m > best_m + accuracy_m)
        core = _shrunk(outline, stray_m)
        if len(core):
            left &= ~meets(shapely.polygons(placed(core, boxes)))
        boxes = boxes[left]
        if not len(boxes):
            return Room(best, best_m, best_m + accuracy_m) if best_m >= 0.0 else None
        if moved_m.max() < FINEST_SHARE * accuracy_m:
            break
        boxes, half = _divided(boxes, half, moved_m > moved_m.max() / 2.0)
    return Room(best, best_m, max(float(bound_m.max()), best_m + accuracy_m))


def _divided(
    boxes: np.ndarray, half: np.ndarray, sides: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return boxes of poses divided across some of their sides, and half of these."""
    half = np.where(sides, half / 2.0, half)
    steps = [(-1.0, 1.0) if each else (0.0,) for each in sides]
    return np.concatenate([boxes + half * step for step in product(*steps)]), half


def _shrunk(outline: np.ndarray, by_m: float) -> np.ndarray:
    """Return the corners of a footprint without what is near to its outline, if any."""
    core = Polygon(outline).buffer(-by_m, join_style="mitre")
    largest = max(shapely.get_parts(core), key=shapely.area, default=core)
    return np.asarray(shapely.get_coordinates(largest)[:-1])
