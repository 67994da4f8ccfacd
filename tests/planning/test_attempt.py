"""What every way to find plans promises, be it drafting or growing a tree.

Both refine what they find: plans of one attempt are each better than the one before.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.energy.metering import battery_profile
from mrmg.planning import PlannerParams, attempt
from mrmg.planning.attempt import Attempt, attempt_plan, draft_plans, tree_plans
from mrmg.planning.planner import state_mission
from mrmg.planning.problem.problem import Problem
from mrmg.plans import Plan
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[1] / "scenes"
PARAMS = PlannerParams(samples=500)
WAYS: tuple[Callable[..., Attempt], ...] = (draft_plans, tree_plans, attempt_plan)
MISSIONS = ("quickstart", "station_needed", "polygon_regions", "blocks_only_r1")


@cache
def problem_of(name: str) -> Problem:
    own = SCENES / f"{name}.yaml"
    scene = mrmg.load_scene(own if own.exists() else name)
    return state_mission(scene, 0, PARAMS)


def attempted(way: Callable[..., Attempt], name: str, number: int = 0) -> Attempt:
    return way(problem_of(name), 7, PARAMS, number, np.zeros(1, np.bool_))


@pytest.fixture(params=WAYS, ids=lambda way: way.__name__)
def way(request: pytest.FixtureRequest) -> Callable[..., Attempt]:
    return request.param


@pytest.mark.parametrize("name", MISSIONS)
def test_plans_are_valid_and_each_better_than_the_last(
    way: Callable[..., Attempt], name: str
) -> None:
    problem = problem_of(name)
    plans = [plan for _, plan in attempted(way, name).plans]
    assert plans
    for plan in plans:
        assert mrmg.verify(problem.scene, plan).violations == ()
    for before, after in pairwise(plans):
        assert problem.preference.rank(after) < problem.preference.rank(before)


def digests(way: Callable[..., Attempt], number: int) -> list[str]:
    found = attempted(way, "quickstart", number)
    return [plan.digest for _, plan in found.plans]


def test_an_attempt_is_a_function_of_its_number(way: Callable[..., Attempt]) -> None:
    """Whatever was attempted in between."""
    numbers = (0, 3, 1)
    first = [digests(way, number) for number in numbers]
    assert [digests(way, number) for number in reversed(numbers)] == first[::-1]


def test_other_numbers_grow_other_trees() -> None:
    assert digests(tree_plans, 0) != digests(tree_plans, 1)


def test_halted_it_gives_nothing(way: Callable[..., Attempt]) -> None:
    halt = np.ones(1, np.bool_)
    found = way(problem_of("quickstart"), 7, PARAMS, 0, halt)
    assert list(found.plans) == []


def test_trees_are_grown_only_where_drafting_fails() -> None:
    drafted = attempted(attempt_plan, "quickstart")
    assert drafted.counts == {"drafts": 1, "router_calls": 1}
    without = PlannerParams(samples=500, drafts=False)
    halt = np.zeros(1, np.bool_)
    grown = attempt_plan(problem_of("quickstart"), 7, without, 0, halt)
    assert grown.counts["vertices"] > 1
    assert "drafts" not in grown.counts


def test_other_tours_are_drafted_before_a_tree_grows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where robots get stuck along the router's tours, they may not along others."""
    driven: list[tuple[tuple[int, ...], ...]] = []
    drive = attempt.drafts

    def failing_at_first(*given: Any, **options: Any) -> Iterator[Plan]:
        driven.append(given[2].tours)
        return drive(*given, **options) if len(driven) > 3 else iter(())

    monkeypatch.setattr(attempt, "drafts", failing_at_first)
    found = attempted(attempt_plan, "scene1")
    assert found.plans
    assert "vertices" not in found.counts
    assert driven[3] not in driven[:2]


def test_drafts_that_failed_are_counted_with_the_tree(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With and without charge to spare, along other tours, then the tree."""
    monkeypatch.setattr(attempt, "drafts", lambda *_, **__: iter(()))
    found = attempted(attempt_plan, "quickstart")
    assert found.counts["drafts"] == 4
    assert found.counts["router_calls"] >= 5
    assert found.counts["vertices"] > 1


@pytest.mark.parametrize("spare", [0.0, 0.1, 0.2])
def test_plans_leave_charge_to_spare(spare: float) -> None:
    problem = problem_of("station_needed")
    params = replace(PARAMS, spare=spare)
    found = attempt_plan(problem, 7, params, 0, np.zeros(1, np.bool_))
    for _, plan in found.plans:
        assert least_share(problem.scene, plan) >= spare
    assert found.plans


def test_who_cannot_spare_charge_is_planned_for_all_the_same() -> None:
    problem = problem_of("station_needed")
    params = replace(PARAMS, spare=0.9)
    assert attempt_plan(problem, 7, params, 0, np.zeros(1, np.bool_)).plans
    for way in (draft_plans, tree_plans):
        spared = problem.with_soc_margin(0.9)
        assert not way(spared, 7, params, 0, np.zeros(1, np.bool_)).plans


def least_share(scene: Scene, plan: Plan) -> float:
    """Least charge above the reserve, as a share of the capacity."""
    shares = []
    for trajectory in plan.trajectories:
        battery = scene.robot(trajectory.robot).battery
        visits = [visit for visit in plan.visits if visit.robot == trajectory.robot]
        least_J = battery_profile(scene, trajectory, visits).min()
        shares.append((least_J - battery.reserve_J) / battery.capacity_J)
    return min(shares)
