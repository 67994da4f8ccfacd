"""The router against exact answers on small random missions.

`oracle` is a label-setting dynamic programme that shares nothing with the router; it is
itself checked against plain enumeration here.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from time import thread_time

import numpy as np
import pytest

from mrmg.errors import UsageError
from mrmg.planning.routing._nrpa_kernels import RoutingArrays, with_own_tables
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.planning.routing.routing import RouterParams, Routing, solve_routing

SLACK_J = 1e-6

MISSED_SHARE = 0.0
"""Feasible missions the router may fail on, as a share."""

NEAR_SHARE = 0.95
"""Share of feasible missions it must solve within 1 % of the optimum."""

Mission = Callable[..., RoutingArrays]
Replay = Callable[..., tuple[float, float]]
Oracle = Callable[[RoutingArrays], float]


def assert_valid(problem: RoutingArrays, routing: Routing, replay: Replay) -> None:
    """Every open goal once, no battery below its reserve, the cost as stated."""
    visited = [t for tour in routing.tours for t in tour if t < problem.goals]
    assert sorted(visited) == np.flatnonzero(problem.open_goal).tolist()
    driven = [replay(problem, r, tour) for r, tour in enumerate(routing.tours)]
    assert min(least for _, least in driven) >= -SLACK_J
    assert routing.cost_J == pytest.approx(sum(cost for cost, _ in driven))


# --- the oracle --------------------------------------------------------------------


def test_the_oracle_agrees_with_enumeration(
    mission: Mission, replay: Replay, oracle: Oracle, insertions: Callable
) -> None:
    feasible = 0
    for seed in range(15):
        problem = mission(seed, goals=3, stations=2, range_m=(70.0, 180.0))
        exact = min(
            (
                replay(problem, 0, tour)[0]
                for order in itertools.permutations(range(3))
                for tour in insertions(order, range(3, 5), 2)
                if replay(problem, 0, tour)[1] >= 0.0
            ),
            default=np.inf,
        )
        assert oracle(problem) == pytest.approx(exact)
        feasible += np.isfinite(exact)
    assert 3 <= feasible <= 14


# --- whole missions ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("goals", "stations", "robots", "range_m"),
    [
        (4, 2, 1, (60.0, 160.0)),  # one robot
        (6, 2, 1, (90.0, 200.0)),  # one robot, more than a battery holds
        (5, 3, 2, (60.0, 160.0)),  # two robots, tight batteries
        (6, 3, 2, (90.0, 200.0)),  # two robots, many goals
        (6, 2, 3, (90.0, 200.0)),  # three robots
        (5, 0, 2, (120.0, 300.0)),  # nowhere to recharge
    ],
)
def test_tours_are_valid_and_near_the_optimum(
    mission: Mission,
    replay: Replay,
    oracle: Oracle,
    goals: int,
    stations: int,
    robots: int,
    range_m: tuple[float, float],
) -> None:
    near = feasible = missed = 0
    for seed in range(40):
        problem = mission(
            seed, goals=goals, stations=stations, robots=robots, range_m=range_m
        )
        optimum = oracle(problem)
        routing = solve_routing(problem, RouterParams(), seed)
        if not np.isfinite(optimum):
            assert not routing.feasible
            assert routing.cost_J == np.inf
            continue
        feasible += 1
        if not routing.feasible:
            missed += 1
            continue
        assert_valid(problem, routing, replay)
        assert routing.cost_J >= optimum * (1.0 - 1e-9), "cheaper than the optimum"
        near += routing.cost_J <= 1.01 * optimum
    assert feasible >= 10, "too few missions can be solved to say anything"
    assert missed <= MISSED_SHARE * feasible
    assert near >= NEAR_SHARE * feasible


@pytest.mark.parametrize(
    ("name", "value"), [("levels", 0), ("iterations", 0), ("rounds", -1)]
)
def test_parameters_out_of_range_are_refused_by_name(name: str, value: int) -> None:
    with pytest.raises(UsageError, match=f"{name} = {value}"):
        RouterParams(**{"method": "nrpa", name: value})


@pytest.mark.parametrize("rounds", [0, 100])
def test_the_same_seed_gives_the_same_tours(mission: Mission, rounds: int) -> None:
    problem = mission(3, goals=12, stations=4, robots=3, range_m=(150.0, 250.0))
    params = RouterParams(iterations=10, rounds=rounds)
    first = solve_routing(problem, params, 5)
    assert solve_routing(problem, params, 5) == first


def test_the_seed_matters(mission: Mission) -> None:
    problem = mission(3, goals=12, stations=4, robots=3, range_m=(150.0, 250.0))
    params = RouterParams(iterations=10, rounds=0)
    assert len({solve_routing(problem, params, seed).tours for seed in range(6)}) > 1


def test_robots_alike_may_share_their_legs() -> None:
    """Two of three robots do: tours are those of robots with legs of their own."""
    rng = np.random.default_rng(1)
    point = rng.uniform(0.0, 100.0, (15, 2))
    apart = np.hypot(*(point[:, None] - point[None]).transpose(2, 0, 1))
    table, capacity = np.array([1, 0, 1]), np.array([150.0, 130.0, 150.0])
    own = {
        "start_distance": apart[12:, :12],
        "finish_distance": np.stack([np.r_[apart[:12, 12 + r], 0.0] for r in range(3)]),
        "plain": np.array([1.0, 1.5, 1.0]),
        "energy": np.array([100.0, 120.0, 150.0]),
        "capacity": capacity,
        "reserve": 0.1 * capacity,
    }
    legs = apart[None, :12, :12]
    shared = RoutingInstance(
        goals=9, distance=np.repeat(legs, 2, 0), table=table, **own
    ).arrays
    alone = RoutingInstance(goals=9, distance=np.repeat(legs, 3, 0), **own).arrays
    assert shared.cost.shape == (2, 14, 12)
    separated = with_own_tables(shared)
    assert all(
        np.array_equal(ours, theirs)
        for ours, theirs in zip(separated, alone, strict=True)
    )
    for params in (RouterParams(), RouterParams(rounds=0)):
        found = solve_routing(shared, params, 0)
        assert found.feasible
        assert found == solve_routing(alone, params, 0)


def test_the_problem_is_left_as_it_was(mission: Mission) -> None:
    problem = mission(3, goals=6, stations=2, robots=2)
    before = [np.copy(item) for item in problem]
    solve_routing(problem, RouterParams(), 0)
    for old, new in zip(before, problem, strict=True):
        assert np.array_equal(old, new)


@pytest.mark.parametrize("seed", range(4))
def test_large_missions_are_valid_and_gain_from_local_search(
    mission: Mission, replay: Replay, seed: int
) -> None:
    problem = mission(seed, goals=20, stations=4, robots=4, range_m=(200.0, 300.0))
    alone = solve_routing(problem, RouterParams(rounds=0), seed)
    searched = solve_routing(problem, RouterParams(), seed)
    assert_valid(problem, searched, replay)
    if alone.feasible:
        assert_valid(problem, alone, replay)
    assert searched.cost_J <= alone.cost_J * (1.0 + 1e-9)


@pytest.mark.parametrize("range_m", [(100.0, 140.0), (150.0, 300.0)])
def test_tours_of_many_goals_are_valid(
    mission: Mission, replay: Replay, range_m: tuple[float, float]
) -> None:
    problem = mission(7, goals=70, stations=9, robots=5, range_m=range_m)
    routing = solve_routing(problem, RouterParams(rounds=300), 0)
    assert_valid(problem, routing, replay)
    assert any(target >= 70 for tour in routing.tours for target in tour)


def test_a_search_in_limited_time_takes_that_time(
    mission: Mission, replay: Replay
) -> None:
    problem = mission(7, goals=40, stations=6, robots=3, range_m=(150.0, 300.0))
    solve_routing(problem, RouterParams(rounds=1), 0)
    began = thread_time()
    routing = solve_routing(problem, RouterParams(rounds=1, limit_s=0.4), 0)
    assert 0.4 <= thread_time() - began <= 2.0
    assert_valid(problem, routing, replay)
    assert routing.cost_J < solve_routing(problem, RouterParams(rounds=1), 0).cost_J


def test_stations_that_nobody_needs_change_nothing(mission: Mission) -> None:
    problem = mission(2, goals=30, stations=4, robots=3, range_m=(2000.0, 3000.0))
    without = problem._replace(
        cost=np.delete(problem.cost, range(30, 34), axis=1)[:, :, :30].copy(),
        time=np.delete(problem.time, range(30, 34), axis=1)[:, :, :30].copy(),
        finish=np.delete(problem.finish, range(30, 34), axis=1),
        finish_time=np.delete(problem.finish_time, range(30, 34), axis=1),
        home=problem.home - 4,
    )
    found = solve_routing(problem, RouterParams(), 1)
    assert found == solve_routing(without, RouterParams(), 1)


@pytest.mark.parametrize(
    "open_goal",
    [
        (True, False, True, False, True),
        (False, False, False, True, False),  # one
    ],
)
def test_only_open_goals_are_visited(
    mission: Mission, replay: Replay, oracle: Oracle, open_goal: tuple[bool, ...]
) -> None:
    for seed in range(10):
        problem = mission(
            seed,
            goals=5,
            stations=2,
            robots=2,
            range_m=(150.0, 250.0),
            open_goal=open_goal,
        )
        routing = solve_routing(problem, RouterParams(), seed)
        assert_valid(problem, routing, replay)
        assert routing.cost_J == pytest.approx(oracle(problem), rel=0.01)


def test_nothing_left_to_visit_costs_nothing(mission: Mission) -> None:
    problem = mission(0, goals=3, stations=1, robots=2, open_goal=(False,) * 3)
    assert solve_routing(problem, RouterParams(), 0) == Routing(((), ()), 0.0)


def test_a_goal_beyond_every_battery_makes_the_mission_infeasible() -> None:
    problem = RoutingInstance(
        goals=2,
        distance=np.array([[[0.0, 5.0, 5.0], [5.0, 0.0, 80.0], [5.0, 80.0, 0.0]]]),
        start_distance=np.array([[5.0, 80.0, 5.0]]),
        plain=np.ones(1),
        energy=np.array([6.0]),
        capacity=np.array([7.0]),
        reserve=np.array([1.0]),
    ).arrays
    routing = solve_routing(problem, RouterParams(), 0)
    assert not routing.feasible
    assert routing.cost_J == np.inf


@pytest.mark.parametrize("stations", [0, 1])
def test_goals_cut_off_from_one_robot_go_to_the_other(
    replay: Replay, stations: int
) -> None:
    """Robot 0 cannot pass to goal 1, nor robot 1 to goal 0 and the station."""
    inf = np.inf
    apart = np.array([[0.0, inf, 4.0], [inf, 0.0, inf], [4.0, inf, 0.0]])
    kept = slice(0, 2 + stations)
    problem = RoutingInstance(
        goals=2,
        distance=np.stack([apart[kept, kept]] * 2),
        start_distance=np.array([[3.0, inf, 2.0], [inf, 3.0, inf]])[:, kept],
        plain=np.ones(2),
        energy=np.array([10.0, 10.0]),
        capacity=np.array([20.0, 20.0]),
        reserve=np.zeros(2),
    ).arrays
    routing = solve_routing(problem, RouterParams(), 0)
    assert routing.tours == ((0,), (1,))
    assert routing.cost_J == 6.0


def test_a_goal_cut_off_from_all_ends_in_an_infinite_cost() -> None:
    inf = np.inf
    problem = RoutingInstance(
        goals=2,
        distance=np.array([[[0.0, inf], [inf, 0.0]]]),
        start_distance=np.array([[3.0, inf]]),
        plain=np.ones(1),
        energy=np.array([10.0]),
        capacity=np.array([20.0]),
        reserve=np.zeros(1),
    ).arrays
    assert solve_routing(problem, RouterParams(), 0).cost_J == inf


def test_ties_do_not_make_the_search_run_in_circles(oracle: Oracle) -> None:
    """Identical robots, goals in one place, and no energy: every move is a tie."""
    for energy in (1.0, 30.0):
        problem = RoutingInstance(
            goals=4,
            distance=np.full((3, 5, 5), 10.0) * (1.0 - np.eye(5)),
            start_distance=np.full((3, 5), 10.0),
            plain=np.ones(3),
            energy=np.full(3, energy),
            capacity=np.full(3, 40.0),
            reserve=np.zeros(3),
        ).arrays
        routing = solve_routing(problem, RouterParams(), 0)
        assert routing.cost_J == oracle(problem)
