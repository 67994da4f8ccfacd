"""Where to recharge along a route: exact, by labels from both of its ends.

A label is a way to get from one end of a route to one of its places: what it costs, how
long it takes, and the energy drawn between that place and the nearest recharge. Labels
from the start meet labels from the finish wherever a goal may be put in, so that this
costs no walk along the route. Between two goals stand as many stations as are needed.

Step m of a route is m places away from one of its ends, which are numbered 0 (start)
and 1 (finish).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._legs_kernels import (
    CHARGE_TIME,
    LIMIT,
    MISSING,
    ROUNDING,
    USABLE,
)

COST, TIME, DRAW, RATE, ORIGIN, STATION = range(6)
"""Columns of labels: energy [J], time [s], energy drawn since the last recharge [J],
time that recharging that takes [s/J], number of the label it continues, and station
that is next to that one (-1: none). Of two labels of a node, one is of no use if it is
no better in any of the first four."""

MORE_WAYS = 8
"""Labels kept at a place beside one for each station."""

TIMED_WAYS = 6
"""Recharged ways kept at a station if time counts; else the cheapest is enough."""


class Labels(NamedTuple):
    """The undominated ways along every route, from both ends; one row for each step.

    Attributes:
        way: to each step, shape (rows, K, 6).
        ways: their number, shape (rows,).
        full: to each station next to it, recharged, shape (rows * S, F, 6).
        fulls: their number, shape (rows * S,).
        arrival: room for ways to one station, shape (1, F, 6).
    """

    way: np.ndarray
    ways: np.ndarray
    full: np.ndarray
    fulls: np.ndarray
    arrival: np.ndarray


@kernel
def new_labels(legs):
    """Return room for the labels of all routes."""
    robots = len(legs.robot)
    stations = legs.hop.shape[1]
    timed = legs.makespan_weight > 0.0
    for r in range(robots):
        timed |= legs.robot[r, LIMIT] < np.inf
    rows = 2 * robots * (legs.goals + 2)
    most = TIMED_WAYS if timed else 1
    return Labels(
        np.zeros((rows, stations + MORE_WAYS, 6)),
        np.zeros(rows, np.int64),
        np.zeros((rows * stations, most, 6)),
        np.zeros(rows * stations, np.int64),
        np.zeros((1, most, 6)),
    )


@kernel
def row_of(legs, r, end, step):
    """Return the row of a step's labels."""
    return (end * len(legs.robot) + r) * (legs.goals + 2) + step


@kernel
def add_label(label, row, n, new):
    """Add a label to a row of n unless one is as good in all; return their number.

    Where there is no room left, the costliest gives way.
    """
    m = costliest = 0
    for k in range(n):
        better = worse = True
        for column in range(ORIGIN):
            better &= label[row, k, column] <= new[column]
            worse &= label[row, k, column] >= new[column]
        if better:
            return n
        if worse:
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
def towards(table, r, end, a, b):
    """Return the entry for the leg from a to b, as seen from an end of the route."""
    return table[r, a, b] if end == 0 else table[r, b, a]


@kernel
def recharge(legs, labels, r, end, place, row):
    """Lead the ways of a row, to a place, on to each station by the cheapest hops."""
    stations = legs.hop.shape[1]
    left = recharge_cheapest(legs, labels, r, end, place, row)
    usable, rate = legs.robot[r, USABLE], legs.robot[r, CHARGE_TIME]
    for f in range(stations if left > 0 else 0):
        leg = towards(legs.cost, r, end, place, legs.goals + f)
        time = towards(legs.time, r, end, place, legs.goals + f)
        # Recharged, ways differ in cost and time alone: few are worth leading on.
        n = 0
        for k in range(labels.ways[row]):
            drawn = labels.way[row, k, DRAW] + leg
            if drawn <= usable * (1.0 + ROUNDING):
                cost = labels.way[row, k, COST] + leg
                late = labels.way[row, k, TIME] + time
                late += labels.way[row, k, RATE] * drawn
                new = (cost, late, 0.0, rate, 1.0 * k, 1.0 * f)
                n = add_label(labels.arrival, 0, n, new)
        for e in range(stations if n > 0 else 0):
            hop = towards(legs.hop, r, end, f, e)
            if hop < np.inf:
                hop_time = towards(legs.hop_time, r, end, f, e)
                at = row * stations + e
                for k in range(n):
                    one = labels.arrival[0, k]
                    lone = labels.fulls[at] == labels.full.shape[1] == 1
                    if lone and labels.full[at, 0, COST] <= one[COST] + hop:
                        continue
                    new = (one[COST] + hop, one[TIME] + hop_time, 0.0, rate,
                           one[ORIGIN], 1.0 * f)  # fmt: skip
                    labels.fulls[at] = add_label(labels.full, at, labels.fulls[at], new)


