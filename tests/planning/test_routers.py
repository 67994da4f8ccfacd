"""What every router promises, and the options of the routing problem.

Tours are judged by driving them leg by leg (`fully_driven`), and compared with all
tours there are (`cheapest`), which share nothing with the routers.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest

from mrmg.errors import UsageError
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.routers import ROUTERS, route
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.routing import METHODS, RouterParams, Routing, routing_arrays

SLACK = 1e-9
"""Share by which sums may differ."""

Mission = Callable[..., RoutingArrays]


def town(
    seed: int,
    *,
    goals: int = 3,
    stations: int = 1,
    robots: int = 2,
    range_m: tuple[float, float] = (150.0, 250.0),
    closed: bool = False,
    **options: Any,
) -> RoutingArrays:
    """Return a mission over 100 x 100 m with one-way slopes, driven at 2 m/s.

    Args:
        seed: draws everything.
        goals, stations, robots: their numbers.
        range_m: between these lies the way a full battery lasts for.
        closed: whether robots return to where they start.
        options: further arguments of `routing_arrays`.
    """
    rng = np.random.default_rng(seed)
    targets = goals + stations
    point = rng.uniform(0.0, 100.0, (targets + robots, 2))
    way = np.hypot(*(point[:, None] - point[None]).transpose(2, 0, 1))
    climb = rng.uniform(0.0, 20.0, len(point))
    cost = way + np.maximum(climb[None] - climb[:, None], 0.0)
    dwell = rng.uniform(0.0, 20.0, targets)
    capacity = rng.uniform(*range_m, robots)
    legs = [np.r_[np.arange(targets), targets + r] for r in range(robots)]
    if closed:
        options["finish_distance"] = np.stack(
            [cost[leg, targets + r] for r, leg in enumerate(legs)]
        )
        options["finish_time"] = np.stack(
            [way[leg, targets + r] / 2.0 for r, leg in enumerate(legs)]
        )
    return routing_arrays(
        goals=goals,
        distance=np.repeat(cost[None, :targets, :targets], robots, axis=0),
        start_distance=cost[targets:, :targets],
        plain=np.ones(robots),
        energy=capacity * rng.uniform(0.5, 1.0, robots),
        capacity=capacity,
        reserve=0.05 * capacity,
        time=np.stack([way[leg, :targets] / 2.0 + dwell for leg in legs]),
        **options,
    )


def fully_driven(
    problem: RoutingArrays, robot: int, tour: Sequence[int]
) -> tuple[float, float, bool]:
    """Return (energy, time, whether it can be driven) of a tour and its finish."""
    place = problem.cost.shape[2]
    energy, spent, clock = problem.energy[robot], 0.0, 0.0
    least = np.inf
    for target in tour:
        leg = problem.cost[robot, place, target]
        spent += leg
        energy -= leg
        least = min(least, energy)
        clock += problem.time[robot, place, target]
        if target >= problem.goals:
            clock += (problem.capacity[robot] - energy) / problem.charge_power[robot]
            energy = problem.capacity[robot]
        place = target
    leg = problem.finish[robot, place]
    moves = len(tour) > 0 or leg > 0.0
    least = min(least, energy - leg)
    enough = not moves or least >= problem.reserve[robot] * (1.0 - SLACK)
    clock += problem.finish_time[robot, place]
    in_time = clock <= problem.limit[robot] * (1.0 + SLACK)
    return spent + leg, clock, bool(enough and in_time)


def objective(problem: RoutingArrays, tours: Sequence[Sequence[int]]) -> float:
    """Return the objective of tours; inf if one of them cannot be driven."""
    driven = [fully_driven(problem, r, tour) for r, tour in enumerate(tours)]
    if not all(fine for _, _, fine in driven):
        return np.inf
    spent = sum(cost for cost, _, _ in driven)
    longest = max(time for _, time, _ in driven)
    return problem.energy_weight * spent + problem.makespan_weight * longest


def divisions(goals: int, robots: int) -> Iterator[list[tuple[int, ...]]]:
    """Yield all ways to give goals in order to robots."""
    for order in itertools.permutations(range(goals)):
        for cuts in itertools.combinations_with_replacement(
            range(goals + 1), robots - 1
        ):
            edges = (0, *cuts, goals)
            yield [order[a:b] for a, b in itertools.pairwise(edges)]


def cheapest(problem: RoutingArrays) -> float:
    """Return the least objective of all tours with up to two stations in a row."""
    goals, robots = problem.goals, len(problem.energy)
    stations = range(goals, problem.cost.shape[2])
    pauses = [p for n in range(3) for p in itertools.permutations(stations, n)]
    ways: dict[tuple[int, tuple[int, ...]], set[tuple[float, float]]] = {}
    for r in range(robots):
        for n in range(goals + 1):
            for own in itertools.permutations(range(goals), n):
                found = set()
                for choice in itertools.product(pauses, repeat=n + 1):
                    tour = [
                        t
                        for pause, goal in zip(choice, (*own, None), strict=True)
                        for t in (*pause, goal)
                        if t is not None
                    ]
                    cost, time, fine = fully_driven(problem, r, tour)
                    if fine:
                        found.add((cost, time))
                ways[r, own] = {
                    (c, t)
                    for c, t in found
                    if not any(
                        (a <= c and b < t) or (a < c and b <= t) for a, b in found
                    )
                }
    best = np.inf
    for division in divisions(goals, robots):
        choices = [ways[r, own] for r, own in enumerate(division)]
        for fleet in itertools.product(*choices):
            spent = sum(cost for cost, _ in fleet)
            longest = max(time for _, time in fleet)
            value = problem.energy_weight * spent + problem.makespan_weight * longest
            best = min(best, value)
    return best


def assert_valid(problem: RoutingArrays, routing: Routing) -> None:
    """Every open goal once, energy and time within their limits, the cost as stated."""
    visited = [t for tour in routing.tours for t in tour if t < problem.goals]
    assert sorted(visited) == np.flatnonzero(problem.open_goal).tolist()
    driven = [fully_driven(problem, r, tour) for r, tour in enumerate(routing.tours)]
    assert all(fine for _, _, fine in driven)
    assert routing.cost_J == pytest.approx(sum(cost for cost, _, _ in driven))


def renamed(
    problem: RoutingArrays, goal: np.ndarray, robot: np.ndarray
) -> RoutingArrays:
    """Return a problem whose goal i was goal[i] before, and likewise its robots."""
    stations = np.arange(problem.goals, problem.cost.shape[2])
    target = np.r_[goal, stations]
    place = np.r_[target, problem.cost.shape[2]]
    return problem._replace(
        cost=np.ascontiguousarray(problem.cost[np.ix_(robot, place, target)]),
        time=np.ascontiguousarray(problem.time[np.ix_(robot, place, target)]),
        energy=problem.energy[robot],
        capacity=problem.capacity[robot],
        reserve=problem.reserve[robot],
        escape=np.ascontiguousarray(problem.escape[np.ix_(robot, target)]),
        finish=np.ascontiguousarray(problem.finish[np.ix_(robot, place)]),
        finish_time=np.ascontiguousarray(problem.finish_time[np.ix_(robot, place)]),
        limit=problem.limit[robot],
        charge_power=problem.charge_power[robot],
    )


# --- what every router promises ----------------------------------------------------


@pytest.fixture(params=sorted(ROUTERS))
def params(request: pytest.FixtureRequest) -> RouterParams:
    """Return the parameters of each router."""
    return RouterParams(method=request.param)


OPTIONS: list[dict[str, Any]] = [
    {},
    {"closed": True},
    {"closed": True, "limit": np.full(2, 240.0)},
    {"limit": np.full(2, 200.0), "charge_power": np.full(2, 4.0)},
    {"makespan_weight": 1.0, "charge_power": np.full(2, 4.0)},
]


@pytest.mark.parametrize("options", OPTIONS, ids=lambda o: "-".join(o) or "plain")
def test_tours_are_valid(params: RouterParams, options: dict[str, Any]) -> None:
    feasible = 0
    for seed in range(12):
        problem = town(seed, goals=6, stations=2, **options)
        routing = route(problem, params, seed)
        if routing.feasible:
            assert_valid(problem, routing)
            feasible += 1
        else:
            assert routing.cost_J == np.inf
    assert feasible >= 6


def test_the_same_seed_gives_the_same_tours(params: RouterParams) -> None:
    problem = town(1, goals=9, stations=2)
    assert route(problem, params, 3) == route(problem, params, 3)


def test_costs_scale_with_energy(params: RouterParams) -> None:
    for seed in range(6):
        problem = town(seed, goals=6, stations=2)
        names = ("cost", "energy", "capacity", "reserve", "escape")
        fourfold = problem._replace(**{n: 4.0 * getattr(problem, n) for n in names})
        once = route(problem, params, seed).cost_J
        assert route(fourfold, params, seed).cost_J == pytest.approx(4.0 * once)


@pytest.mark.parametrize("method", ["search", "exact"])
def test_names_do_not_matter(method: str) -> None:
    for seed in range(8):
        rng = np.random.default_rng(seed)
        problem = town(seed, goals=7, stations=2, robots=3, closed=seed % 2 == 0)
        other = renamed(problem, rng.permutation(7), rng.permutation(3))
        params = RouterParams(method=method)
        cost = route(problem, params, seed).cost_J
        assert route(other, params, seed).cost_J == pytest.approx(cost, rel=0.01)


def test_no_goals_cost_nothing(params: RouterParams) -> None:
    problem = town(0, closed=True)._replace(open_goal=np.zeros(3, bool))
    assert route(problem, params, 0) == Routing(((), ()), 0.0)


def test_a_goal_out_of_reach_makes_costs_infinite(params: RouterParams) -> None:
    problem = town(0)
    cost = problem.cost.copy()
    cost[:, :, 1] = np.inf
    assert not route(problem._replace(cost=cost), params, 0).feasible


def test_a_finish_out_of_reach_makes_costs_infinite(params: RouterParams) -> None:
    problem = town(0, closed=True)
    finish = np.full_like(problem.finish, np.inf)
    assert not route(problem._replace(finish=finish), params, 0).feasible


def test_an_unknown_router_is_refused_by_name() -> None:
    assert set(METHODS) == set(ROUTERS)
    with pytest.raises(UsageError, match=r"'magic'; there are: nrpa, search, exact"):
        PlannerParams(router=RouterParams(method="magic"))


# --- options against all tours there are -------------------------------------------


@pytest.mark.parametrize(
    "options",
    [
        {"closed": True},
        {"closed": True, "range_m": (120.0, 180.0)},
        {"closed": True, "limit": np.full(2, 150.0)},
        {"limit": np.full(2, 100.0), "charge_power": np.full(2, 8.0)},
        {"range_m": (110.0, 160.0), "limit": np.full(2, 130.0), "stations": 2},
        {"makespan_weight": 1.0, "energy_weight": 0.0},
        {"makespan_weight": 2.0, "charge_power": np.full(2, 4.0), "closed": True},
    ],
    ids=lambda options: "-".join(options),
)
def test_the_search_finds_the_best_tours(options: dict[str, Any]) -> None:
    feasible = 0
    for seed in range(8):
        problem = town(seed, **options)
        best = cheapest(problem)
        routing = route(problem, RouterParams(), seed)
        if not np.isfinite(best):
            assert not routing.feasible
            continue
        feasible += 1
        assert_valid(problem, routing)
        assert objective(problem, routing.tours) == pytest.approx(best, rel=1e-3)
    assert feasible >= 3


def test_exact_tours_return_to_the_start() -> None:
    feasible = 0
    for seed in range(10):
        problem = town(seed, closed=True, range_m=(100.0, 200.0), stations=2)
        best = cheapest(problem)
        routing = route(problem, RouterParams(method="exact"), seed)
        assert routing.cost_J == pytest.approx(best)
        if routing.feasible:
            assert_valid(problem, routing)
            feasible += 1
    assert feasible >= 3


def test_any_number_of_stations_may_stand_in_a_row(chain: RoutingArrays) -> None:
    routing = route(chain, RouterParams(), 0)
    assert routing == Routing(((1, 2, 3, 4, 5, 0),), 60.0)


def test_charging_counts_towards_the_limit() -> None:
    """The goal is 20 J away with 15 J left; 35 J are charged on the way."""
    way = np.array([[0.0, 10.0], [10.0, 0.0]])
    place = {
        "goals": 1,
        "distance": way[None],
        "start_distance": np.array([[20.0, 10.0]]),
        "plain": np.ones(1),
        "energy": np.array([15.0]),
        "capacity": np.array([40.0]),
        "reserve": np.zeros(1),
        "time": np.array([[[0.0, 10.0], [10.0, 0.0], [20.0, 10.0]]]),
    }
    slow = routing_arrays(**place, charge_power=np.ones(1))
    assert route(slow, RouterParams(), 0).tours == ((1, 0),)
    assert fully_driven(slow, 0, (1, 0))[1] == 10.0 + 35.0 + 10.0
    late = routing_arrays(**place, charge_power=np.ones(1), limit=np.array([54.0]))
    assert not route(late, RouterParams(), 0).feasible
    fast = routing_arrays(**place, charge_power=np.full(1, 2.0), limit=np.array([54.0]))
    assert route(fast, RouterParams(), 0).feasible
