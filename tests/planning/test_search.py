"""The anytime search, with attempts whose outcome and duration are given."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.planning import Improvement, PlannerParams, plan_mission
from mrmg.planning.attempt import Attempt, GivenUp
from mrmg.planning.search import Search
from mrmg.planning.statistics import Statistics, gap_of
from mrmg.plans import Plan

COSTS = (90.0, None, 70.0, 80.0, 60.0, 65.0, 50.0, None, 55.0, 40.0)
"""Energy of the plan of each attempt; None for none."""


class Priced:
    """Stands for a plan: the search asks for nothing but cost and duration."""

    def __init__(self, number: int, cost_J: float, makespan_s: float = 9.0) -> None:
        self.number = number
        self.cost_J = cost_J
        self.makespan_s = makespan_s


def search(
    params: PlannerParams, workers: int, attempt: Callable[..., Attempt], **more: Any
) -> Search:
    return Search(
        attempt=attempt,
        params=params,
        statistics=Statistics(),
        workers=workers,
        on_progress=lambda fraction, text: None,
        on_improvement=more.get("on_improvement", lambda improvement: None),
        proof=lambda *_: None,
    )


def made(number: int, halt: np.ndarray) -> Attempt:
    """Return the given outcome, late attempts sooner than early ones."""
    time.sleep(0.02 / (1 + number))
    cost_J = COSTS[number % len(COSTS)]
    if cost_J is None:
        return Attempt(counts={"vertices": 1})
    found: Any = Priced(number, cost_J)
    return Attempt([found], (), 0.001, {"vertices": 1})


@pytest.mark.parametrize("workers", [1, 2, 5])
@pytest.mark.parametrize(
    ("trees", "improvements", "best", "counted"),
    [(10, 1, 0, 2), (10, 2, 2, 3), (10, 10, 9, 10), (3, 9, 2, 3), (1, 0, 0, 1)],
)
def test_attempts_count_in_order_whatever_the_workers(
    workers: int, trees: int, improvements: int, best: int, counted: int
) -> None:
    params = PlannerParams(trees=trees, improvements=improvements)
    work = search(params, workers, made)
    found: Any = work.run()
    assert found.number == best
    assert work.statistics.counts["vertices"] == counted
    costs = [improvement.cost_J for improvement in work.statistics.improvements]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == found.cost_J


def test_no_attempts_are_begun_that_cannot_count() -> None:
    for trees, improvements, needed in ((10, 1, 2), (2, 9, 2), (10, 3, 4)):
        params = PlannerParams(trees=trees, improvements=improvements)
        work = search(params, 2, lambda number, halt: made(0, halt))
        work.run()
        assert work.begun == needed


def test_plans_are_there_when_they_count() -> None:
    def swift_later(number: int, halt: np.ndarray) -> Attempt:
        time.sleep(0.1 if number == 0 else 0.0)
        plans: Any = [Priced(number, 9.0)] if number else []
        return Attempt(plans, [time.perf_counter()] if number else ())

    work = search(PlannerParams(trees=2, improvements=1), 2, swift_later)
    assert work.run() is not None
    assert work.statistics.improvements[0].time_s >= 0.1


def test_plans_that_keep_the_margins_wanted_are_better_than_others() -> None:
    def some_tight(number: int, halt: np.ndarray) -> Attempt:
        given_up = {0: GivenUp.DISTANCES, 4: GivenUp.CHARGE}.get(number, GivenUp.NONE)
        return replace(made(number, halt), given_up=given_up)

    work = search(PlannerParams(trees=6, improvements=6), 1, some_tight)
    found: Any = work.run()
    assert found.number == 5
    costs = [improvement.cost_J for improvement in work.statistics.improvements]
    assert costs == [90.0, 70.0, 65.0]


def test_a_time_limit_halts_what_is_under_way() -> None:
    def endless(number: int, halt: np.ndarray) -> Attempt:
        while number and not halt[0]:
            time.sleep(0.001)
        return made(0, halt)

    work = search(PlannerParams(budget_s=0.2), 2, endless)
    found: Any = work.run()
    assert found.number == 0
    assert work.statistics.elapsed() >= 0.2


def test_an_attempt_that_does_not_end_is_left_behind() -> None:
    never = threading.Event()

    def stubborn(number: int, halt: np.ndarray) -> Attempt:
        if number:
            never.wait()
        return made(0, halt)

    found: Any = search(PlannerParams(budget_s=0.2), 1, stubborn).run()
    assert found.number == 0
    never.set()


def test_no_time_means_no_attempt() -> None:
    work = search(PlannerParams(budget_s=1e-9), 1, made)
    assert work.run() is None
    assert work.statistics.counts == {}


def test_finding_nothing_ends_even_with_time_left() -> None:
    def nothing(number: int, halt: np.ndarray) -> Attempt:
        return Attempt(counts={"vertices": 1})

    work = search(PlannerParams(budget_s=600.0, trees=2), 1, nothing)
    assert work.run() is None
    assert work.statistics.counts["vertices"] == 20


@pytest.mark.parametrize("budget_s", [600.0, None])
def test_an_interrupt_keeps_the_plan_of_a_search_with_a_limit(
    budget_s: float | None,
) -> None:
    def stop(improvement: Improvement) -> None:
        raise KeyboardInterrupt

    params = PlannerParams(budget_s=budget_s)
    work = search(params, 1, made, on_improvement=stop)
    if budget_s is None:
        with pytest.raises(KeyboardInterrupt):
            work.run()
        return
    found: Any = work.run()
    assert found.number == 0
    assert work.interrupted


def test_an_interrupt_before_the_first_plan_is_passed_on() -> None:
    def interrupted(number: int, halt: np.ndarray) -> Attempt:
        raise KeyboardInterrupt

    work = search(PlannerParams(budget_s=600.0), 1, interrupted)
    with pytest.raises(KeyboardInterrupt):
        work.run()
    assert threading.active_count() < 10


def test_a_fault_in_an_attempt_is_not_swallowed() -> None:
    def broken(number: int, halt: np.ndarray) -> Attempt:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        search(PlannerParams(), 3, broken).run()


@pytest.mark.parametrize(
    ("cost_J", "bound_J", "gap"),
    [(12.0, 10.0, 0.2), (10.0, 10.0, 0.0), (0.0, 0.0, None), (5.0, None, None)],
)
def test_the_gap_is_cost_over_bound_less_one(
    cost_J: float, bound_J: float | None, gap: float | None
) -> None:
    assert gap_of(cost_J, bound_J) == (gap if gap is None else pytest.approx(gap))


# --- with the planner behind it ------------------------------------------------------


def plan(workers: int, **more: Any) -> Any:
    scene = mrmg.load_scene("quickstart")
    params = replace(PlannerParams(), trees=4, improvements=4)
    return plan_mission(scene, seed=1, params=params, workers=workers, **more)


def test_the_plan_does_not_depend_on_the_number_of_workers() -> None:
    one, three = plan(1), plan(3)
    assert isinstance(one.plan, Plan)
    assert one.plan.digest == three.plan.digest
    costs = [
        [found["cost_J"] for found in result.statistics["improvements"]]
        for result in (one, three)
    ]
    assert costs[0] == costs[1]


def test_improvements_are_told_and_judged_by_the_bound() -> None:
    told: list[Improvement] = []
    result = plan(1, with_bound=True, on_improvement=told.append)
    rows = result.statistics["improvements"]
    assert [found.cost_J for found in told] == [row["cost_J"] for row in rows]
    assert [found.time_s for found in told] == [row["time_s"] for row in rows]
    bound_J = result.statistics["bound_J"]
    assert 0.0 < bound_J <= result.plan.cost_J
    for row in rows:
        assert row["bound_J"] == bound_J
        assert row["gap"] == pytest.approx(row["cost_J"] / bound_J - 1.0)
    assert result.statistics["gap"] == rows[-1]["gap"]