@kernel
def recharge_cheapest(legs, labels, r, end, place, row):
    """Lead the cheapest way to a place on to stations; return how many it leaves out.

    Where time does not count and no way over a station is shorter, nothing is cheaper
    for the stations that it gets to without recharging.
    """
    stations = legs.hop.shape[1]
    for e in range(stations):
        labels.fulls[row * stations + e] = 0
    if labels.full.shape[1] > 1 or not legs.metric[r] or labels.ways[row] == 0:
        return stations
    k = 0
    for other in range(labels.ways[row]):
        if labels.way[row, other, COST] < labels.way[row, k, COST]:
            k = other
    left = stations
    for e in range(stations):
        leg = towards(legs.cost, r, end, place, legs.goals + e)
        drawn = labels.way[row, k, DRAW] + leg
        if drawn <= legs.robot[r, USABLE] * (1.0 + ROUNDING):
            late = towards(legs.time, r, end, place, legs.goals + e)
            late += labels.way[row, k, TIME] + labels.way[row, k, RATE] * drawn
            rate = legs.robot[r, CHARGE_TIME]
            new = (labels.way[row, k, COST] + leg, late, 0.0, rate, 1.0 * k, 1.0 * e)
            at = row * stations + e
            labels.fulls[at] = add_label(labels.full, at, 0, new)
            left -= 1
    return left


@kernel
def extend(legs, labels, r, end, place, follower, row):
    """Lead the ways of a row, to a place, on to its neighbour in the next row."""
    stations = legs.hop.shape[1]
    usable = legs.robot[r, USABLE] * (1.0 + ROUNDING)
    n = 0
    for f in range(-1, stations):
        a = place if f < 0 else legs.goals + f
        leg = towards(legs.cost, r, end, a, follower)
        time = towards(legs.time, r, end, a, follower)
        label = labels.way if f < 0 else labels.full
        at = row if f < 0 else row * stations + f
        for k in range(labels.ways[row] if f < 0 else labels.fulls[at]):
            drawn = label[at, k, DRAW] + leg
            if drawn <= usable:
                cost, late = label[at, k, COST] + leg, label[at, k, TIME] + time
                new = (cost, late, drawn, label[at, k, RATE], 1.0 * k, 1.0 * f)
                n = add_label(labels.way, row + 1, n, new)
    labels.ways[row + 1] = n


@kernel
def place_at(legs, goal, length, end, step):
    """Return the place of a route that is some steps away from one of its ends."""
    if step == 0 or step > length:
        return legs.cost.shape[1] - 1
    return goal[step - 1] if end == 0 else goal[length - step]


@kernel
def label_route(legs, labels, r, goal, length, front, back):
    """Write the labels of a route and return (cost, time, label) of its best way.

    The way is the best by the weights of the objective among those within the limit;
    cost and time are infinite and the label -1 if there is none. A robot that has
    nowhere to go stays, whatever its battery holds.

    Args:
        legs, labels, r: the problem, and robot r's labels in it.
        goal, length: the route's goals.
        front, back: steps from the start and the finish whose labels hold already.
    """
    for end in range(2):
        for step in range(back if end else front, length + 2 - end):
            row = row_of(legs, r, end, step)
            place = place_at(legs, goal, length, end, step)
            if step == 0:
                labels.way[row, 0, :] = 0.0
                labels.way[row, 0, STATION] = -1.0
                if end == 0:
                    labels.way[row, 0, DRAW] = legs.robot[r, MISSING]
                    labels.way[row, 0, RATE] = legs.robot[r, CHARGE_TIME]
                labels.ways[row] = 1
            else:
                before = place_at(legs, goal, length, end, step - 1)
                extend(legs, labels, r, end, before, place, row - 1)
            if step <= length:
                recharge(legs, labels, r, end, place, row)
    finish = legs.cost.shape[1] - 1
    if length == 0 and legs.cost[r, finish, finish] == 0.0:
        return 0.0, legs.time[r, finish, finish], -1
    row = row_of(legs, r, 0, length + 1)
    best = best_cost = best_time = np.inf
    label = -1
    for k in range(labels.ways[row]):
        cost, time = labels.way[row, k, COST], labels.way[row, k, TIME]
        value = route_value(legs, cost, time, 0.0)
        if value < best and time <= legs.robot[r, LIMIT] * (1.0 + ROUNDING):
            best, best_cost, best_time, label = value, cost, time, k
    return best_cost, best_time, label


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


@kernel
def write_tour(legs, labels, r, goal, length, label, tour):
    """Write goals and stations of a labelled route; return their number.

    Args:
        legs, labels, r, goal, length: the route.
        label: as `label_route` returned it.
        tour: receives targets in order; those that do not fit are only counted.
    """
    stations = legs.hop.shape[1]
    n = 0
    for step in range(length + 1 if label >= 0 else 0, 0, -1):
        row = row_of(legs, r, 0, step)
        station = int(labels.way[row, label, STATION])
        label = int(labels.way[row, label, ORIGIN])
        if step <= length:
            n = append(tour, n, goal[step - 1])
        if station >= 0:
            at = (row - 1) * stations + station
            hop = int(labels.full[at, label, STATION])
            label = int(labels.full[at, label, ORIGIN])
            low = n
            n = append(tour, n, legs.goals + hop)
            while hop != station:
                hop = int(legs.follower[r, hop, station])
                n = append(tour, n, legs.goals + hop)
            reverse(tour, low, n)
    low = 0
    reverse(tour, low, n)
    return n


@kernel
def append(tour, n, target):
    """Write a target behind n others if there is room; return n + 1."""
    if n < len(tour):
        tour[n] = target
    return n + 1


@kernel
def reverse(items, first, end):
    """Turn a piece of an array round, if it lies within it."""
    if end > len(items):
        return
    for k in range((end - first) // 2):
        low, high = first + k, end - 1 - k
        items[low], items[high] = items[high], items[low]
