"""Robots and free spaces as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mrmg.planning.roadmap._fleet_kernels import space_of
from mrmg.planning.roadmap.fleet import stack_spaces, travel_classes
from mrmg.planning.roadmap.slopes import SlopeCost
from mrmg.scene.loading import scene_from_document
from mrmg.scene.margins import Margins
from mrmg.scene.types import Scene
from mrmg.world import _kernels, _polygon_kernels
from mrmg.world.world import World

CAR = np.array([(-0.3, -0.55), (1.5, -0.55), (1.5, 0.55), (-0.3, 0.55)])


def make_scene(blocks: list[list[str] | None]) -> Scene:
    """Return three robots among boxes, each of which stops some of them."""
    obstacles: list[dict[str, Any]] = []
    for i, names in enumerate(blocks):
        box = {"center": [12 + 7 * i, 10], "size": [3, 12], "yaw": 0.3 * i}
        more = {} if names is None else {"blocks": names}
        obstacles.append({"id": f"o{i}", "box": box, "height": 1, **more})
    document = {
        "format": 1,
        "name": "boxes",
        "bounds": [0, 0, 40.3, 20.1],
        "obstacles": obstacles,
        "goals": [{"id": "g", "circle": {"center": [37, 3], "radius": 1}}],
        "battery": {"capacity_m": 200},
        "robots": [
            {"id": name, "model": "car", "pose": [4, y, 0]}
            for name, y in (("r1", 4), ("r2", 10), ("r3", 16))
        ],
    }
    return scene_from_document(document, source="boxes")


def test_a_stack_answers_as_each_of_its_spaces_does() -> None:
    """Numbers of buckets and edges run on from space to space."""
    world = World.from_scene(make_scene([["r1"], None, ["r2", "r1"], ["r3"]]))
    assert len(world.spaces) == 3
    stack = stack_spaces(world)
    rng = np.random.default_rng(1)
    placed, told = np.empty_like(CAR), []
    for x, y, theta in rng.uniform((0, 0, -3), (40, 20, 3), (1500, 3)):
        _polygon_kernels.place_footprint(CAR, x, y, theta, placed)
        middle = placed.mean(axis=0)
        answers = []
        for i, alone in enumerate(world.spaces):
            stacked = space_of(stack, i)
            assert _kernels.clearance_estimate(
                stacked, x, y
            ) == _kernels.clearance_estimate(alone, x, y)
            clear = [
                _kernels.footprint_is_clear(space, placed, *middle, 1.06, 0.25)
                for space in (stacked, alone)
            ]
            assert clear[0] == clear[1]
            answers.append(clear[0])
        told.append(tuple(answers))
    assert len(set(told)) >= 5, "the spaces must differ"


@pytest.mark.parametrize(
    ("blocks", "expected"),
    [
        ([None], [0, 0, 0]),  # all alike
        ([["r2"]], [0, 1, 0]),  # one apart
        ([["r1"], ["r2"], ["r3"]], [0, 1, 2]),  # all apart
        ([["r1", "r2"], ["r2", "r1"]], [0, 0, 1]),  # the same pair, named twice
    ],
)
def test_robots_that_meet_the_same_obstacles_travel_alike(
    blocks: list[list[str] | None], expected: list[int]
) -> None:
    scene = make_scene(blocks)
    classes, of_robot = travel_classes(scene, World.from_scene(scene), Margins())
    assert all(item.slope == SlopeCost() for item in classes)
    assert of_robot == expected
    assert len(classes) == max(expected) + 1
    half_width = scene.robots[0].model.half_width_m
    assert all(half_width < passage < 2.0 * half_width for _, passage, _ in classes)
