"""Where a body has most room: closed forms, and random rooms against many poses."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
import shapely

from mrmg.planning.free_ground import FreeGround
from mrmg.planning.standing import ACCURACY_M, Poses, Room, roomiest_pose
from mrmg.scene.loading import scene_from_document
from mrmg.scene.region import Region
from mrmg.scene.types import Scene

LENGTH_M, WIDTH_M = 1.8, 1.1
"""Of a car; its reference point is 0.3 m from the rear end."""

HOME = {"circle": {"center": [1.5, 1.5], "radius": 1.0}}


def room(boxes: list[dict[str, Any]], finish: dict[str, Any], model: str) -> Scene:
    """Return a room of 12 x 10 m with a robot in a corner and its finish."""
    document = {
        "format": 1,
        "name": "room",
        "bounds": [0, 0, 12, 10],
        "obstacles": [
            {"id": f"o{i}", "box": box, "height": 1.0} for i, box in enumerate(boxes)
        ],
        "battery": {"capacity_m": 100},
        "robots": [{"id": "r", "model": model, "pose": [1, 1, 0], "finish": finish}],
        "goals": [],
    }
    return scene_from_document(document, source="room")


def slit(width_m: float, heading: float | None, radius: float = 0.3) -> Scene:
    """Return a room whose finish lies in the middle of a slit along y."""
    side = 0.5 * width_m + 1.0
    walls = [{"center": [6 + x, 6], "size": [2, 4]} for x in (-side, side)]
    finish: dict[str, Any] = {"circle": {"center": [6, 6], "radius": radius}}
    if heading is not None:
        finish |= {"heading": heading, "heading_tolerance": 0.02}
    return room(walls, finish, "car")


def found(scene: Scene, enough_m: float = 5.0) -> Room | None:
    (robot,) = scene.robots
    assert robot.finish is not None
    return roomiest_pose(scene, robot, Poses.at(robot.finish), enough_m)


def clearance_m(scene: Scene, poses: np.ndarray) -> np.ndarray:
    """Return how far bodies are from obstacles and bounds; -inf where they meet."""
    (robot,) = scene.robots
    bodies = shapely.polygons(robot.model.footprint_at(poses))
    walls, land = FreeGround.of(scene, robot).obstacles, shapely.box(*scene.bounds)
    met = shapely.intersects(walls, bodies) | ~shapely.covers(land, bodies)
    distance_m = shapely.distance(shapely.union(walls, land.exterior), bodies)
    return np.where(met, -np.inf, distance_m)


@pytest.mark.parametrize("width_m", [1.2, 1.3, 1.7])
def test_most_room_in_a_slit_is_in_its_middle(width_m: float) -> None:
    best = found(slit(width_m, pi / 2))
    assert best is not None
    assert best.room_m == pytest.approx(
        0.5 * (width_m - WIDTH_M), abs=0.02 + ACCURACY_M
    )
    assert best.pose[0] == pytest.approx(6.0, abs=0.02 + ACCURACY_M)


@pytest.mark.parametrize(("width_m", "fits"), [(1.78, False), (1.82, True)])
def test_a_body_fits_across_a_slit_as_wide_as_it_is_long(
    width_m: float, fits: bool
) -> None:
    assert (found(slit(width_m, 0.0, radius=0.7)) is not None) is fits


@pytest.mark.parametrize(("width_m", "fits"), [(1.08, False), (1.12, True)])
def test_with_a_free_heading_a_body_fits_where_it_is_narrowest(
    width_m: float, fits: bool
) -> None:
    assert (found(slit(width_m, None)) is not None) is fits


def test_a_body_outside_the_map_has_no_room() -> None:
    finish = {"circle": {"center": [0.4, 5], "radius": 0.2}, "heading": 0.0}
    assert found(room([], {**finish, "heading_tolerance": 0.1}, "car")) is not None
    finish = {"circle": {"center": [0.05, 5], "radius": 0.2}, "heading": 0.0}
    assert found(room([], {**finish, "heading_tolerance": 0.1}, "car")) is None


@pytest.mark.parametrize(("back_m", "fits"), [(0.28, True), (0.36, False)])
def test_room_beside_the_region_is_none(back_m: float, fits: bool) -> None:
    """Nose to a wall, the car has room so far back; the region's box reaches 0.42 m."""
    along = np.sqrt(0.5) * (1.5 - back_m + 0.5)
    wall = {"center": [6 + along, 5 + along], "size": [1, 4], "yaw": pi / 4}
    finish: dict[str, Any] = {"circle": {"center": [6, 5], "radius": 0.3}}
    finish |= {"heading": pi / 4, "heading_tolerance": 0.01}
    assert (found(room([wall], finish, "car")) is not None) is fits


@pytest.mark.parametrize("seed", range(80))
def test_no_other_pose_has_more_room(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = [
        {
            "center": rng.uniform([4, 3], [11, 9]).tolist(),
            "size": rng.uniform(0.3, 2.5, 2).tolist(),
            "yaw": float(rng.uniform(0, pi)),
        }
        for _ in range(rng.integers(2, 7))
    ]
    center, radius = rng.uniform([4, 3], [11, 9]), float(rng.uniform(0.1, 0.8))
    heading = float(rng.uniform(-3, 3))
    tolerance = float(rng.uniform(0.05, 0.5)) if seed % 4 else pi
    scene = room(boxes, HOME, ("car", "diffdrive")[seed % 2])
    offset = radius * np.sqrt(rng.uniform(size=3000))
    angle = rng.uniform(0, 2 * pi, 3000)
    yaw = heading + rng.uniform(-tolerance, tolerance, 3000)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1) * offset[:, None]
    region = Region(center=center, radius_m=radius, corners=np.zeros((0, 2)))

    poses = np.column_stack([center + around, yaw])
    known_m = clearance_m(scene, poses).max()
    wanted = Poses(region, heading, tolerance)
    best = roomiest_pose(scene, scene.robots[0], wanted, enough_m=5.0)
    if best is None:
        assert known_m == -np.inf
        return
    pose, room_m, bound_m = best
    assert bound_m >= known_m
    assert room_m >= known_m - ACCURACY_M
    assert np.hypot(*(pose[:2] - center)) <= radius + 1e-9
    assert abs(pose[2] - heading) <= tolerance + 1e-9
    if room_m > -np.inf:
        assert room_m == pytest.approx(clearance_m(scene, pose[None]).max())


@pytest.mark.parametrize("seed", range(10))
def test_it_ends_where_there_is_room_enough(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = slit(float(rng.uniform(1.3, 2.5)), pi / 2)
    most = found(scene)
    enough = found(scene, enough_m=0.05)
    assert most is not None
    assert enough is not None
    assert 0.05 <= enough.room_m <= most.room_m + ACCURACY_M
