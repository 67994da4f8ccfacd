"""The narrowest place on the robots' ways, in words."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest

from mrmg.planning import PlannerParams
from mrmg.planning.frame import Frame
from mrmg.planning.meetings import narrowest_meeting
from mrmg.planning.problem.problem import state_mission
from mrmg.scene.loading import scene_from_document
from mrmg.scene.margins import STATES_NONE

WALLS = [
    {"box": {"center": [10.0, y], "size": [1.0, 5.0]}} for y in (2.5, 9.5)
]  # a gap of 2 m at (10, 6)

NARROW = [
    {"box": {"center": [10.0, y], "size": [1.0, 6.1]}} for y in (2.5, 9.5)
]  # 0.9 m

DIFFDRIVE = {"model": "diffdrive", "pose": [4, 6, 0]}
CAR = {"model": "car", "pose": [4, 6, 0]}
PARKED = {"model": "car", "pose": [0.5, 6, 0]}  # its back to the map's edge


@pytest.mark.parametrize(
    ("robot", "obstacles", "goal", "said"),
    [
        (DIFFDRIVE, NARROW, [16.0, 6.0], r", where it is 0\.\d\d m wide"),
        (PARKED, WALLS, [16.0, 6.0], r"near \((9|10)\..*, where it is 2\.\d\d m wide"),
        (
            CAR,
            [],
            [19.0, 6.0],
            r", 1\.\d\d m from the nearest obstacle or edge of the map",
        ),
        (DIFFDRIVE, [], [16.0, 6.0], "^"),  # it can turn round everywhere
    ],
)
def test_the_room_is_told_by_what_limits_it(
    robot: dict[str, Any],
    obstacles: list[dict[str, Any]],
    goal: list[float],
    said: str,
) -> None:
    """A gap by its width, and a place beside one wall by the distance from it."""
    document = {
        "format": 1,
        "name": "room",
        "bounds": [0, 0, 20, 12],
        "obstacles": obstacles,
        "robots": [{"id": "r1", **robot}],
        "goals": [{"id": "g1", "circle": {"center": goal, "radius": 0.4}}],
    }
    scene = scene_from_document(document, source="room")
    problem = state_mission(Frame.of(scene).scene(scene), 0, PlannerParams())
    assert problem is not None
    told = narrowest_meeting(replace(problem, scene=scene), [[0]], STATES_NONE)
    assert re.search(said + "$", told), told
