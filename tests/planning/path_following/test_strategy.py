"""What every way of path following to find plans promises.

Both refine what they find: plans of one attempt are each better than the one before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.energy.metering import battery_profile
from mrmg.planning import Attempt, PlannerParams, Problem, Request
from mrmg.planning.attempt import GivenUp
from mrmg.planning.path_following import strategy
from mrmg.planning.path_following.coordination.rounds import (
    COARSER,
    ROUNDS,
    Round,
    rounds_of,
)
from mrmg.planning.path_following.following import Followed
from mrmg.planning.path_following.refine import ROBOTS_MEET
from mrmg.planning.path_following.strategy import (
    Learnt,
    Schedule,
    follow_paths,
    path_following,
    search_motions,
)
from mrmg.planning.problem.problem import state_mission
from mrmg.planning.routers import find_router
from mrmg.plans import Plan
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[2] / "scenes"
PARAMS = PlannerParams(samples=500)


def request(number: int = 0, params: PlannerParams = PARAMS) -> Request:
    router = find_router(params.router)
    return Request(params=params, router=router, seed=7, number=number)


def along_paths(problem: Problem, asked: Request) -> Attempt:
    schedule = Schedule.of(problem, asked.params, asked.number)
    soc_margin, draws = schedule.followed[0]
    return follow_paths(problem, asked, draws, soc_margin, Learnt())


Way = Callable[[Problem, Request], Attempt]
WAYS: tuple[Way, ...] = (along_paths, search_motions, path_following)
MISSIONS = ("quickstart", "station_needed", "polygon_regions", "blocks_only_r1")


@cache
def problem_of(name: str) -> Problem:
    own = SCENES / f"{name}.yaml"
    scene = mrmg.load_scene(own if own.exists() else name)
    return state_mission(scene, 0, PARAMS)


def attempted(way: Way, name: str, number: int = 0) -> Attempt:
    return way(problem_of(name), request(number))


@pytest.fixture(params=WAYS, ids=lambda way: way.__name__)
def way(request: pytest.FixtureRequest) -> Way:
    return request.param


@pytest.mark.parametrize("name", MISSIONS)
def test_plans_are_valid_and_each_better_than_the_last(way: Way, name: str) -> None:
    problem = problem_of(name)
    plans = attempted(way, name).plans
    assert plans
    for plan in plans:
        assert mrmg.verify(problem.scene, plan).violations == ()
    for before, after in pairwise(plans):
        assert problem.preference.rank(after) < problem.preference.rank(before)


def digests(way: Way, number: int) -> list[str]:
    found = attempted(way, "quickstart", number)
    return [plan.digest for plan in found.plans]


def test_an_attempt_is_a_function_of_its_number(way: Way) -> None:
    """Whatever was attempted in between."""
    numbers = (0, 3, 1)
    first = [digests(way, number) for number in numbers]
    assert [digests(way, number) for number in reversed(numbers)] == first[::-1]


def test_other_numbers_find_other_motions() -> None:
    assert digests(search_motions, 0) != digests(search_motions, 1)


def test_halted_it_gives_nothing(way: Way) -> None:
    halted = replace(request(), halt=np.ones(1, np.bool_))
    found = way(problem_of("quickstart"), halted)
    assert list(found.plans) == []


def test_motions_are_searched_for_only_where_following_fails() -> None:
    followed = attempted(path_following, "quickstart")
    assert followed.counts == {"path_following_plans": 1, "router_calls": 1}
    without = PlannerParams(samples=500, follow_paths=False)
    grown = path_following(problem_of("quickstart"), request(params=without))
    assert grown.counts["coordinated"] == 1
    assert "path_following_plans" not in grown.counts


def test_other_tours_are_followed_before_motions_are_searched_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where robots get stuck along the router's tours, they may not along others."""
    driven: list[tuple[tuple[int, ...], ...]] = []
    drive = strategy.follow_tours

    def failing_at_first(*given: Any, **options: Any) -> Followed:
        driven.append(given[2].tours)
        return drive(*given, **options) if len(driven) > 2 else Followed(None)

    monkeypatch.setattr(strategy, "follow_tours", failing_at_first)
    found = attempted(path_following, "scene1")
    assert found.plans
    assert "coordinated" not in found.counts
    assert driven[2] not in driven[:2]


def test_tours_that_failed_are_counted_with_the_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The only tours there are, with more and less charge left; then the search."""
    monkeypatch.setattr(strategy, "follow_tours", lambda *_, **__: Followed(None))
    found = attempted(path_following, "quickstart")
    assert found.counts["path_following_plans"] == 2
    assert found.counts["router_calls"] >= 5
    assert found.counts["coordinated"] == 1


@pytest.mark.parametrize(("led", "begins_at"), [(True, 0), (False, 1)])
def test_no_search_without_paths_is_made_twice(
    led: bool, begins_at: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where following has searched without paths, the search begins a round further."""
    met = Followed(None, ROBOTS_MEET, driven=False, led=led)
    rounds: list[Sequence[Round]] = []
    monkeypatch.setattr(strategy, "follow_tours", lambda *_, **__: met)
    monkeypatch.setattr(
        strategy, "coordinated", lambda *_, **given: rounds.append(given["rounds"])
    )
    attempted(path_following, "quickstart")
    assert rounds == [ROUNDS[begins_at : begins_at + 1]]


def test_rounds_begin_anew_with_other_motions() -> None:
    rounds = [one for number in range(60) for one in rounds_of(number)]
    assert rounds[: len(ROUNDS)] == list(ROUNDS)
    assert len({(one.most, one.fineness) for one in rounds}) == len(rounds)
    for now, first in zip(rounds, 20 * ROUNDS, strict=True):
        assert COARSER[0] <= now.fineness / first.fineness <= 1.0


@pytest.mark.parametrize("soc_margin", [0.0, 0.1, 0.2])
def test_plans_leave_charge_to_spare(soc_margin: float) -> None:
    problem = problem_of("station_needed")
    params = replace(PARAMS, soc_margin=soc_margin)
    found = path_following(problem, request(params=params))
    for plan in found.plans:
        assert least_share(problem.scene, plan) >= soc_margin
    assert found.plans
    assert found.given_up == GivenUp.NONE


def test_who_cannot_spare_charge_is_planned_for_all_the_same() -> None:
    problem = problem_of("station_needed")
    params = replace(PARAMS, soc_margin=0.9)
    for way in WAYS:
        found = way(problem, request(params=params))
        assert found.plans
        assert found.given_up == GivenUp.CHARGE
    for way in (along_paths, search_motions):
        spared = problem.with_soc_margin(0.9)
        assert not way(spared, request(params=params)).plans


def least_share(scene: Scene, plan: Plan) -> float:
    """Least charge above the reserve, as a share of the capacity."""
    shares = []
    for trajectory in plan.trajectories:
        battery = scene.robot(trajectory.robot).battery
        visits = [visit for visit in plan.visits if visit.robot == trajectory.robot]
        least_J = battery_profile(scene, trajectory, visits).min()
        shares.append((least_J - battery.reserve_J) / battery.capacity_J)
    return min(shares)
