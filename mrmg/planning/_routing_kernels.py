"""The router: nested rollout policy adaptation, then iterated local search.

The local search moves goals; the stations between them are placed exactly.
"""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning._nrpa_kernels import nrpa
from mrmg.planning._random_kernels import random_below
from mrmg.planning._refuel_kernels import refuel_route, route_length


@kernel
def _route_cost(problem, r, route, length, scratch):
    cost, _ = refuel_route(problem, r, route, length, scratch)
    return cost


@kernel
def _without(route, length, position, out):
    for i in range(length - 1):
        out[i] = route[i] if i < position else route[i + 1]


@kernel
def _with(route, length, position, goal, out):
    for i in range(length + 1):
        if i < position:
            out[i] = route[i]
        elif i == position:
            out[i] = goal
        else:
            out[i] = route[i - 1]


@kernel
def improve_routes(problem, route, length, cost, scratch):
    """Local search: relocate a goal, or reverse a piece of a route, while it pays.

    Args:
        problem: the problem.
        route: goals of each robot, shape (R, G); changed in place.
        length: number of goals of each robot, shape (R,); changed in place.
        cost: cost of each route with its stations, shape (R,); changed in place.
        scratch: for `refuel_route`.
    """
    robots = len(length)
    size = route.shape[1]
    shorter = np.empty(size + 1, np.int64)
    longer = np.empty(size + 1, np.int64)
    improved = True
    while improved:
        improved = False
        for a in range(robots):
            i = 0
            while i < length[a]:
                goal = route[a, i]
                _without(route[a], length[a], i, shorter)
                cost_a = _route_cost(problem, a, shorter, length[a] - 1, scratch)
                best_gain = 1e-6
                best_b = -1
                best_j = -1
                for b in range(robots):
                    base = shorter if a == b else route[b]
                    n = length[a] - 1 if a == b else length[b]
                    saved = cost[a] - cost_a + (0.0 if a == b else cost[b])
                    if a == b:
                        saved = cost[a]
                    for j in range(n + 1):
                        if a == b and j == i:
                            continue
                        _with(base, n, j, goal, longer)
                        # Stations only add to the length, so that bounds the gain.
                        if saved - route_length(problem, b, longer, n + 1) <= best_gain:
                            continue
                        gain = saved - _route_cost(problem, b, longer, n + 1, scratch)
                        if gain > best_gain:
                            best_gain = gain
                            best_b = b
                            best_j = j
                if best_b >= 0:
                    improved = True
                    route[a, : length[a] - 1] = shorter[: length[a] - 1]
                    length[a] -= 1
                    b = best_b
                    _with(route[b], length[b], best_j, goal, longer)
                    length[b] += 1
                    route[b, : length[b]] = longer[: length[b]]
                    cost[a] = _route_cost(problem, a, route[a], length[a], scratch)
                    cost[b] = _route_cost(problem, b, route[b], length[b], scratch)
                else:
                    i += 1
            for i in range(length[a] - 1):
                for j in range(i + 1, length[a]):
                    for k in range(length[a]):
                        inside = i <= k <= j
                        longer[k] = route[a, i + j - k] if inside else route[a, k]
                    if route_length(problem, a, longer, length[a]) >= cost[a]:
                        continue
                    new = _route_cost(problem, a, longer, length[a], scratch)
                    if new < cost[a] - 1e-6:
                        cost[a] = new
                        route[a, : length[a]] = longer[: length[a]]
                        improved = True


@kernel
def solve_routing(problem, levels, iterations, alpha, kicks, random, tour, tour_length):
    """Solve a routing problem: NRPA, then iterated local search around its answer.

    Args:
        problem: `RoutingArrays`.
        levels, iterations, alpha: of NRPA.
        kicks: number of times local search is restarted from a disturbed best.
        random: state of the generator.
        tour: receives goals and stations of each robot in order, shape (R, >= 3 G).
        tour_length: receives their number, shape (R,).

    Returns:
        Cost [J] of the tours; at least IMPOSSIBLE if none was found.
    """
    robots, places, targets = problem.cost.shape
    goals = problem.goals
    left = 0
    for g in range(goals):
        left += problem.open_goal[g]
    tour_length[:] = 0
    if left == 0:
        return 0.0
    sequence = np.zeros(3 * goals + 4 * robots, np.int64)
    _, moves = nrpa(problem, levels, iterations, alpha, random, sequence)
    route = np.zeros((robots, goals + 1), np.int64)
    length = np.zeros(robots, np.int64)
    seen = np.zeros(goals, np.bool_)
    for k in range(moves):
        r = sequence[k] // targets
        t = sequence[k] % targets
        if t < goals:
            route[r, length[r]] = t
            length[r] += 1
            seen[t] = True
    for g in range(goals):
        if problem.open_goal[g] and not seen[g]:
            r = np.argmin(problem.cost[:, targets, g])
            route[r, length[r]] = g
            length[r] += 1
    scratch = np.empty(3 * goals + 3, np.int64)
    cost = np.empty(robots)
    for r in range(robots):
        cost[r] = _route_cost(problem, r, route[r], length[r], scratch)
    if kicks > 0:
        improve_routes(problem, route, length, cost, scratch)
    trial = route.copy()
    trial_length = length.copy()
    trial_cost = cost.copy()
    for _ in range(kicks):
        trial[:] = route
        trial_length[:] = length
        trial_cost[:] = cost
        _kick(problem, trial, trial_length, trial_cost, random, scratch)
        improve_routes(problem, trial, trial_length, trial_cost, scratch)
        if trial_cost.sum() < cost.sum() - 1e-6:
            route[:] = trial
            length[:] = trial_length
            cost[:] = trial_cost
    total = 0.0
    for r in range(robots):
        part, n = refuel_route(problem, r, route[r], length[r], scratch)
        total += part
        tour[r, :n] = scratch[:n]
        tour_length[r] = n
    return total


@kernel
def _kick(problem, route, length, cost, random, scratch):
    """Move three random goals to random places of random routes."""
    robots = len(length)
    buffer = np.empty(route.shape[1] + 1, np.int64)
    for _ in range(3):
        a = random_below(random, robots)
        if length[a] == 0:
            continue
        i = random_below(random, length[a])
        goal = route[a, i]
        _without(route[a], length[a], i, buffer)
        length[a] -= 1
        route[a, : length[a]] = buffer[: length[a]]
        b = random_below(random, robots)
        j = random_below(random, length[b] + 1)
        _with(route[b], length[b], j, goal, buffer)
        length[b] += 1
        route[b, : length[b]] = buffer[: length[b]]
    for r in range(robots):
        cost[r] = _route_cost(problem, r, route[r], length[r], scratch)
