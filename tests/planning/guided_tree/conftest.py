"""Recorded runs of the paper's method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from mrmg.planning.guided_tree.planner import Growth, grow_guided_tree
from mrmg.planning.parameters import GuidedTreeParams, PlannerParams, paper_params
from mrmg.planning.planner import state_mission
from mrmg.planning.tree.motion_tree import Problem
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

MISSION = {
    "format": 1,
    "name": "court",
    "bounds": [0, 0, 36, 24],
    "obstacles": [
        {"box": {"center": [16, 6], "size": [2, 9]}},
        {"box": {"center": [24, 17], "size": [9, 2]}},
    ],
    "terrain": [{"polygon": [[18, 0], [26, 0], [26, 10], [18, 10]], "multiplier": 2.0}],
    "goals": [
        {"id": "g1", "circle": {"center": [28, 5], "radius": 1.5}},
        {"id": "g2", "circle": {"center": [31, 20], "radius": 1.5}},
        {"id": "g3", "circle": {"center": [8, 20], "radius": 1.5}},
        {"id": "g4", "circle": {"center": [12, 12], "radius": 1.5}},
    ],
    "stations": [{"id": "s1", "circle": {"center": [21, 13], "radius": 1.5}}],
    "battery": {"capacity_m": 32, "reserve": 0.05},
    "robots": [
        {"id": "r1", "model": "car", "pose": [4, 4, 0], "energy": "paper"},
        {"id": "r2", "model": "car", "pose": [4, 9, 0], "energy": "paper"},
    ],
}
"""A mission in which robots collide, recharge, and lack energy for some tours."""


@dataclass(frozen=True)
class Recording:
    """A run of the method with all that was recorded of it."""

    scene: Scene
    problem: Problem
    params: PlannerParams
    growth: Growth


def record(seed: int, **changes: object) -> Recording:
    """Return a run of the mission, with changed parameters of the method."""
    scene = scene_from_document(MISSION, source="court")
    method = replace(GuidedTreeParams(iterations=4000), **changes)
    params = replace(paper_params(), guided_tree=method, samples=300)
    problem = state_mission(scene, seed, params)
    growth = grow_guided_tree(problem, params, seed, np.zeros(1, np.bool_))
    return Recording(scene, problem, params, growth)


@pytest.fixture(scope="package")
def recording() -> Recording:
    """Return a run whose trace is checked."""
    return record(4)


@pytest.fixture
def recorded() -> Callable[..., Recording]:
    """Return the maker of recordings."""
    return record


@pytest.fixture
def mission() -> dict[str, Any]:
    """Return the document of the mission."""
    return MISSION
