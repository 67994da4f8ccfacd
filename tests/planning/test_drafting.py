"""Drafts: plans along tours without a tree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import mrmg
from mrmg.mission import Plan
from mrmg.planning import PlannerParams
from mrmg.planning.drafting import draft, draftable, tour_path
from mrmg.planning.motion_tree import Problem
from mrmg.planning.planner import state_mission
from mrmg.planning.routers import route
from mrmg.scene.types import Scene

PARAMS = PlannerParams(samples=600)


def drafted(scene: Scene) -> tuple[Problem, Plan | None]:
    problem = state_mission(scene, 0, PARAMS)
    tours = route(problem.mission.routing, PARAMS.router, 0)
    return problem, draft(problem, PARAMS, tours, 0, np.zeros(1, np.bool_))


@pytest.mark.parametrize("name", ["quickstart", "scene2"])
def test_a_draft_is_a_valid_plan_and_the_same_again(name: str) -> None:
    scene = mrmg.load_scene(name)
    _, plan = drafted(scene)
    assert plan is not None
    assert mrmg.verify(scene, plan).violations == ()
    _, again = drafted(scene)
    assert again is not None
    assert again.digest == plan.digest


def test_a_car_backs_out_of_a_target_that_lies_at_a_sharp_turn(
    yard: Callable[..., Scene],
) -> None:
    goals = [
        {"id": "g1", "circle": {"center": [24, 10], "radius": 1.5}},
        {"id": "g2", "circle": {"center": [10, 10], "radius": 1.5}},
    ]
    problem = state_mission(yard(goals=goals), 0, PARAMS)
    path = tour_path(problem, 0, [0, 1])
    assert set(path.gear[: path.stop[0]]) == {1}
    assert set(path.gear[path.stop[0] :]) == {-1}
    assert len(path.pivot) == 0


def test_halted_it_gives_nothing(yard: Callable[..., Scene]) -> None:
    problem = state_mission(yard(), 0, PARAMS)
    tours = route(problem.mission.routing, PARAMS.router, 0)
    assert draft(problem, PARAMS, tours, 0, np.ones(1, np.bool_)) is None


def test_ends_with_a_heading_are_not_drafted(yard: Callable[..., Scene]) -> None:
    problem = state_mission(yard(), 0, PARAMS)
    assert draftable(problem)
    targets = problem.mission.targets
    turned = targets._replace(
        finish=np.zeros_like(targets.finish),
        tolerance=np.full_like(targets.tolerance, 0.2),
    )
    mission = problem.mission._replace(targets=turned)
    assert not draftable(replace(problem, mission=mission))
