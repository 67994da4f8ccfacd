"""The router: insertion of all goals, then ruin and recreate.

The search takes goals that lie together out of the routes and puts each back where it
costs least, stations placed exactly (slack induction by string removals, Christiaens
and Vanden Berghe 2020). Goals that fit nowhere are absent until they do.
"""

from __future__ import annotations

from math import log

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._pool_kernels import combine
from mrmg.planning.routing._random_kernels import random_unit
from mrmg.planning.routing._routes_kernels import (
    COST,
    IMPOSSIBLE,
    LABEL,
    copy_routes,
    objective,
    put_goal,
    remove_goals,
    update,
)
from mrmg.planning.routing._ruin_kernels import (
    choose_ruin,
    order_absent,
    swap_tails,
)
from mrmg.planning.routing._tour_kernels import write_tour

BLINK = 0.01
"""How often a place for a goal is overlooked, so that it goes elsewhere."""

BALANCE = 1.0
"""How much more a surcharge counts on a route of mean energy than on an empty one, as
a share, where goals are put on routes for the first time. Without it a few robots serve
all goals: for large fleets that is hardly less energy, and takes far longer to drive,
and routes of many goals to improve."""

SWAPS = 0.15
"""How often two robots exchange the ends of their routes instead."""

HOT, COLD = 0.3, 0.003
"""First and last temperature of the search, as shares of a goal's mean cost."""

POOLED_HOT, POOLED_COLD = 5.0, 0.5
"""The same where routes are pooled: to meet many of them is what counts there."""


@kernel
def search(legs, routes, present, best, labels, pool, rounds, random):
    """Improve routes by ruin and recreate with simulated annealing; keep the best.

    Before the first round, routes that cannot be driven are emptied, and absent goals
    put where they fit. At the end routes the search has met are combined anew.

    Args:
        legs, rounds, random: the problem, rounds at most, state of the generator.
        routes, pool: to begin with; receive the best, and all others.
        present, best, labels: room for routes twice, and for their labels.
    """
    robots, goals = len(routes.length) - 1, routes.goal.shape[1]
    first, last = (HOT, COLD) if pool.cost.shape[1] == 1 else (POOLED_HOT, POOLED_COLD)
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
            choose_ruin(routes, legs.round_trip, random, home, gone)
        else:
            for r in range(robots):
                for i in range(routes.length[r]):
                    gone[routes.goal[r, i]] = routes.known[r, COST] == np.inf
        remove_goals(routes, gone)
        update(legs, routes, labels, pool)
        order_absent(legs, routes, random, key)
        blink, balance = (BLINK, 0.0) if k > 0 else (0.0, BALANCE)
        n = routes.length[robots]
        routes.length[robots] = 0
        for i in range(n):
            goal = routes.goal[robots, i]
            if put_goal(legs, routes, labels, goal, random, blink, balance):
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
