"""The routes of a fleet while they are searched: goals put in and taken out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._insertion_kernels import value_with
from mrmg.planning.routing._pool_kernels import pool_route
from mrmg.planning.routing._random_kernels import random_unit
from mrmg.planning.routing._refuel_kernels import (
    label_route,
    route_value,
    row_of,
)

IMPOSSIBLE = 1e12
"""Cost of each goal that no robot can visit [J]."""

COST, TIME, DIRECT, LABEL = range(4)
"""Columns of what is known of a route: energy [J], time [s], energy without stations
[J], and label of its best way."""


class Routes(NamedTuple):
    """Goals of each robot in order, without stations.

    Attributes:
        goal: row R holds the absent goals, shape (R + 1, G).
        length: their number, shape (R + 1,).
        known: shape (R + 1, 4).
        front, back: steps from start and finish whose labels hold, shape (R + 1,).
            After n goals front is n + 2 if all is up to date.
        changed: 1 where a route differs from what it is a copy of, shape (R + 1,).
    """

    goal: np.ndarray
    length: np.ndarray
    known: np.ndarray
    front: np.ndarray
    back: np.ndarray
    changed: np.ndarray


@kernel
def new_routes(robots, goals):
    """Return room for routes, all empty."""
    return Routes(
        np.zeros((robots + 1, goals), np.int64),
        np.zeros(robots + 1, np.int64),
        np.zeros((robots + 1, 4)),
        np.zeros(robots + 1, np.int64),
        np.zeros(robots + 1, np.int64),
        np.ones(robots + 1, np.int64),
    )


@kernel
def add_absent(open_goal, seen, routes):
    """Write goals that are to be visited but were not seen on any route as absent."""
    absent = len(routes.length) - 1
    for g in range(len(open_goal)):
        if open_goal[g] and not seen[g]:
            routes.goal[absent, routes.length[absent]] = g
            routes.length[absent] += 1


@kernel
def copy_routes(source, copy, changed):
    """Copy those routes that have changed, and the absent goals."""
    robots = len(changed) - 1
    for r in range(robots + 1):
        if changed[r] or r == robots:
            copy.length[r] = source.length[r]
            for i in range(source.length[r]):
                copy.goal[r, i] = source.goal[r, i]
            for column in range(4):
                copy.known[r, column] = source.known[r, column]
            copy.front[r] = 0
            copy.back[r] = 0


@kernel
def update(legs, routes, labels, pool):
    """Bring labels and costs of changed routes up to date, and pool those routes."""
    end = legs.cost.shape[1] - 1
    for r in range(len(routes.length) - 1):
        n = routes.length[r]
        if routes.front[r] == n + 2:
            continue
        goal = routes.goal[r]
        cost, time, label = label_route(
            legs, labels, r, goal, n, routes.front[r], routes.back[r]
        )
        routes.known[r, COST] = cost
        routes.known[r, TIME] = time
        routes.known[r, LABEL] = label
        pool_route(pool, r, goal, n, cost)
        place = end
        direct = 0.0
        for i in range(n):
            direct += legs.cost[r, place, goal[i]]
            place = goal[i]
        routes.known[r, DIRECT] = direct + legs.cost[r, place, end]
        routes.front[r] = routes.back[r] = n + 2
        routes.changed[r] = 1


@kernel
def objective(legs, routes):
    """Return the objective, with IMPOSSIBLE for each absent goal."""
    robots = len(routes.length) - 1
    total = IMPOSSIBLE * routes.length[robots]
    longest = 0.0
    for r in range(robots):
        total += legs.energy_weight * routes.known[r, COST]
        total += 1e-3 * legs.makespan_weight * routes.known[r, TIME]
        longest = max(longest, routes.known[r, TIME])
    return total + legs.makespan_weight * longest


@kernel
def longest_other(routes, r):
    """Return the longest time of the other robots' routes [s]."""
    longest = 0.0
    for b in range(len(routes.length) - 1):
        if b != r:
            longest = max(longest, routes.known[b, TIME])
    return longest


@kernel
def put_goal(legs, routes, labels, goal, random, blink):
    """Put a goal where it costs least; return whether it fits anywhere.

    Args:
        legs, routes, labels: the problem and its present routes.
        goal: on no route.
        random: state of the generator.
        blink: how often a place is overlooked.
    """
    end = legs.cost.shape[1] - 1
    best = np.inf
    robot = place = -1
    for r in range(len(routes.length) - 1):
        n = routes.length[r]
        longest = longest_other(routes, r) if legs.makespan_weight > 0.0 else 0.0
        before = route_value(
            legs, routes.known[r, COST], routes.known[r, TIME], longest
        )
        spared = routes.known[r, COST] - routes.known[r, DIRECT]
        for i in range(n + 1):
            a = routes.goal[r, i - 1] if i > 0 else end
            b = routes.goal[r, i] if i < n else end
            way = legs.cost[r, a, goal] + legs.cost[r, goal, b] - legs.cost[r, a, b]
            # Stations only add to the length, so that bounds the surcharge.
            if legs.energy_weight * (way - spared) >= best:
                continue
            if random_unit(random) < blink:
                continue
            ends = (row_of(legs, r, 0, i), a), (row_of(legs, r, 1, n - i), b)
            value = value_with(
                legs, labels, r, ends[0], goal, ends[1], longest, best + before
            )
            if value - before < best:
                best = value - before
                robot, place = r, i
    if robot < 0:
        return False
    n = routes.length[robot]
    for i in range(n, place, -1):
        routes.goal[robot, i] = routes.goal[robot, i - 1]
    routes.goal[robot, place] = goal
    routes.length[robot] = n + 1
    routes.front[robot] = place + 1
    routes.back[robot] = n - place + 1
    return True


@kernel
def remove_goals(routes, gone):
    """Take the flagged goals out of all routes; they become absent."""
    robots = len(routes.length) - 1
    for r in range(robots):
        n = routes.length[r]
        kept = 0
        for i in range(n):
            goal = routes.goal[r, i]
            if gone[goal]:
                if kept == i:
                    routes.front[r] = i + 1
                routes.back[r] = n - i
                routes.goal[robots, routes.length[robots]] = goal
                routes.length[robots] += 1
            else:
                routes.goal[r, kept] = goal
                kept += 1
        routes.length[r] = kept
