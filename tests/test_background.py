"""Work that may be left behind, and bounds that are given up."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable

import numpy as np
import pytest

from mrmg.background import in_background, within
from mrmg.planning import planner
from mrmg.planning.bound.bound import lower_bound_J
from mrmg.planning.bounding import bounds_beside, bounds_of
from mrmg.planning.feasibility import proof_of_infeasibility
from mrmg.planning.halting import NEVER, Halted
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.planner import plan_mission
from mrmg.planning.problem.problem import state_mission, tightened
from mrmg.planning.statistics import Bounds, Statistics
from mrmg.plans import PlanStatus
from mrmg.scene.loading import load_scene

SET = np.ones(1, np.bool_)


def test_what_ends_in_time_gives_its_result() -> None:
    assert within(lambda: 3, math.inf) == 3
    assert within(lambda: 3, 60.0) == 3
    assert within(lambda: threading.Event().wait(0.05), 1e10) is False


def test_what_does_not_end_in_time_is_left_behind() -> None:
    go_on = threading.Event()
    assert within(go_on.wait, 0.01) is None
    go_on.set()


def test_errors_reach_whoever_waits() -> None:
    with pytest.raises(ZeroDivisionError):
        within(lambda: 1 // 0, math.inf)


def test_a_halted_bound_is_given_up() -> None:
    with pytest.raises(Halted):
        lower_bound_J(load_scene("quickstart"), cells=200, halt=SET)


def test_bounds_stop_when_nobody_waits_for_them() -> None:
    statistics, scene = Statistics(), load_scene("quickstart")
    bounds_beside(scene, 0.1, statistics, anytime=False, halt=SET).result()
    assert statistics.bounds == Bounds()


def test_a_halted_proof_is_given_up() -> None:
    with pytest.raises(Halted):
        proof_of_infeasibility(load_scene("quickstart"), SET)


@pytest.mark.parametrize("build", [state_mission, tightened])
def test_a_halted_roadmap_is_given_up(build: Callable[..., object]) -> None:
    with pytest.raises(Halted):
        build(load_scene("quickstart"), 0, PlannerParams(), SET)


def test_coarse_bounds_come_first_and_better_ones_replace_them() -> None:
    statistics, scene = Statistics(), load_scene("quickstart")
    bounds_beside(scene, 0.1, statistics, anytime=True, halt=NEVER).result()
    coarse, fine = bounds_of(scene, 0.1, cells=1000), bounds_of(scene, 0.1)
    assert statistics.bounds == coarse.raised_by(fine)


def test_the_greater_of_two_bounds_counts() -> None:
    known = Bounds(energy_J=5.0).raised_by(Bounds(energy_J=3.0, makespan_s=2.0))
    assert known == Bounds(energy_J=5.0, makespan_s=2.0)


def test_a_plan_does_not_wait_for_its_bound_beyond_the_budget(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    never = threading.Event()
    monkeypatch.setattr(
        "mrmg.planning.bounding.bounds_of", lambda *_, **__: never.wait()
    )
    result = plan_mission(
        load_scene("quickstart"), params=PlannerParams(budget_s=0.5), with_bound=True
    )
    never.set()
    assert result.plan is not None
    assert result.statistics["gap"] is None


def test_a_roadmap_that_takes_too_long_is_no_plan_and_is_given_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given_up = threading.Event()

    def endless(*args: np.ndarray) -> None:
        while not args[-1][0]:
            given_up.wait(0.01)
        given_up.set()

    monkeypatch.setattr(planner, "state_mission", endless)
    result = plan_mission(load_scene("quickstart"), params=PlannerParams(budget_s=0.1))
    assert given_up.wait(60.0)
    assert result.plan is None
    assert result.status is PlanStatus.TIMEOUT
    assert "the budget of 0.1 s was over before" in result.reason


def test_futures_of_background_work_are_done_in_any_order() -> None:
    first, second = threading.Event(), in_background(lambda: 2)
    waiting = in_background(first.wait)
    assert second.result() == 2
    assert not waiting.done()
    first.set()
    assert waiting.result()
