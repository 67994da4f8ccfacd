"""Nested rollout policy adaptation on its own: legal moves, and learning."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mrmg.planning.routing import _nrpa_kernels
from mrmg.planning.routing._nrpa_kernels import UNVISITED, RoutingArrays


def search(
    problem: RoutingArrays, seed: int, *, levels: int = 2, iterations: int = 15
) -> tuple[float, list[tuple[int, int]]]:
    """Return (cost, moves as (robot, target)) of one search."""
    robots, _, targets = problem.cost.shape
    sequence = np.zeros(3 * problem.goals + 4 * robots, np.int64)
    cost, length = _nrpa_kernels.nrpa(
        problem, levels, iterations, 1.0, np.array([seed], np.uint64), sequence
    )
    return cost, [divmod(int(move), targets) for move in sequence[:length]]


def check(problem: RoutingArrays, cost: float, moves: list[tuple[int, int]]) -> int:
    """Require that every move is legal and the cost theirs; return goals left."""
    robots = len(problem.energy)
    place = [problem.cost.shape[2]] * robots
    energy = problem.energy.copy()
    unvisited = set(range(problem.goals))
    recharges = [0] * robots
    spent = 0.0
    for r, t in moves:
        leg = problem.cost[r, place[r], t]
        assert leg <= energy[r] - problem.reserve[r]
        assert t != place[r]
        spent += leg
        energy[r] -= leg
        place[r] = t
        if t < problem.goals:
            unvisited.remove(t)
            recharges[r] = 0
        else:
            energy[r] = problem.capacity[r]
            recharges[r] += 1
            assert recharges[r] <= problem.cost.shape[2] - problem.goals
    assert cost == pytest.approx(spent + UNVISITED * len(unvisited))
    return len(unvisited)


@pytest.mark.parametrize("robots", [1, 3])
def test_every_move_of_a_search_is_legal(
    mission: Callable[..., RoutingArrays], robots: int
) -> None:
    left = []
    for seed in range(40):
        problem = mission(
            seed, goals=6, stations=3, robots=robots, range_m=(100.0, 220.0)
        )
        left.append(check(problem, *search(problem, seed)))
    assert left.count(0) >= 10


def test_every_move_of_a_playout_is_legal(
    mission: Callable[..., RoutingArrays],
) -> None:
    """Without learning robots wander about, and need many recharges."""
    random = np.array([1], np.uint64)
    sequence = np.zeros(40, np.int64)
    recharges = 0
    for seed in range(20):
        problem = mission(seed, goals=4, stations=6, robots=2, range_m=(90.0, 150.0))
        targets = problem.cost.shape[2]
        for _ in range(50):
            cost, length = _nrpa_kernels.playout(
                problem, np.zeros(problem.cost.shape), 1e4, random, sequence
            )
            moves = [divmod(int(move), targets) for move in sequence[:length]]
            check(problem, cost, moves)
            recharges += sum(t >= problem.goals for _, t in moves)
    assert recharges > 500


def test_the_same_state_draws_the_same_search(
    mission: Callable[..., RoutingArrays],
) -> None:
    problem = mission(1, goals=8, stations=2, robots=2, range_m=(200.0, 300.0))
    assert search(problem, 4) == search(problem, 4)


def test_nesting_and_iterations_pay(mission: Callable[..., RoutingArrays]) -> None:
    """On average over missions; one draw alone may be lucky."""
    problems = [
        mission(seed, goals=10, stations=2, robots=2, range_m=(300.0, 400.0))
        for seed in range(10)
    ]
    mean = {
        effort: np.mean(
            [
                search(problem, 7, levels=effort[0], iterations=effort[1])[0]
                for problem in problems
            ]
        )
        for effort in ((1, 1), (1, 30), (2, 30))
    }
    assert mean[2, 30] < mean[1, 30] < mean[1, 1] < UNVISITED


def test_learning_makes_the_learnt_moves_likelier(
    mission: Callable[..., RoutingArrays],
) -> None:
    problem = mission(2, goals=6, stations=0, range_m=(600.0, 700.0))
    scale = _nrpa_kernels.mean_cost(problem)
    policy = np.zeros(problem.cost.shape)
    wanted = np.array([5, 3, 1, 0, 2, 4])
    drawn = np.zeros(18, np.int64)

    def hits() -> int:
        random = np.array([9], np.uint64)
        found = 0
        for _ in range(300):
            _nrpa_kernels.playout(problem, policy, scale, random, drawn)
            found += bool((drawn[:6] == wanted).all())
        return found

    before = hits()
    for _ in range(30):
        _nrpa_kernels.adapt(problem, policy, scale, 1.0, wanted, len(wanted))
    assert before < 60
    assert hits() > 200
