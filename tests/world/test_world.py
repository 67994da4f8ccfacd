"""A scene's worlds: which obstacle stops which robot."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.world import _kernels
from mrmg.world.world import MARGIN_M, Opening, World

WALL = {"id": "wall", "box": {"center": [30, 10], "size": [2, 8]}, "height": 1.0}
KERB = {
    "id": "kerb",
    "box": {"center": [15, 10], "size": [2, 8]},
    "height": 0.3,
    "blocks": ["r1", "r3"],
}


def scene(*obstacles: dict) -> Scene:
    document = {
        "format": 1,
        "name": "kerbs",
        "bounds": [0, 0, 40, 20],
        "obstacles": list(obstacles),
        "goals": [{"id": "g", "circle": {"center": [35, 15], "radius": 1}}],
        "battery": {"capacity_m": 200},
        "robots": [
            {"id": name, "model": "car", "pose": [5, y, 0]}
            for name, y in (("r1", 4), ("r2", 10), ("r3", 16))
        ],
    }
    return scene_from_document(document, source="kerbs")


def test_robots_stopped_by_the_same_obstacles_share_a_space() -> None:
    world = World.from_scene(scene(WALL, KERB))
    assert world.space_of_robot.tolist() == [0, 1, 0]
    assert len(world.spaces) == len(world.obstacles) == 2
    kerb, wall = shapely.Point(15, 10), shapely.Point(30, 10)
    assert [shape.contains(kerb) for shape in world.obstacles] == [True, False]
    assert [shape.contains(wall) for shape in world.obstacles] == [True, True]


def test_an_obstacle_stops_only_the_robots_it_blocks() -> None:
    world = World.from_scene(scene(WALL, KERB))
    at_kerb = [_kernels.clearance_estimate(space, 15, 10) for space in world.spaces]
    at_wall = [_kernels.clearance_estimate(space, 30, 10) for space in world.spaces]
    assert at_kerb[0] < -0.8
    assert at_kerb[1] > 5.0
    assert max(at_wall) < -0.8


def test_without_particular_obstacles_there_is_one_space() -> None:
    world = World.from_scene(scene(WALL))
    assert len(world.spaces) == 1
    assert world.space_of_robot.tolist() == [0, 0, 0]
    assert len(World.from_scene(scene()).spaces) == 1


def test_reach_covers_the_farthest_corner_and_the_margin() -> None:
    fleet = scene(WALL)
    space = World.from_scene(fleet).spaces[0]
    model = fleet.robots[0].model
    assert space.reach >= MARGIN_M + model.circumscribed_radius_m - 1e-12


@pytest.mark.parametrize("away_m", [0.07, 0.15, 0.35])
@pytest.mark.parametrize("opened", [False, True])
def test_margins_are_smaller_by_the_allowance_in_openings(
    away_m: float, opened: bool
) -> None:
    """0.3 m beside the wall, and 0.1 m in the opening."""
    opening = Opening(
        shape=shapely.Point(26.0, 10.0).buffer(3.0),
        allowance_m=0.2,
        robots=(0, 1, 2),
    )
    world = World.from_scene(
        scene(WALL), cell_m=0.1, openings=(opening,) if opened else (), guide_m=0.05
    )
    corner = np.array(shapely.box(28.0, 9.5, 29.0 - away_m, 10.5).exterior.coords)[:-1]
    middle, radius = corner.mean(axis=0), 0.5 * np.hypot(*np.ptp(corner, axis=0))
    clear = _kernels.footprint_is_clear(world.spaces[0], corner, *middle, radius, 0.3)
    assert clear == (away_m > (0.1 if opened else 0.3))
