"""The router: nested rollout policy adaptation, then ruin and recreate.

The search takes goals that lie together out of the routes and puts each back where it
costs least, stations placed exactly (slack induction by string removals, Christiaens
and Vanden Berghe 2020). Goals that fit nowhere are absent until they do.
"""

from __future__ import annotations

from math import log

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._legs_kernels import new_legs
from mrmg.planning.routing._nrpa_kernels import goals_to_visit, nrpa
from mrmg.planning.routing._pool_kernels import combine, new_pool
from mrmg.planning.routing._random_kernels import random_unit
from mrmg.planning.routing._refuel_kernels import new_labels, write_tour
from mrmg.planning.routing._routes_kernels import (
    COST,
    IMPOSSIBLE,
    LABEL,
    add_absent,
    copy_routes,
    new_routes,
    objective,
    put_goal,
    remove_goals,
    update,
)
from mrmg.planning.routing._ruin_kernels import (
    choose_ruin,
    order_absent,
    round_trips,
    swap_tails,
)

BLINK = 0.01
"""How often a place for a goal is overlooked, so that it goes elsewhere."""

SWAPS = 0.15
"""How often two robots exchange the ends of their routes instead."""

HOT, COLD = 0.3, 0.003
"""First and last temperature of the search, as shares of a goal's mean cost."""

POOLED_HOT, POOLED_COLD = 5.0, 0.5
"""The same where routes are pooled: to meet many of them is what counts there."""

ROUNDS_PER_GOAL = 50
"""Rounds are at most so many for each goal there is to visit."""


@kernel
def search(legs, routes, labels, near, pool, rounds, random):
    """Improve routes by ruin and recreate with simulated annealing; keep the best.

    Before the first round, routes that cannot be driven are emptied, and absent goals
    put where they fit. At the end routes the search has met are combined anew.
    """
    robots, goals = len(routes.length) - 1, routes.goal.shape[1]
    pooled = pool.cost.shape[1] > 1
    first, last = (POOLED_HOT, POOLED_COLD) if pooled else (HOT, COLD)
    present, best = new_routes(robots, goals), new_routes(robots, goals)
    gone, home = np.zeros(goals, np.int64), np.zeros(goals, np.int64)
    key = np.zeros(goals)
    value = best_value = np.inf
    hot = 0.0
    update(legs, routes, labels, pool)
    for k in range(rounds + 1):
        if k > 0 and robots > 1 and random_unit(random) < SWAPS:
            gone[:] = 0
            swap_tails(routes, random)
        elif k > 0:
            choose_ruin(routes, near, random, home, gone)
        else:
            for r in range(robots):
                for i in range(routes.length[r]):
                    gone[routes.goal[r, i]] = routes.known[r, COST] == np.inf
        remove_goals(routes, gone)
        update(legs, routes, labels, pool)
        order_absent(legs, routes, random, key)
        n = routes.length[robots]
        routes.length[robots] = 0
        for i in range(n):
            goal = routes.goal[robots, i]
            if put_goal(legs, routes, labels, goal, random, BLINK if k > 0 else 0.0):
                update(legs, routes, labels, pool)
            else:
                routes.goal[robots, routes.length[robots]] = goal
                routes.length[robots] += 1
        found = objective(legs, routes)
        if k == 0:
            hot = first * (found - IMPOSSIBLE * routes.length[robots]) / max(1, goals)
        warmth = hot * (last / first) ** (k / (rounds + 1))
        if k == 0 or found < value - warmth * log(1.0 - random_unit(random)):
            value = found
            copy_routes(routes, present, routes.changed)
            if found < best_value:
                best_value = found
                routes.changed[:] = 1
                copy_routes(routes, best, routes.changed)
        else:
            copy_routes(present, routes, routes.changed)
            update(legs, routes, labels, pool)
        routes.changed[:] = 0
    routes.changed[:] = 1
    copy_routes(best, routes, routes.changed)
    combine(pool, routes)
    update(legs, routes, labels, pool)


@kernel
def read_playout(problem, sequence, moves, routes, seen):
    """Turn the moves of a playout into routes; what it has not `seen` is absent."""
    targets = problem.cost.shape[2]
    for k in range(moves):
        r = sequence[k] // targets
        t = sequence[k] % targets
        if t < problem.goals:
            routes.goal[r, routes.length[r]] = t
            routes.length[r] += 1
            seen[t] = True
    add_absent(problem.open_goal, seen, routes)


@kernel
def solve_routing(
    problem, levels, iterations, alpha, rounds, random, tour, tour_length
):
    """Solve a routing problem: NRPA, then ruin and recreate from its answer on.

    Args:
        problem: `RoutingArrays`.
        levels, iterations, alpha: of NRPA.
        rounds: of ruin and recreate.
        random: state of the generator.
        tour: receives goals and stations of each robot in order, shape (R, >= 3 G).
        tour_length: receives their number, shape (R,).

    Returns:
        Energy [J] of the tours; at least IMPOSSIBLE if none was found.
    """
    robots = len(problem.energy)
    goals = problem.goals
    routes = new_routes(robots, goals)
    sequence = np.zeros(3 * goals + 4 * robots, np.int64)
    _, moves = nrpa(problem, levels, iterations, alpha, random, sequence)
    read_playout(problem, sequence, moves, routes, np.zeros(goals, np.int64))
    return improve_routes(problem, routes, rounds, random, tour, tour_length)


@kernel
def improve_routes(problem, routes, rounds, random, tour, tour_length):
    """Search from given routes on and write the best tours found; return their energy.

    Args:
        problem, rounds, random, tour, tour_length: as of `solve_routing`.
        routes: to begin with; those that cannot be driven are mended.
    """
    legs = new_legs(problem)
    labels = new_labels(legs)
    near = np.zeros((problem.goals, problem.goals))
    round_trips(problem, near)
    rounds = min(rounds, ROUNDS_PER_GOAL * goals_to_visit(problem))
    search(legs, routes, labels, near, new_pool(problem), rounds, random)
    return write_tours(legs, routes, labels, tour, tour_length)


@kernel
def write_tours(legs, routes, labels, tour, tour_length):
    """Write the tours of up-to-date routes; return their energy [J]."""
    robots = len(routes.length) - 1
    total = IMPOSSIBLE * routes.length[robots]
    for r in range(robots):
        n = write_tour(
            legs,
            labels,
            r,
            routes.goal[r],
            routes.length[r],
            int(routes.known[r, LABEL]),
            tour[r],
        )
        fits = n <= tour.shape[1]
        tour_length[r] = n if fits else 0
        total += routes.known[r, COST] if fits else IMPOSSIBLE
    return min(total, IMPOSSIBLE * (1 + robots + legs.goals))
