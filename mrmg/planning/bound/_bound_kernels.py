"""Compiled part of the lower bound: spanning trees, for any number of goals."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel


@kernel
def spanning_bound(between, start, rounds):
    """Return a lower bound of the cost of paths from the starts through all goals.

    Paths are a spanning tree of the goals and a root in the place of all starts, in
    which no goal has more than two edges and no start more than one. Prices on edges in
    excess (Held and Karp 1971) raise the tree's cost; every price >= 0 gives a bound.

    Args:
        between: symmetric, from goal to goal, shape (G, G).
        start: from start to goal, shape (R, G).
        rounds: changes of the prices.
    """
    robots, n = start.shape
    price = np.zeros(n)
    toll = np.zeros(robots)
    best = 0.0
    step = 0.0
    for i in range(rounds):
        degree = np.zeros(n)
        leaving = np.zeros(robots)
        total = 0.0
        near = np.full(n, np.inf)
        link = np.zeros(n, np.int64)
        for g in range(n):
            for r in range(robots):
                if start[r, g] + toll[r] + price[g] < near[g]:
                    near[g] = start[r, g] + toll[r] + price[g]
                    link[g] = -1 - r
        joined = np.zeros(n, np.bool_)
        for _ in range(n):
            best_goal, least = -1, np.inf
            for g in range(n):
                if not joined[g] and near[g] < least:
                    best_goal, least = g, near[g]
            if best_goal < 0:
                return np.inf
            total += least
            joined[best_goal] = True
            degree[best_goal] += 1.0
            if link[best_goal] < 0:
                leaving[-1 - link[best_goal]] += 1.0
            else:
                degree[link[best_goal]] += 1.0
            for g in range(n):
                way = between[best_goal, g] + price[best_goal] + price[g]
                if not joined[g] and way < near[g]:
                    near[g] = way
                    link[g] = best_goal
        best = max(best, total - 2.0 * price.sum() - toll.sum())
        if i == 0:
            step = 0.5 * total / n
        for g in range(n):
            price[g] = max(0.0, price[g] + step * (degree[g] - 2.0))
        for r in range(robots):
            toll[r] = max(0.0, toll[r] + step * (leaving[r] - 1.0))
        step *= 0.98
    return best
