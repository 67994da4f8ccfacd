"""Each feature that the paper does not have is named; a plain scene has none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrmg.planning.guided_tree.limits import unknown_features
from mrmg.scene.elevation import Elevation

CIRCLE = {"circle": {"center": [20, 10], "radius": 1}}


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({}, []),
        ({"goals": [{"id": "g", **CIRCLE, "dwell": 3}]}, ["dwell times (g)"]),
        ({"stations": [{"id": "s", **CIRCLE, "dwell": 3}]}, ["dwell times (s)"]),
        (
            {"stations": [{"id": "s", **CIRCLE, "capacity": 1}]},
            ["stations for one robot at a time (s)"],
        ),
        (
            {"battery": {"capacity_J": 20000, "charging_power": 500}},
            ["recharging that takes time (r1)"],
        ),
        (
            {
                "robots": [
                    {"id": "r1", "model": "car", "pose": [5, 10, 0], "finish": CIRCLE}
                ]
            },
            ["finishes (r1)"],
        ),
        ({"time_limit": 90}, ["time limits (90 s)"]),
        ({"objective": "makespan"}, ["objectives other than energy (makespan)"]),
    ],
)
def test_features_of_a_scene_are_named(
    changes: dict[str, Any], named: list[str], make_scene: Any
) -> None:
    assert unknown_features(make_scene(**changes)) == named


def test_elevation_and_custom_motion_are_named(make_scene: Any) -> None:
    scene = make_scene()
    flat = Elevation(bounds=scene.bounds, height_m=np.zeros((2, 2)))
    assert unknown_features(replace(scene, elevation=flat)) == ["elevation"]
    robot = scene.robots[0]
    own = replace(robot, model=replace(robot.model, motion_model="own_motion.py"))
    named = unknown_features(replace(scene, robots=(own,)))
    assert named == ["custom motion models (r1)"]
