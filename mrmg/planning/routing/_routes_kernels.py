"""The routes of a fleet while they are searched: goals put in and taken out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.motion._kernels import copy_numbers
from mrmg.planning.routing._insertion_kernels import value_with
from mrmg.planning.routing._legs_kernels import USABLE
from mrmg.planning.routing._refuel_kernels import (
    LEAST,
    LEAST_DRAW,
    ROUNDING,
    WAYS,
    label_route,
    place_at,
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
    """

    goal: np.ndarray
    length: np.ndarray
    known: np.ndarray
    front: np.ndarray
    back: np.ndarray


def new_routes(robots: int, goals: int) -> Routes:
    """Return room for routes, all empty."""
    return Routes(
        np.zeros((robots + 1, goals), np.int64),
        np.zeros(robots + 1, np.int64),
        np.zeros((robots + 1, 3)),
        np.zeros(robots + 1, np.int64),
        np.zeros(robots + 1, np.int64),
    )


@kernel
def copy_routes(source, copy):
    """Copy all routes, and the absent goals."""
    for r in range(len(source.length)):
        copy.length[r] = source.length[r]
        copy_numbers(source.goal[r, : source.length[r]], copy.goal[r])
        copy_numbers(source.known[r], copy.known[r])
        copy.front[r] = source.front[r]
        copy.back[r] = source.back[r]


@kernel
def copy_labels(legs, routes, source, copy):
    """Copy the labels of all routes."""
    ends = legs.goals + 2 * len(legs.robot)
    for r in range(len(legs.robot)):
        n = routes.length[r]
        for i in range(2 * n + 1):
            row = ends - len(legs.robot) + r
            if i < 2 * n:
                row = routes.goal[r, i // 2] + i % 2 * ends
            for k in range(int(source.head[row, WAYS])):
                copy_numbers(source.way[row, k], copy.way[row, k])
            copy_numbers(source.head[row], copy.head[row])


@kernel
def update(legs, routes, labels):
    """Bring labels and costs of changed routes up to date."""
    for r in range(len(routes.length) - 1):
        held, n = (routes.front[r], routes.back[r]), routes.length[r]
        if held[0] < n + 2:
            cost, time, best = label_route(legs, labels, r, routes.goal[r], n, held)
            routes.known[r, COST] = cost
            routes.known[r, TIME] = time
            routes.known[r, LABEL] = best
            routes.front[r] = routes.back[r] = n + 2


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
def bound_places(legs, routes, labels, goal, balance):
    """Return what a goal adds at least where no more stations are needed, and where.

    What it adds at least in each other place that may be better is noted.

    Args:
        legs, routes, labels: the problem and its present routes.
        goal: on no route.
        balance: by how much more a surcharge counts on a route for each joule of it.
    """
    best, robot, place, number = np.inf, -1, -1, 0
    behind = legs.goals + 2 * len(legs.robot)
    for r in range(len(legs.robot)):
        own, home, n = legs.table[r], legs.home[r], routes.length[r]
        usable = legs.robot[r, USABLE] * (1.0 + ROUNDING)
        present = routes.known[r, COST]
        weight = (1.0 + balance * present) * legs.energy_weight
        to_station, on = legs.reach[own, goal, 0], legs.reach[own, goal, 1]
        last, front = home, legs.goals + r
        for i in range(n + 1):
            at = routes.goal[r, i] if i < n else home
            back = behind + (at if i < n else legs.goals + r)
            # No way is shorter over stations, so that this bounds the cost.
            to, way = legs.cost[own, last, goal], legs.cost[own, goal, at]
            way += to
            ends = labels.head[front, LEAST] + labels.head[back, LEAST]
            adds = weight * (ends + way - present)
            labels.bound[number] = np.inf
            if adds < best:
                drawn = labels.head[front, LEAST_DRAW] + labels.head[back, LEAST_DRAW]
                if drawn + way <= usable and not legs.timed:
                    best, robot, place = adds, r, i
                elif legs.timed:
                    labels.bound[number] = adds
                else:  # a station is before the goal, behind it, or elsewhere as it was
                    over = max(0.0, legs.reach[own, last, 0] + on - to)
                    after = to_station + legs.reach[own, at, 1] - (way - to)
                    least = ends + way + min(over, max(0.0, after))
                    least = min(least, present + way - legs.cost[own, last, at])
                    labels.bound[number] = max(adds, weight * (least - present))
            last = front = at
            number += 1
    return best, robot, place


@kernel
def put_goal(legs, routes, labels, goal, balance):
    """Put a goal where it costs least; return whether it fits anywhere.

    Args:
        legs, routes, labels: the problem and its present routes.
        goal: on no route.
        balance: how much more a surcharge counts on a route of mean energy than on an
            empty one, as a share.
    """
    total, places = 1e-9, len(legs.robot)
    for r in range(len(legs.robot)):
        total += routes.known[r, COST] if balance > 0.0 else 0.0
        places += routes.length[r]
    balance *= len(legs.robot) / total
    best, robot, place = bound_places(legs, routes, labels, goal, balance)
    while True:
        number = labels.bound[:places].argmin()
        if not labels.bound[number] < best:
            break
        labels.bound[number] = np.inf
        r = 0
        while number > routes.length[r]:
            number -= routes.length[r] + 1
            r += 1
        weight = 1.0 + balance * routes.known[r, COST]
        value = surcharge(legs, routes, labels, (r, number), goal, best / weight)
        if weight * value < best:
            best, robot, place = weight * value, r, number
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


@kernel
def surcharge(legs, routes, labels, where, goal, ceiling):
    """Return what a goal adds in a place; inf if it does not fit.

    Args:
        legs, routes, labels: the problem and its present routes.
        where: robot, and number of the place in its route.
        goal: on no route.
        ceiling: what it adds counts as inf unless it is below.
    """
    r, i = where
    own, n, longest = routes.goal[r], routes.length[r], 0.0
    for other in range(len(legs.robot)):
        if other != r:
            longest = max(longest, routes.known[other, TIME])
    before = route_value(legs, routes.known[r, COST], routes.known[r, TIME], longest)
    front = row_of(legs, r, own, n, 0, i), place_at(legs, r, own, n, 0, i)
    k = n - i
    back = row_of(legs, r, own, n, 1, k), place_at(legs, r, own, n, 1, k)
    ceiling += before
    return value_with(legs, labels, r, front, goal, back, longest, ceiling) - before
