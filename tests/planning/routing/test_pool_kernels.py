"""The cheapest fleet of pooled routes against trying every choice."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from mrmg.planning.routing._pool_kernels import (
    MOST_POOLED,
    combine,
    new_pool,
    pool_route,
)
from mrmg.planning.routing._routes_kernels import new_routes

GOALS, ROBOTS = 5, 3


def drawn_routes(
    rng: np.random.Generator, count: int
) -> list[tuple[int, tuple[int, ...], float]]:
    """Return (robot, goals in order, cost) of routes, and that robots may stay."""
    routes = [(r, (), 0.0) for r in range(ROBOTS)]
    for _ in range(count):
        size = rng.integers(1, GOALS + 1)
        goals = tuple(int(g) for g in rng.permutation(GOALS)[:size])
        routes.append((int(rng.integers(ROBOTS)), goals, float(rng.uniform(1.0, 9.0))))
    return routes


def cheapest(routes: list[tuple[int, tuple[int, ...], float]]) -> float:
    """Return the least cost of one route a robot that share out all goals."""
    own = [[(g, c) for r, g, c in routes if r == robot] for robot in range(ROBOTS)]
    return min(
        (
            sum(cost for _, cost in choice)
            for choice in itertools.product(*own)
            if sorted(g for goals, _ in choice for g in goals) == list(range(GOALS))
        ),
        default=np.inf,
    )


@pytest.mark.parametrize("seed", range(12))
def test_the_cheapest_choice_is_found(mission: Callable, seed: int) -> None:
    problem = mission(0, goals=GOALS, stations=1, robots=ROBOTS)
    pool = new_pool(problem)
    routes = drawn_routes(np.random.default_rng(seed), 5 + 3 * seed)
    for r, goals, cost in routes:
        pool_route(pool, r, np.array(goals, np.int64), len(goals), cost)
    chosen = new_routes(ROBOTS, GOALS)
    chosen.goal[ROBOTS] = np.arange(GOALS)
    chosen.length[ROBOTS] = GOALS
    combine(pool, chosen)
    least = cheapest(routes)
    if least == np.inf:
        assert chosen.length.tolist() == [0] * ROBOTS + [GOALS]
        return
    assert chosen.length[ROBOTS] == 0
    total = 0.0
    for r in range(ROBOTS):
        goals = tuple(chosen.goal[r, : chosen.length[r]].tolist())
        total += min(cost for q, g, cost in routes if (q, g) == (r, goals))
    assert total == pytest.approx(least)


def test_goals_already_visited_have_no_part(mission: Callable) -> None:
    problem = mission(0, goals=4, stations=1, robots=1)
    problem = problem._replace(open_goal=np.array([False, True, False, True]))
    pool = new_pool(problem)
    pool_route(pool, 0, np.array([3, 1]), 2, 5.0)
    chosen = new_routes(1, 4)
    combine(pool, chosen)
    assert chosen.goal[0, : chosen.length[0]].tolist() == [3, 1]


def test_many_goals_are_not_pooled(mission: Callable) -> None:
    problem = mission(0, goals=MOST_POOLED + 1, stations=1, robots=1)
    pool = new_pool(problem)
    pool_route(pool, 0, np.array([0]), 1, 1.0)
    chosen = new_routes(1, MOST_POOLED + 1)
    chosen.goal[0, :2] = 4, 2
    chosen.length[0] = 2
    combine(pool, chosen)
    assert chosen.goal[0, : chosen.length[0]].tolist() == [4, 2]
