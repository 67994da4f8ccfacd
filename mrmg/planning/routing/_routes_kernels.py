"""The routes of a fleet while they are searched: goals put in and taken out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._insertion_kernels import cost_without_stations, value_with
from mrmg.planning.routing._legs_kernels import USABLE
from mrmg.planning.routing._pool_kernels import pool_route
from mrmg.planning.routing._random_kernels import random_unit
from mrmg.planning.routing._refuel_kernels import (
    ROUNDING,
    label_route,
    route_value,
    row_of,
)

IMPOSSIBLE = 1e12
"""Cost of each goal that no robot can visit [J]."""

COST, TIME, LABEL = range(3)
"""Columns of what is known of a route: energy [J], time [s], label of its best way."""


class Routes(NamedTuple):
    """Goals of each robot in order, without stations.

    Attributes:
        goal: row R holds the absent goals, shape (R + 1, G).
        length: their number, shape (R + 1,).
        known: shape (R + 1, 3).
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


def new_routes(robots: int, goals: int) -> Routes:
    """Return room for routes, all empty."""
    return Routes(
        np.zeros((robots + 1, goals), np.int64),
        np.zeros(robots + 1, np.int64),
        np.zeros((robots + 1, 3)),
        np.zeros(robots + 1, np.int64),
        np.zeros(robots + 1, np.int64),
        np.ones(robots + 1, np.int64),
    )


@kernel
def copy_routes(source, copy, changed):
    """Copy those routes that have changed, and the absent goals."""
    robots = len(changed) - 1
    for r in range(robots + 1):
        if changed[r] or r == robots:
            copy.length[r] = source.length[r]
            for i in range(source.length[r]):
                copy.goal[r, i] = source.goal[r, i]
            for column in range(3):
                copy.known[r, column] = source.known[r, column]
            copy.front[r] = 0
            copy.back[r] = 0


@kernel
def update(legs, routes, labels, pool):
    """Bring labels and costs of changed routes up to date, and pool those routes."""
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
def two_longest(routes):
    """Return the longest time of a route [s], whose it is, and the second longest."""
    longest = second = 0.0
    robot = -1
    for r in range(len(routes.length) - 1):
        time = routes.known[r, TIME]
        if robot < 0 or time > longest:
            longest, second, robot = time, longest, r
        else:
            second = max(second, time)
    return longest, robot, second


@kernel
def put_goal(legs, routes, labels, goal, random, blink, balance):
    """Put a goal where it costs least; return whether it fits anywhere.

    Args:
        legs, routes, labels: the problem and its present routes.
        goal: on no route.
        random: state of the generator.
        blink: how often a place is overlooked.
        balance: how much more a surcharge counts on a route of mean energy than on an
            empty one, as a share.
    """
    best, timed = np.inf, labels.full.shape[1] > 1
    robot = place = -1
    most, last_robot, second = two_longest(routes)
    total = 1e-9
    for r in range(len(routes.length) - 1):
        total += routes.known[r, COST] if balance > 0.0 else 0.0
    for r in range(len(routes.length) - 1):
        n, own = routes.length[r], legs.table[r]
        usable = legs.robot[r, USABLE] * (1.0 + ROUNDING)
        longest = second if r == last_robot else most
        present = routes.known[r, COST]
        before = route_value(legs, present, routes.known[r, TIME], longest)
        count = 1.0 + balance * present * len(legs.robot) / total
        front = row_of(legs, r, routes.goal[r], n, 0, 0), legs.home[r]
        for i in range(n + 1):
            last = front
            at = routes.goal[r, i] if i < n else legs.home[r]
            behind = row_of(legs, r, routes.goal[r], n, 1, n - i), at
            front = row_of(legs, r, routes.goal[r], n, 0, i + 1), at
            # No way is shorter over stations, so that this bounds the cost.
            least = labels.least[last[0]] + legs.cost[own, last[1], goal]
            least += legs.cost[own, goal, at] + labels.least[behind[0]]
            if not count * legs.energy_weight * (least - present) < best:
                continue
            if random_unit(random) < blink:
                continue
            value = np.inf
            if not timed:  # nothing beats the cheapest ways to either side
                way = legs.cost[own, last[1], goal] + legs.cost[own, goal, at]
                value = legs.energy_weight * cost_without_stations(
                    labels, last[0], behind[0], way, usable
                )
            if value == np.inf:
                value = value_with(
                    legs, labels, r, last, goal, behind, longest, best / count + before
                )
            if count * (value - before) < best:
                best = count * (value - before)
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
