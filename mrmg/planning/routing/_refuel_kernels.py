"""Where to recharge along a route: by labels from both of its ends.

A label is a way to get from one end of a route to one of its places: what it costs, how
long it takes, and the energy drawn between that place and the nearest recharge. Labels
from the start meet labels from the finish wherever a goal may be put in, so that this
costs no walk along the route. From place to place lead the leg and the recharging paths
that are no worse than others in all (refuel paths of Andelmin and Bartolini 2017): over
one of the nearest stations of the first place, any others, and one of the nearest of
the second. Where there are at most MOST_NEAR stations, no route has a cheaper choice.

Step m of a route is m places away from one of its ends, which are numbered 0 (start)
and 1 (finish). A goal has the same rows of labels on whichever route it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import borrowed, inlined, kernel
from mrmg.planning.routing._legs_kernels import (
    CHARGE_TIME,
    LIMIT,
    MISSING,
    USABLE,
    Legs,
)

COST, TIME, DRAW, RATE, ORIGIN, PATH = range(6)
"""Columns of labels: energy [J], time [s], energy drawn since the last recharge [J],
time that recharging that takes [s/J], number of the label it continues, and of the
recharging path it takes from there (-1: the leg). Of two labels of a row, one is of no
use if it is no better in any of the first four."""

TO, ON, FIRST, LAST = range(2, 6)
"""Columns of recharging paths beside cost and time: energy to the first station and
from the last one, and these. They are compared as labels are."""

WAYS, LEAST, LEAST_DRAW = range(3)
"""Columns of the heads of rows of labels."""

MOST_WAYS = 12
"""Labels kept at a place."""

MOST_PATHS = 12
"""Recharging paths kept between two places."""

MOST_PAIRS = 1 << 15
"""Pairs of places whose recharging paths are remembered."""

ROUNDING = 1e-12
"""Share by which sums in another order may differ."""


class Labels(NamedTuple):
    """The undominated ways along every route, from both ends; one row for each step.

    Attributes:
        way: to each step, shape (rows, MOST_WAYS, 6); the last row is that of a goal
            that may be put in.
        head: their number, cost of the cheapest, inf if there is none, and its draw,
            shape (rows, 3).
        pair: of places whose recharging paths a slot holds, -1 if none, (slots,).
        paths: their number, shape (slots,).
        path: shape (slots, MOST_PATHS, 6).
        bound: room for what a goal adds at least in each place there is for it,
            shape (goals + robots,).
    """

    way: np.ndarray
    head: np.ndarray
    pair: np.ndarray
    paths: np.ndarray
    path: np.ndarray
    bound: np.ndarray


def new_labels(legs: Legs) -> Labels:
    """Return room for the labels of all routes, and for recharging paths."""
    rows = 2 * (legs.goals + 2 * len(legs.robot)) + 1
    stations = legs.near.shape[3]
    slots = min(legs.cost.size, MOST_PAIRS) if stations else 1
    return Labels(
        np.zeros((rows, MOST_WAYS, 6)),
        np.tile([0.0, np.inf, np.inf], (rows, 1)),
        np.full(slots, -1),
        np.zeros(slots, np.int64),
        np.zeros((slots, min(stations**2, MOST_PATHS), 6)),
        np.zeros(legs.goals + len(legs.robot)),
    )


@kernel
def row_of(legs, r, goal, length, end, step):
    """Return the row of a step's labels on robot r's route."""
    robots = len(legs.robot)
    first = end * (legs.goals + 2 * robots)
    if step == 0:
        return first + legs.goals + r
    if step > length:
        return first + legs.goals + robots + r
    return first + (goal[step - 1] if end == 0 else goal[length - step])


@kernel
def place_at(legs, r, goal, length, end, step):
    """Return the place of a route that is some steps away from one of its ends."""
    if step == 0 or step > length:
        return legs.home[r]
    return goal[step - 1] if end == 0 else goal[length - step]


@inlined
def add_label(label, row, n, new):
    """Add a label to a row of n unless one is as good in all; return their number.

    Where there is no room left, the costliest gives way.
    """
    m = costliest = 0
    for k in range(n):
        if (
            label[row, k, 0] <= new[0]
            and label[row, k, 2] <= new[2]
            and label[row, k, 1] <= new[1]
            and label[row, k, 3] <= new[3]
        ):
            return n
        if (
            label[row, k, 0] >= new[0]
            and label[row, k, 2] >= new[2]
            and label[row, k, 1] >= new[1]
            and label[row, k, 3] >= new[3]
        ):
            continue
        if m < k:
            for column in range(label.shape[2]):
                label[row, m, column] = label[row, k, column]
        if label[row, m, COST] > label[row, costliest, COST]:
            costliest = m
        m += 1
    at = m
    if m == label.shape[1]:
        if label[row, costliest, COST] <= new[COST]:
            return m
        at = costliest
        m -= 1
    for column in range(label.shape[2]):
        label[row, at, column] = new[column]
    return m + 1


@kernel
def slot_of(legs, labels, own, a, b):
    """Return the slot of a table's recharging paths from a to b; find them if new."""
    key, slot = key_and_slot(labels.pair, legs.cost.shape[1], own, a, b)
    if labels.pair[slot] != key and legs.near.shape[3] > 0:
        labels.pair[slot] = key
        labels.paths[slot] = find_paths(legs, labels.path, slot, own, a, b)
    return slot


