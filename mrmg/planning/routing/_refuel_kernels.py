"""Where to recharge along a route: by labels from both of its ends.

A label is a way to get from one end of a route to one of its places: what it costs, how
long it takes, and the energy drawn between that place and the nearest recharge. Labels
from the start meet labels from the finish wherever a goal may be put in, so that this
costs no walk along the route. Between two places stand as many stations as are needed:
the first is one of the nearest of the first place, the last one of those of the second.
Where there are at most MOST_NEAR stations, no route has a cheaper choice of them.

Step m of a route is m places away from one of its ends, which are numbered 0 (start)
and 1 (finish). A goal has the same rows of labels on whichever route it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._legs_kernels import (
    CHARGE_TIME,
    LIMIT,
    MISSING,
    USABLE,
    Legs,
    towards,
)

COST, TIME, DRAW, RATE, ORIGIN, STATION = range(6)
"""Columns of labels: energy [J], time [s], energy drawn since the last recharge [J],
time that recharging that takes [s/J], number of the label it continues, and station
that is next to that one (-1: none). Of two labels of a node, one is of no use if it is
no better in any of the first four."""

MORE_WAYS = 8
"""Labels kept at a place beside one for each station near it."""

TIMED_WAYS = 6
"""Recharged ways kept at a station if time counts; else the cheapest is enough."""

ROUNDING = 1e-12
"""Share by which sums in another order may differ."""


class Labels(NamedTuple):
    """The undominated ways along every route, from both ends; one row for each step.

    Attributes:
        way: to each step, shape (rows, K, 6); the last row is that of a goal that may
            be put in.
        ways: their number, shape (rows,).
        least: cost of the cheapest, inf if there is none, shape (rows,).
        full: on to each of the N nearest stations, recharged, shape (rows * N, F, 6).
        fulls: their number, shape (rows * N,).
        arrival: room for ways to one station, shape (1, F, 6).
    """

    way: np.ndarray
    ways: np.ndarray
    least: np.ndarray
    full: np.ndarray
    fulls: np.ndarray
    arrival: np.ndarray


def new_labels(legs: Legs) -> Labels:
    """Return room for the labels of all routes."""
    near = legs.near.shape[3]
    timed = legs.makespan_weight > 0.0 or np.isfinite(legs.robot[:, LIMIT]).any()
    rows = 2 * (legs.goals + 2 * len(legs.robot)) + 1
    most = TIMED_WAYS if timed else 1
    return Labels(
        np.zeros((rows, near + MORE_WAYS, 6)),
        np.zeros(rows, np.int64),
        np.full(rows, np.inf),
        np.zeros((rows * near, most, 6)),
        np.zeros(rows * near, np.int64),
        np.zeros((1, most, 6)),
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
def recharge(legs, labels, r, end, place, row):
    """Lead the ways of a row, to a place, on to the stations next to it."""
    own, near = legs.table[r], legs.near.shape[3]
    battery = legs.robot[r, USABLE] * (1.0 + ROUNDING), legs.robot[r, CHARGE_TIME]
    for j in range(near):
        labels.fulls[row * near + j] = 0
    for i in range(near):
        f = legs.near[own, place, end, i]
        leg = towards(legs.cost, own, end, place, legs.goals + f)
        time = towards(legs.time, own, end, place, legs.goals + f)
        ways = labels.ways[row]
        n = arrive(labels.way, row, ways, leg, time, battery, f, labels.arrival)
        for j in range(near if n > 0 else 0):
            e = legs.near[own, place, end, j]
            hop = towards(legs.hop, own, end, f, e)
            if hop < np.inf:
                time = towards(legs.hop_time, own, end, f, e)
                at = row * near + j
                labels.fulls[at] = lead_on(
                    labels.arrival, n, hop, time, labels.full, at, labels.fulls[at]
                )


@kernel
def arrive(way, row, ways, leg, time, battery, station, arrival):
    """Write the ways of a row on to a station; return their number.

    Recharged, ways differ in cost and time alone: few are worth leading on.

    Args:
        way, row, ways: the labels, and how many of them.
        leg, time: to the station.
        battery: energy that it holds, and time that recharging takes.
        station: its number.
        arrival: receives labels.
    """
    n = 0
    for k in range(ways):
        drawn = way[row, k, DRAW] + leg
        if drawn <= battery[0]:
            cost, late = way[row, k, COST] + leg, way[row, k, TIME] + time
            late += way[row, k, RATE] * drawn
            if n == arrival.shape[1] == 1 and arrival[0, 0, COST] <= cost:
                continue
            new = (cost, late, 0.0, battery[1], 1.0 * k, 1.0 * station)
            n = add_label(arrival, 0, n, new)
    return n


@kernel
def lead_on(arrival, n, hop, time, full, at, fulls):
    """Add n arrivals to the recharged ways at another station; return their number."""
    for k in range(n):
        cost = arrival[0, k, COST] + hop
        if fulls == full.shape[1] == 1 and full[at, 0, COST] <= cost:
            continue
        new = (cost, arrival[0, k, TIME] + time, 0.0, arrival[0, k, RATE],
               arrival[0, k, ORIGIN], arrival[0, k, STATION])  # fmt: skip
        fulls = add_label(full, at, fulls, new)
    return fulls


@kernel
def extend(legs, labels, r, end, place, row, follower, next_row):
    """Lead the ways of a row, to a place, on to a neighbour, in another row."""
    own, near = legs.table[r], legs.near.shape[3]
    usable = legs.robot[r, USABLE] * (1.0 + ROUNDING)
    n = 0
    leg = towards(legs.cost, own, end, place, follower)
    time = towards(legs.time, own, end, place, follower)
    for k in range(labels.ways[row]):
        drawn = labels.way[row, k, DRAW] + leg
        if drawn <= usable:
            cost, late = labels.way[row, k, COST] + leg, labels.way[row, k, TIME] + time
            new = (cost, late, drawn, labels.way[row, k, RATE], 1.0 * k, -1.0)
            n = add_label(labels.way, next_row, n, new)
    for j in range(near if labels.ways[row] > 0 else 0):
        e = legs.near[own, follower, 1 - end, j]
        leg = towards(legs.cost, own, end, legs.goals + e, follower)
        if leg > usable:
            break
        time = towards(legs.time, own, end, legs.goals + e, follower)
        rank = legs.rank[own, place, end, e]
        low, high = (0, near) if rank < 0 else (rank, rank + 1)
        for i in range(low, high):
            hop, hop_time = 0.0, 0.0
            if rank < 0:
                f = legs.near[own, place, end, i]
                hop = towards(legs.hop, own, end, f, e)
                hop_time = towards(legs.hop_time, own, end, f, e)
            at = row * near + i
            for k in range(labels.fulls[at] if hop < np.inf else 0):
                new = (
                    labels.full[at, k, COST] + hop + leg,
                    labels.full[at, k, TIME] + hop_time + time,
                    leg,
                    labels.full[at, k, RATE],
                    1.0 * (i * labels.full.shape[1] + k),
                    1.0 * e,
                )
                n = add_label(labels.way, next_row, n, new)
    labels.ways[next_row] = n
    least = np.inf
    for k in range(n):
        least = min(least, labels.way[next_row, k, COST])
    labels.least[next_row] = least


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
            row = row_of(legs, r, goal, length, end, step)
            place = place_at(legs, r, goal, length, end, step)
            if step == 0:
                begin(legs, labels, r, end, row)
            else:
                before = place_at(legs, r, goal, length, end, step - 1)
                last = row_of(legs, r, goal, length, end, step - 1)
                extend(legs, labels, r, end, before, last, place, row)
            if step <= length:
                recharge(legs, labels, r, end, place, row)
    own, home = legs.table[r], legs.home[r]
    if length == 0 and legs.cost[own, home, home] == 0.0:
        return 0.0, legs.time[own, home, home], -1
    row = row_of(legs, r, goal, length, 0, length + 1)
    best = best_cost = best_time = np.inf
    label = -1
    for k in range(labels.ways[row]):
        cost, time = labels.way[row, k, COST], labels.way[row, k, TIME]
        value = route_value(legs, cost, time, 0.0)
        if value < best and time <= legs.robot[r, LIMIT] * (1.0 + ROUNDING):
            best, best_cost, best_time, label = value, cost, time, k
    return best_cost, best_time, label


@kernel
def begin(legs, labels, r, end, row):
    """Write the label of an end of robot r's route."""
    labels.way[row, 0, :] = 0.0
    labels.way[row, 0, STATION] = -1.0
    if end == 0:
        labels.way[row, 0, DRAW] = legs.robot[r, MISSING]
        labels.way[row, 0, RATE] = legs.robot[r, CHARGE_TIME]
    labels.ways[row] = 1
    labels.least[row] = 0.0


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
