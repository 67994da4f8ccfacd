"""Robots that cannot drive backwards are planned for as others are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from solved import verified_plan

import mrmg
from mrmg.planning import PlannerParams
from mrmg.planning.path_following.following import tour_path
from mrmg.planning.problem.problem import Problem
from mrmg.plans import Plan
from mrmg.scene.types import Scene

PARAMS = PlannerParams(samples=400, improvements=0)


def forwards(scene: Scene) -> Scene:
    """Return a scene whose robots have no reverse gear."""
    robots = (
        replace(
            one,
            model=replace(one.model, limits=replace(one.model.limits, v_min_m_s=0.0)),
        )
        for one in scene.robots
    )
    return replace(scene, robots=tuple(robots))


def forward_plan_of(scene: Scene) -> Plan:
    plan = verified_plan(forwards(scene), 0, PARAMS)
    assert all((one.state[:, 3] >= -1e-9).all() for one in plan.trajectories)
    return plan


@pytest.mark.parametrize("name", ["scene1", "diffdrive", "mixed"])
def test_missions_without_reverse_gears_have_plans(name: str) -> None:
    scene = mrmg.load_scene(name)
    assert forward_plan_of(scene).cost_J < 1.15 * verified_plan(scene, 0, PARAMS).cost_J


def test_their_paths_do_not_change_gear(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    goals = [
        {"id": f"g{x}", "circle": {"center": [x, 10], "radius": 1}} for x in (20, 8)
    ]
    scene = yard(goals=goals)
    gears = [
        set(tour_path(state(each, samples=0), 0, [0, 1]).gear.tolist())
        for each in (scene, forwards(scene))
    ]
    assert gears == [{1, -1}, {1}]


def test_others_come_back_without_turning(yard: Callable[..., Scene]) -> None:
    """Robots that turn on the spot do not, where to drive backwards spares it."""
    robots = [{"id": "r1", "model": "husky", "pose": [4, 10, 0], "finish": "start"}]
    scene = yard(robots=robots)
    state = verified_plan(scene, 0, PARAMS).trajectories[0].state
    assert np.abs(np.diff(state[:, 2])).sum() < 0.3
    forward_state = forward_plan_of(scene).trajectories[0].state
    assert np.abs(np.diff(forward_state[:, 2])).sum() > 2.5


@pytest.mark.parametrize("model", ["car", "diffdrive"])
def test_they_go_round_to_headings(yard: Callable[..., Scene], model: str) -> None:
    """To one that looks back to where they come from, and to one beside them."""
    robots = [
        {
            "id": "r1",
            "model": model,
            "pose": [6, 10, 0],
            "finish": {"circle": {"center": [6, 13], "radius": 0.5}, "heading": 0.0},
        }
    ]
    goals = [{"id": "g", "circle": {"center": [20, 10], "radius": 1}, "heading": 3.14}]
    forward_plan_of(yard(robots=robots, goals=goals))


def test_they_make_room_for_each_other(crossing: Scene) -> None:
    forward_plan_of(crossing)
