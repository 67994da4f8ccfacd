"""Missions around steep ground: planned, judged, bounded and driven as by obstacles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from mrmg.energy.audit import audit
from mrmg.planning import plan_mission
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.simulation.simulation import simulate
from mrmg.verification.verify import verify

HILL = {"center": [16, 12], "height": 5, "radius": 7}


def site(robots: list[dict[str, Any]], **changes: Any) -> Scene:
    """A steep hill between robots in the west and goals in the east."""
    document = {
        "format": 1,
        "name": "site",
        "bounds": [0, 0, 32, 24],
        "elevation": {"hills": [HILL], "slope": "avoid"},
        "goals": [{"id": "g", "circle": {"center": [28, 12], "radius": 1}}],
        "battery": {"capacity_m": 300, "reserve": 0.05},
        "robots": robots,
        **changes,
    }
    return scene_from_document(document, source="site")


@pytest.fixture(scope="module")
def scene() -> Scene:
    return site([{"id": "r1", "model": "car", "pose": [4, 12, 0]}])


def test_a_mission_leads_round_steep_ground(scene: Scene) -> None:
    result = plan_mission(scene, seed=0, with_bound=True)
    assert result.plan is not None
    assert verify(scene, result.plan).ok
    hull = shapely.union_all([item.shape for item in scene.barriers])
    way = shapely.LineString(result.plan.trajectories[0].state[:, :2])
    assert way.distance(hull) > 0.5
    assert result.statistics["bound_J"] <= result.plan.cost_J
    log = simulate(scene, result.plan)
    assert audit(scene, result.plan, log).mission_ok


def test_the_verifier_judges_steep_ground(scene: Scene) -> None:
    """A plan made as if the hill could be climbed breaks the rule for obstacles."""
    assert scene.elevation is not None
    tame = replace(scene, elevation=replace(scene.elevation, avoid_steep=False))
    plan = plan_mission(tame, seed=0).plan
    assert plan is not None
    flat = replace(plan, scene_digest=scene.digest)
    state = plan.trajectories[0].state.copy()
    through = np.abs(state[:, 1] - 12.0).max() < 5.0  # over the hill, not around it
    violations = [item.message for item in verify(scene, flat).violations]
    assert through == any("steep_ground" in message for message in violations)
    assert through


def test_only_robots_that_cannot_climb_are_kept_off() -> None:
    gentle = {"hills": [{**HILL, "height": 1.0}], "slope": "avoid"}
    robots = [
        {"id": "r1", "model": "car", "pose": [4, 12, 0]},
        {"id": "r2", "model": "diffdrive", "pose": [4, 18, 0]},
    ]
    goal = {"id": "g", "circle": {"center": [16, 12], "radius": 1}}
    scene = site(robots, elevation=gentle, goals=[goal])
    assert {name for item in scene.barriers for name in item.blocks or ()} == {"r1"}
    result = plan_mission(scene, seed=0)
    assert result.plan is not None, result.reason
    assert result.plan.tours["r2"] == ("g",)
    assert verify(scene, result.plan).ok
