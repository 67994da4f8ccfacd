"""The router: insertion of all goals, then ruin and recreate.

The search takes goals that lie together out of the routes and puts each back where it
costs least, stations placed exactly (slack induction by string removals, Christiaens
and Vanden Berghe 2020). Goals that fit nowhere are absent until they do.
"""

from __future__ import annotations

from math import log
from typing import NamedTuple

import numpy as np

from mrmg.compilation import borrowed, kernel
from mrmg.planning.routing._legs_kernels import Legs
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing._random_kernels import random_unit
from mrmg.planning.routing._refuel_kernels import Labels, new_labels
from mrmg.planning.routing._routes_kernels import (
    COST,
    IMPOSSIBLE,
    Routes,
    copy_labels,
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
    swap_tails,
)

BALANCE = 1.0
"""How much more a surcharge counts on a route of mean energy than on an empty one, as
a share, where goals are put on routes for the first time. Without it a few robots serve
all goals: for large fleets that is hardly less energy, and takes far longer to drive,
and routes of many goals to improve."""

SWAPS = 0.15
"""How often two robots exchange the ends of their routes instead."""


class State(NamedTuple):
    """What a search works on.

    Attributes:
        routes, labels: those that are tried.
        present, kept: those that are left for others, and their labels.
        best: the best met.
        gone, home: room for values of each goal, shape (G,).
    """

    routes: Routes
    labels: Labels
    present: Routes
    kept: Labels
    best: Routes
    gone: np.ndarray
    home: np.ndarray


def new_state(problem: RoutingArrays, legs: Legs) -> State:
    """Return the state of a search before anything is tried: no goal is on a route."""
    robots, goals, targets = len(problem.energy), problem.goals, problem.open_goal
    routes, present, best = (new_routes(robots, goals) for _ in range(3))
    for each in (routes, best):
        each.length[robots] = targets.sum()
        each.goal[robots, : targets.sum()] = np.flatnonzero(targets)
    labels = new_labels(legs)
    kept = labels._replace(way=labels.way.copy(), head=labels.head.copy())
    gone, home = np.zeros((2, goals), np.int64)
    return State(routes, labels, present, kept, best, gone, home)


@kernel
def search(legs, state, rounds, span, random):
    """Improve routes by ruin and recreate with simulated annealing; keep the best.

    Before the first round, routes that cannot be driven are emptied, and absent goals
    put where they fit.

    Args:
        legs, state: the problem, and the routes so far; a search may go on with them.
        rounds: how many.
        span: first and last temperature, as shares of a goal's mean cost.
        random: state of the generator.
    """
    legs, state, random = borrowed(legs), borrowed(state), borrowed(random)
    routes, present, best = state.routes, state.present, state.best
    robots, gone = len(legs.robot), state.gone
    update(legs, routes, state.labels)
    gone[:] = 0
    for r in range(robots):
        for i in range(routes.length[r]):
            gone[routes.goal[r, i]] = routes.known[r, COST] == np.inf
    recreate(legs, state, random, BALANCE)
    value, best_value = objective(legs, routes), objective(legs, best)
    hot = (value - IMPOSSIBLE * routes.length[robots]) / max(1, legs.goals)
    for k in range(rounds + 1):
        if k > 0:
            if random_unit(random) < SWAPS:
                gone[:] = 0
                swap_tails(routes, legs.neighbour, random)
            else:
                choose_ruin(routes, legs.neighbour, random, state.home, gone)
            recreate(legs, state, random, 0.0)
        found = objective(legs, routes)
        warmth = hot * span[0] * (span[1] / span[0]) ** (k / (rounds + 1))
        if k == 0 or found < value - warmth * log(1.0 - random_unit(random)):
            value = found
            copy_routes(routes, present)
            copy_labels(legs, routes, state.labels, state.kept)
            if found < best_value:
                best_value = found
                copy_routes(routes, best)
        else:
            copy_routes(present, routes)
            copy_labels(legs, routes, state.kept, state.labels)


@kernel
def recreate(legs, state, random, balance):
    """Take the flagged goals out of all routes, and put absent ones where they fit."""
    routes, labels, absent = state.routes, state.labels, len(legs.robot)
    remove_goals(routes, state.gone)
    update(legs, routes, labels)
    order_absent(legs, routes, random)
    n = routes.length[absent]
    routes.length[absent] = 0
    for i in range(n):
        goal = routes.goal[absent, i]
        if put_goal(legs, routes, labels, goal, balance):
            update(legs, routes, labels)
        else:
            routes.goal[absent, routes.length[absent]] = goal
            routes.length[absent] += 1


@kernel
def settle(legs, state):
    """Set the routes to the best ones, and label them.

    Returns their energy [J], with IMPOSSIBLE for each absent goal.
    """
    routes = state.routes
    copy_routes(state.best, routes)
    routes.front[:] = routes.back[:] = 0
    update(legs, routes, state.labels)
    robots = len(routes.length) - 1
    return routes.known[:robots, COST].sum() + IMPOSSIBLE * routes.length[robots]
