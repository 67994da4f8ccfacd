"""Placing the stations in a route against plain enumeration."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from mrmg.planning.routing._insertion_kernels import value_with
from mrmg.planning.routing._legs_kernels import new_legs
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing._refuel_kernels import (
    label_route,
    new_labels,
    row_of,
)
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.planning.routing.routing import tour_of

SLACK_J = 1e-6


def refuelled(
    problem: RoutingArrays, route: tuple[int, ...]
) -> tuple[float, list[int]]:
    """Return the cost of robot 0's route and its targets, stations included."""
    legs = new_legs(problem)
    labels = new_labels(legs)
    goal = np.array(route, np.int64)
    cost, _, label = label_route(legs, labels, 0, goal, len(route), (0, 0))
    return cost, list(tour_of(legs, labels, 0, goal, label))


@pytest.mark.parametrize(
    ("goals", "stations"), [(1, 3), (2, 3), (3, 2), (3, 3), (5, 1)]
)
def test_stations_are_placed_as_enumeration_would(
    mission: Callable,
    replay: Callable,
    insertions: Callable,
    goals: int,
    stations: int,
) -> None:
    outcomes = []
    for seed in range(40):
        problem = mission(seed, goals=goals, stations=stations, range_m=(50.0, 120.0))
        if seed >= 25:  # ways over stations may be shorter
            factor = np.random.default_rng(seed).uniform(0.3, 1.5, problem.cost.shape)
            problem = problem._replace(cost=problem.cost * factor)
        route = tuple(range(goals))
        exact = min(
            (
                replay(problem, 0, tour)[0]
                for tour in insertions(route, range(goals, goals + stations), stations)
                if replay(problem, 0, tour)[1] >= 0.0
            ),
            default=np.inf,
        )
        cost, tour = refuelled(problem, route)
        if exact == np.inf:
            assert cost == np.inf
            assert tour == []
            outcomes.append("impossible")
            continue
        assert cost == pytest.approx(exact)
        driven, least = replay(problem, 0, tour)
        assert driven == pytest.approx(exact)
        assert least >= -SLACK_J
        assert [t for t in tour if t < goals] == list(route)
        outcomes.append("recharged" if len(tour) > goals else "direct")
    assert len(set(outcomes)) >= 2, "more than one kind must be drawn"


def test_a_route_of_no_goals_costs_nothing(mission: Callable) -> None:
    assert refuelled(mission(0, goals=2, stations=1), ()) == (0.0, [])


def test_a_larger_battery_never_costs_more(mission: Callable) -> None:
    for seed in range(20):
        problem = mission(seed, goals=5, stations=3, range_m=(60.0, 100.0))
        route = (0, 1, 2, 3, 4)
        costs = [
            refuelled(problem._replace(capacity=problem.capacity * k), route)[0]
            for k in (1.0, 1.2, 1.5, 2.0, 4.0)
        ]
        assert all(later <= earlier for earlier, later in itertools.pairwise(costs))


def test_without_stations_a_route_is_drivable_or_not() -> None:
    """Ten, then ten more joules: 25 suffice above a reserve of 5, 24 do not."""
    for energy, expected in ((25.0, 20.0), (24.0, None)):
        problem = RoutingInstance(
            goals=2,
            distance=np.array([[[0.0, 10.0], [10.0, 0.0]]]),
            start_distance=np.array([[10.0, 20.0]]),
            plain=np.ones(1),
            energy=np.array([energy]),
            capacity=np.array([100.0]),
            reserve=np.array([5.0]),
        ).arrays
        cost, tour = refuelled(problem, (0, 1))
        if expected is None:
            assert cost == np.inf
        else:
            assert (cost, tour) == (expected, [0, 1])


