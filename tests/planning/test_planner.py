"""The planner's answers: statuses, reproducibility, budgets and statistics."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.errors import SceneError
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.attempt import Attempt, Request
from mrmg.planning.path_following.strategy import path_following
from mrmg.planning.problem.problem import Problem
from mrmg.plans import PlanResult, PlanStatus
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[1] / "scenes"

MakeScene = Callable[..., Scene]


def edge_scene(name: str) -> Scene:
    return mrmg.load_scene(SCENES / f"{name}.yaml")


def digest(result: PlanResult) -> str:
    assert result.plan is not None, result.reason
    return result.plan.digest


# --- reproducibility ---------------------------------------------------------------


@pytest.mark.parametrize("name", ["two_swap", "station_needed", "obstacle_with_hole"])
def test_a_plan_is_a_function_of_scene_and_seed(name: str) -> None:
    scene = edge_scene(name)
    digests = [digest(plan_mission(scene, seed=seed)) for seed in (0, 1, 0)]
    assert digests[0] == digests[2]
    assert digests[0] != digests[1]


def test_other_parameters_give_a_plan_of_another_fingerprint() -> None:
    scene = edge_scene("one_goal")
    first = plan_mission(scene, seed=0)
    other = plan_mission(scene, seed=0, params=PlannerParams(samples=900))
    assert first.plan is not None and other.plan is not None
    assert first.plan.parameters_digest != other.plan.parameters_digest


def test_numbers_of_numpy_are_as_good_as_those_of_python() -> None:
    scene = edge_scene("one_goal")
    plain = plan_mission(scene, seed=1, params=PlannerParams(samples=600))
    params = PlannerParams(samples=np.int64(600))  # type: ignore[arg-type]
    seed: Any = np.arange(2)[1]
    assert digest(plan_mission(scene, seed=seed, params=params)) == digest(plain)


# --- margins -----------------------------------------------------------------------


@pytest.mark.parametrize(("failing", "tries"), [((1,), ()), ((0, 1), (1,))])
def test_margins_are_given_up_only_where_no_plan_keeps_them(
    failing: tuple[int, ...], tries: tuple[int, ...]
) -> None:
    wanted_m = list[float]()
    tight = list[int]()

    def planner(problem: Problem, request: Request) -> Attempt:
        spacing_m = float(problem.mission.fleet["spacing"].max())
        wanted_m.append(spacing_m)
        if spacing_m < wanted_m[0]:
            tight.append(request.number)
            return Attempt(tours_found=True)
        if request.number in failing:
            return Attempt(tours_found=True)
        return path_following(problem, request)

    scene, params = edge_scene("two_swap"), PlannerParams(improvements=2)
    result = plan_mission(scene, params=params, planner=planner)
    assert tuple(tight) == tries
    assert result.plan is not None
    assert {spacing_m for _, spacing_m in result.plan.margins.values()} == {0.5}


# --- limits ------------------------------------------------------------------------


def test_a_budget_is_spent_on_better_plans_and_kept() -> None:
    """The first call compiles what the second one is timed with."""
    scene = edge_scene("two_swap")
    free = plan_mission(scene, seed=0)
    began = time.perf_counter()
    result = plan_mission(scene, seed=0, params=PlannerParams(budget_s=1.5))
    assert time.perf_counter() - began >= 1.5
    assert result.status is PlanStatus.SOLVED
    assert result.plan is not None and free.plan is not None
    spent = result.statistics["time_s"]
    assert 0.0 < spent["first_solution"] <= spent["total"] >= 1.5
    tries, fewer = (one.statistics["path_following_plans"] for one in (result, free))
    assert tries > fewer
    assert result.plan.cost_J <= free.plan.cost_J


@pytest.mark.parametrize("name", ["two_swap", "station_needed"])
def test_without_time_it_is_out_of_budget_and_says_so(name: str) -> None:
    result = plan_mission(edge_scene(name), params=PlannerParams(budget_s=1e-6))
    assert result.status is PlanStatus.TIMEOUT
    assert result.plan is None
    assert result.reason


def test_a_proof_is_given_even_without_time() -> None:
    scene = edge_scene("goal_enclosed")
    result = plan_mission(scene, params=PlannerParams(budget_s=1e-6))
    assert result.status is PlanStatus.INFEASIBLE
    assert "g1" in result.reason


def test_a_fleet_of_none_is_a_fault_of_the_scene(yard: MakeScene) -> None:
    with pytest.raises(SceneError, match="robots"):
        plan_mission(yard(robots=[]))


# --- what it reports ---------------------------------------------------------------


@pytest.mark.parametrize("name", ["two_swap", "no_goals", "goal_out_of_energy"])
def test_statistics_have_all_counts_and_times(name: str) -> None:
    statistics = plan_mission(edge_scene(name)).statistics
    counts = {
        "path_following_plans",
        "vertices",
        "groups",
        "router_calls",
        "expansions",
    }
    assert counts <= set(statistics)
    assert set(statistics["time_s"]) == {"init", "routing", "first_solution", "total"}
    assert all(value >= 0.0 for value in statistics["time_s"].values())
    assert max(statistics["time_s"].values()) == statistics["time_s"]["total"]
    if name == "two_swap":
        assert statistics["router_calls"] >= 1


def test_progress_grows_from_the_roadmap_to_the_end() -> None:
    told: list[float] = []
    scene = edge_scene("two_swap")
    plan_mission(scene, on_progress=lambda fraction, text: told.append(fraction))
    assert len(told) >= 3
    assert told == sorted(told)
    assert told[0] == pytest.approx(0.1)
    assert told[-1] == pytest.approx(1.0)


def test_more_improvements_never_give_a_dearer_plan() -> None:
    scene = edge_scene("obstacle_with_hole")
    costs = []
    for improvements in (0, 1, 4):
        params = PlannerParams(improvements=improvements)
        plan = plan_mission(scene, seed=2, params=params).plan
        assert plan is not None
        costs.append(plan.cost_J)
    assert costs == sorted(costs, reverse=True)


def test_very_short_steps_leave_room_for_long_braking() -> None:
    params = PlannerParams(dt_s=0.005, improvements=0)
    result = plan_mission(mrmg.load_scene(SCENES / "one_goal.yaml"), params=params)
    assert result.plan is not None
    assert mrmg.verify(mrmg.load_scene(SCENES / "one_goal.yaml"), result.plan).ok


def test_an_unknown_argument_is_refused_with_those_there_are() -> None:
    with pytest.raises(TypeError, match="'budget'; allowed: seed, .*margins") as told:
        mrmg.plan(edge_scene("one_goal"), budget=3.0)  # type: ignore[call-arg]
    assert "PlannerParams(budget_s=30)" in str(told.value)