@kernel
def key_and_slot(pair, places, own, a, b):
    """Return the number of a pair of places, and where its recharging paths belong."""
    key = (own * places + a) * places + b
    return key, key % len(pair)


@kernel
def find_paths(legs, path, slot, own, a, b):
    """Write the recharging paths of a table from a to b; return their number."""
    n = 0
    for i in range(legs.near.shape[3]):
        f = legs.near[own, a, 0, i]
        to = legs.draw[own, a, legs.goals + f]
        for j in range(legs.near.shape[3]):
            e = legs.near[own, b, 1, j]
            on = legs.draw[own, legs.goals + e, b]
            cost = legs.cost[own, a, legs.goals + f] + legs.hop[own, f, e]
            cost += legs.cost[own, legs.goals + e, b]
            if cost < np.inf:
                time = legs.time[own, a, legs.goals + f] + legs.hop_time[own, f, e]
                time += legs.time[own, legs.goals + e, b]
                n = add_label(path, slot, n, (cost, time, to, on, 1.0 * f, 1.0 * e))
    return n


@kernel
def extend(way, head, rows, leg, path, stops, battery):
    """Lead the ways of a row on to that of a neighbour.

    Args:
        way, head: all labels.
        rows: of the ways there are, and of those to be written.
        leg: cost, time and draw from place to place.
        path: all recharging paths.
        stops: slot of those in the direction of driving, their number, and the end
            from which the ways begin.
        battery: as `battery_of` returns it.
    """
    way, head, path = borrowed((way, head, path))
    row, next_row = rows
    slot, paths, end = stops
    n, ways = 0, int(head[row, WAYS])
    for k in range(ways):
        drawn = way[row, k, DRAW] + leg[2]
        if drawn <= battery[0]:
            cost, late = way[row, k, COST] + leg[0], way[row, k, TIME] + leg[1]
            new = (cost, late, drawn, way[row, k, RATE], 1.0 * k, -1.0)
            n = add_label(way, next_row, n, new)
    for j in range(paths):
        to, on = path[slot, j, TO + end], path[slot, j, ON - end]
        lowest = np.inf
        for k in range(ways):
            drawn = way[row, k, DRAW] + to
            cost = way[row, k, COST] + path[slot, j, COST]
            if drawn <= battery[0] and (cost < lowest or battery[2]):
                lowest = cost
                late = way[row, k, TIME] + path[slot, j, TIME]
                late += way[row, k, RATE] * drawn
                new = (cost, late, on, battery[1], 1.0 * k, 1.0 * j)
                n = add_label(way, next_row, n, new)
    cheapest = 0
    for k in range(1, n):
        if way[next_row, k, COST] < way[next_row, cheapest, COST]:
            cheapest = k
    head[next_row, WAYS] = n
    head[next_row, LEAST] = way[next_row, cheapest, COST] if n > 0 else np.inf
    head[next_row, LEAST_DRAW] = way[next_row, cheapest, DRAW]


