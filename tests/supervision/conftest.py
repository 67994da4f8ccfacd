"""Small missions for the tests of supervision."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from mrmg.planning import plan_mission
from mrmg.plans import Plan
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene


def mission_scene(**changes: Any) -> Scene:
    """Two cars on open ground, three goals and a station."""
    document = {
        "format": 1,
        "name": "yard",
        "bounds": [0, 0, 40, 24],
        "goals": [
            {"id": "g1", "circle": {"center": [20, 18], "radius": 1.5}},
            {"id": "g2", "circle": {"center": [33, 18], "radius": 1.5}},
            {"id": "g3", "circle": {"center": [33, 5], "radius": 1.5}},
        ],
        "stations": [{"id": "s1", "circle": {"center": [20, 11], "radius": 1.5}}],
        "battery": {"capacity_m": 120, "reserve": 0.05},
        "robots": [
            {"id": "r1", "model": "car", "pose": [5, 18, 0]},
            {"id": "r2", "model": "car", "pose": [5, 5, 0]},
        ],
    }
    return scene_from_document({**document, **changes}, source="yard")


@pytest.fixture(scope="session")
def make_yard() -> Callable[..., Scene]:
    """Return the maker of such scenes; it takes the parts that differ."""
    return mission_scene


@pytest.fixture(scope="session")
def yard() -> Scene:
    return mission_scene()


@pytest.fixture(scope="session")
def yard_plan(yard: Scene) -> Plan:
    plan = plan_mission(yard, seed=0).plan
    assert plan is not None
    return plan
