"""What routers promise beyond their contract, and the options of the routing problem.

Tours are compared with all tours there are (`cheapest`), which share nothing with the
routers.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.errors import UsageError
from mrmg.planning import Router, RoutingProblem
from mrmg.planning.routers import find_router
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.planning.routing.routing import RouterParams, Routing
from mrmg.planning.routing.routing_problem import faults_of_tours, tour_ledger
from mrmg.testing import RouterContract, sample_routing_problem

SLACK = 1e-9
"""Share by which sums may differ."""

SEARCH, NRPA, EXACT = (
    find_router(RouterParams(method=name)) for name in ("search", "nrpa", "exact")
)


class TestSearch(RouterContract):
    def router(self) -> Router:
        return SEARCH


class TestNrpa(RouterContract):
    def router(self) -> Router:
        return NRPA


class TestExact(RouterContract):
    def router(self) -> Router:
        return EXACT


def made(**arguments: Any) -> RoutingProblem:
    return RoutingProblem.of(RoutingInstance(**arguments).arrays)


def driven(
    problem: RoutingProblem, robot: int, tour: Sequence[int]
) -> tuple[float, float, bool]:
    """Return (energy of driving, time, whether it can be) of a tour and its finish."""
    ledger = tour_ledger(problem, robot, tour)
    moves = len(tour) > 0 or ledger.energy_J > 0.0
    reserve_J = problem.reserve_J[robot] * (1.0 - SLACK)
    in_time = ledger.time_s <= problem.time_limit_s[robot] * (1.0 + SLACK)
    fine = in_time and (not moves or ledger.least_J >= reserve_J)
    return ledger.driving_J, ledger.time_s, bool(fine)


def objective(problem: RoutingProblem, tours: Sequence[Sequence[int]]) -> float:
    """Return the objective of tours; inf if one of them cannot be driven."""
    found = [driven(problem, r, tour) for r, tour in enumerate(tours)]
    if not all(fine for _, _, fine in found):
        return np.inf
    spent = sum(cost for cost, _, _ in found)
    longest = max(time for _, time, _ in found)
    return problem.energy_weight * spent + problem.makespan_weight * longest


def divisions(goals: int, robots: int) -> Iterator[list[tuple[int, ...]]]:
    """Yield all ways to give goals in order to robots."""
    for order in itertools.permutations(range(goals)):
        for cuts in itertools.combinations_with_replacement(
            range(goals + 1), robots - 1
        ):
            edges = (0, *cuts, goals)
            yield [order[a:b] for a, b in itertools.pairwise(edges)]


def cheapest(problem: RoutingProblem) -> float:
    """Return the least objective of all tours with up to two stations in a row."""
    goals, robots = problem.goals, problem.robots
    stations = range(goals, problem.targets)
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
                    cost, time, fine = driven(problem, r, tour)
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


def renamed(
    problem: RoutingProblem, goal: np.ndarray, robot: np.ndarray
) -> RoutingProblem:
    """Return a problem whose goal i was goal[i] before, and likewise its robots."""
    target = np.r_[goal, np.arange(problem.goals, problem.targets)]
    node = np.r_[target, problem.targets]
    of_robot = ("start_energy_J", "capacity_J", "reserve_J", "time_limit_s")
    changed = {
        name: getattr(problem, name)[robot]
        for name in (*of_robot, "charging_power_W", "consumers_W")
    }
    for name in ("leg_energy_J", "leg_time_s"):
        changed[name] = getattr(problem, name)[np.ix_(robot, node, target)]
    for name in ("finish_energy_J", "finish_time_s"):
        changed[name] = getattr(problem, name)[np.ix_(robot, node)]
    changed["escape_J"] = problem.escape_J[np.ix_(robot, target)]
    return replace(problem, **changed)


@pytest.mark.parametrize(
    "router", [SEARCH, NRPA, EXACT], ids=["search", "nrpa", "exact"]
)
def test_costs_scale_with_energy(router: Router) -> None:
    for seed in range(6):
        problem = sample_routing_problem(seed, goals=6, stations=2)
        names = (
            "leg_energy_J",
            "start_energy_J",
            "capacity_J",
            "reserve_J",
            "escape_J",
        )
        fourfold = replace(problem, **{n: 4.0 * getattr(problem, n) for n in names})
        once = router(problem, seed).cost_J
        assert router(fourfold, seed).cost_J == pytest.approx(4.0 * once)


@pytest.mark.parametrize("router", [SEARCH, EXACT], ids=["search", "exact"])
def test_names_do_not_matter(router: Router) -> None:
    for seed in range(8):
        rng = np.random.default_rng(seed)
        problem = sample_routing_problem(
            seed, goals=7, stations=2, robots=3, closed=seed % 2 == 0
        )
        other = renamed(problem, rng.permutation(7), rng.permutation(3))
        cost = router(problem, seed).cost_J
        assert router(other, seed).cost_J == pytest.approx(cost, rel=0.01)


def test_an_unknown_router_is_refused_by_name() -> None:
    with pytest.raises(UsageError, match=r"'magic' .* allowed: search, nrpa, exact"):
        mrmg.plan(mrmg.load_scene("quickstart"), router="magic")


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
        {"makespan_weight": 3.0, "consumers": np.array([0.5, 2.5])},
        {
            "makespan_weight": 9.0,
            "consumers": np.full(2, 2.0),
            "range_m": (200.0, 300.0),
        },
    ],
    ids=lambda options: "-".join(options),
)
def test_the_search_finds_the_best_tours(options: dict[str, Any]) -> None:
    feasible = 0
    for seed in range(8):
        problem = sample_routing_problem(seed, **options)
        best = cheapest(problem)
        routing = SEARCH(problem, seed)
        if not np.isfinite(best):
            assert not routing.feasible
            continue
        feasible += 1
        assert list(faults_of_tours(problem, routing)) == []
        assert objective(problem, routing.tours) == pytest.approx(best, rel=1e-3)
    assert feasible >= 3


def test_exact_tours_return_to_the_start() -> None:
    feasible = 0
    for seed in range(10):
        problem = sample_routing_problem(
            seed, closed=True, range_m=(100.0, 200.0), stations=2
        )
        best = cheapest(problem)
        routing = EXACT(problem, seed)
        assert routing.cost_J == pytest.approx(best)
        if routing.feasible:
            assert list(faults_of_tours(problem, routing)) == []
            feasible += 1
    assert feasible >= 3


def test_any_number_of_stations_may_stand_in_a_row(chain: RoutingArrays) -> None:
    routing = SEARCH(RoutingProblem.of(chain), 0)
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
    slow = made(**place, charge_power=np.ones(1))
    assert SEARCH(slow, 0).tours == ((1, 0),)
    assert tour_ledger(slow, 0, (1, 0)).time_s == 10.0 + 35.0 + 10.0
    late = made(**place, charge_power=np.ones(1), limit=np.array([54.0]))
    assert not SEARCH(late, 0).feasible
    fast = made(**place, charge_power=np.full(1, 2.0), limit=np.array([54.0]))
    assert SEARCH(fast, 0).feasible