@kernel
def leg_of(legs, own, a, b):
    """Return cost, time and draw from place to place in a table."""
    return legs.cost[own, a, b], legs.time[own, a, b], legs.draw[own, a, b]


@kernel
def label_route(legs, labels, r, goal, length, held):
    """Write the labels of a route and return (cost, time, label) of its best way.

    The way is the best by the weights of the objective among those within the limit;
    cost and time are infinite and the label -1 if there is none. A robot that has
    nowhere to go stays, whatever its battery holds.

    Args:
        legs, labels, r: the problem, and robot r's labels in it.
        goal, length: the route's goals.
        held: steps from the start and the finish whose labels hold already.
    """
    legs, labels, goal = borrowed((legs, labels, goal))
    own, home, slot, paths = legs.table[r], legs.home[r], 0, 0
    battery, stations = battery_of(legs, r), legs.near.shape[3]
    for end in range(2):
        first = end * (legs.goals + 2 * len(legs.robot))
        if held[end] == 0:
            begin(legs, labels, r, end, first + legs.goals + r)
        place, row = home, first + legs.goals + r
        for step in range(1, length + 2 - end):
            last, last_row = place, row
            if step <= length:
                place = goal[step - 1] if end == 0 else goal[length - step]
                row = first + place
            else:
                place, row = home, first + legs.goals + len(legs.robot) + r
            if step < held[end]:
                continue
            a, b = (place, last) if end else (last, place)
            if stations > 0:
                key, slot = key_and_slot(labels.pair, legs.cost.shape[1], own, a, b)
                if labels.pair[slot] != key:
                    slot_of(legs, labels, own, a, b)
                paths = labels.paths[slot]
            leg = leg_of(legs, own, a, b)
            rows, stops = (last_row, row), (slot, paths, end)
            extend(labels.way, labels.head, rows, leg, labels.path, stops, battery)
    if length == 0 and legs.draw[own, home, home] == 0.0:
        return 0.0, legs.time[own, home, home], -1
    row = row_of(legs, r, goal, length, 0, length + 1)
    best = best_cost = best_time = np.inf
    label = -1
    for k in range(int(labels.head[row, WAYS])):
        cost, time = labels.way[row, k, COST], labels.way[row, k, TIME]
        value = route_value(legs, cost, time, 0.0)
        if value < best and time <= legs.robot[r, LIMIT] * (1.0 + ROUNDING):
            best, best_cost, best_time, label = value, cost, time, k
    return best_cost, best_time, label


@kernel
def battery_of(legs, r):
    """Return what a battery holds, the time of recharging, and whether times count."""
    usable = legs.robot[r, USABLE] * (1.0 + ROUNDING)
    return usable, legs.robot[r, CHARGE_TIME], legs.timed


@kernel
def begin(legs, labels, r, end, row):
    """Write the label of an end of robot r's route."""
    labels.way[row, 0, :] = 0.0
    labels.way[row, 0, PATH] = -1.0
    if end == 0:
        labels.way[row, 0, DRAW] = legs.robot[r, MISSING]
        labels.way[row, 0, RATE] = legs.robot[r, CHARGE_TIME]
    labels.head[row, WAYS] = 1.0
    labels.head[row, LEAST] = 0.0
    labels.head[row, LEAST_DRAW] = labels.way[row, 0, DRAW]


@kernel
def route_value(legs, cost, time, longest):
    """Return what a route adds to the objective; ties in makespan go to the shorter.

    Args:
        legs: the problem.
        cost, time: of the route [J], [s].
        longest: time of the longest of the other routes [s].
    """
    return legs.energy_weight * cost + legs.makespan_weight * (
        max(time, longest) + 1e-3 * time
    )