@pytest.mark.parametrize("seed", range(10))
def test_one_more_goal_is_worth_what_the_longer_route_costs(
    mission: Callable, seed: int
) -> None:
    problem = mission(seed, goals=5, stations=3, range_m=(50.0, 120.0))
    legs = new_legs(problem)
    labels = new_labels(legs)
    end = int(legs.home[0])
    route = (0, 1, 2, 3)
    goals = np.array(route)
    label_route(legs, labels, 0, goals, len(route), (0, 0))
    for place in range(len(route) + 1):
        a = route[place - 1] if place > 0 else end
        b = route[place] if place < len(route) else end
        front = row_of(legs, 0, goals, len(route), 0, place)
        back = row_of(legs, 0, goals, len(route), 1, len(route) - place)
        cost, _ = refuelled(problem, (*route[:place], 4, *route[place:]))

        def with_goal(
            ceiling: float, where: tuple = ((front, a), 4, (back, b))
        ) -> float:
            return value_with(legs, labels, 0, *where, 0.0, ceiling)

        assert with_goal(np.inf) == pytest.approx(cost)
        if cost < np.inf:
            assert with_goal(cost + 1.0) == pytest.approx(cost)
            assert with_goal(cost - 1.0) == np.inf


@pytest.mark.parametrize("slack_s", [0.1, -0.1])
@pytest.mark.parametrize(
    ("goal_m", "station_m", "finish_m", "energy_J", "charged_J"),
    [
        (25.0, 10.0, 25.0, 12.0, 28.0),  # the station comes before the goal
        (10.0, 15.0, 35.0, 20.0, 25.0),  # and behind it, on the way to the finish
    ],
)
def test_recharging_takes_its_time_and_routes_keep_their_limit(
    goal_m: float,
    station_m: float,
    finish_m: float,
    energy_J: float,
    charged_J: float,
    slack_s: float,
) -> None:
    """Along a line at 1 m/s and 1 J/m, with a battery of 30 J that is filled at 2 W."""
    expected_s = finish_m + charged_J / 2.0
    x = np.array([goal_m, station_m, 0.0])  # the start comes last
    apart = np.abs(x[:, None] - x)
    problem = RoutingInstance(
        goals=1,
        distance=apart[None, :2, :2],
        start_distance=apart[None, 2, :2],
        finish_distance=np.abs(finish_m - x)[None],
        plain=np.ones(1),
        energy=np.array([energy_J]),
        capacity=np.array([30.0]),
        reserve=np.zeros(1),
        time=apart[None, :, :2],
        finish_time=np.abs(finish_m - x)[None],
        limit=np.array([expected_s + slack_s]),
        charge_power=np.array([2.0]),
        makespan_weight=1.0,
    ).arrays
    legs = new_legs(problem)
    labels = new_labels(legs)
    goal, end = np.array([0]), int(legs.home[0])
    cost, time_s, _ = label_route(legs, labels, 0, goal, 1, (0, 0))
    kept = slack_s > 0.0
    assert (cost, time_s) == ((finish_m, expected_s) if kept else (np.inf, np.inf))
    label_route(legs, labels, 0, goal, 0, (0, 0))
    before, behind = ((row_of(legs, 0, goal, 0, side, 0), end) for side in range(2))
    value = value_with(legs, labels, 0, before, 0, behind, 0.0, np.inf)
    assert value == pytest.approx(finish_m + 1.001 * expected_s if kept else np.inf)


def test_a_goal_takes_the_time_of_recharging_behind_the_next_one() -> None:
    """Along a line at 1 m/s and 1 J/m; from 28 J, 3 J are left at the station."""
    x = np.array([10.0, 20.0, 25.0, 0.0])  # two goals, the station and the start
    apart, finish_m = np.abs(x[:, None] - x), 45.0
    problem = RoutingInstance(
        goals=2,
        distance=apart[None, :3, :3],
        start_distance=apart[None, 3, :3],
        finish_distance=np.abs(finish_m - x)[None],
        plain=np.ones(1),
        energy=np.array([28.0]),
        capacity=np.array([30.0]),
        reserve=np.zeros(1),
        time=apart[None, :, :3],
        finish_time=np.abs(finish_m - x)[None],
        charge_power=np.array([2.0]),
        makespan_weight=1.0,
    ).arrays
    legs = new_legs(problem)
    labels, route, end = new_labels(legs), np.array([1]), int(legs.home[0])
    label_route(legs, labels, 0, route, 1, (0, 0))
    before = row_of(legs, 0, route, 1, 0, 0), end
    behind = row_of(legs, 0, route, 1, 1, 1), 1
    value = value_with(legs, labels, 0, before, 0, behind, 0.0, np.inf)
    assert value == pytest.approx(finish_m + 1.001 * (finish_m + 27.0 / 2.0))
