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

from mrmg.compilation import by_pointer, kernel, leaf_kernel
from mrmg.planning.routing._legs_kernels import CHARGE_TIME, LIMIT, MISSING, USABLE

COST, TIME, ORIGIN, STATION, DRAW, RATE = range(6)
"""Columns of labels: energy [J], time [s], number of the label it continues, station at
the end of its recharging (-1: none), energy drawn since [J], and time that recharging
that takes [s/J]. Recharged ways have the first four; STATION is their first station."""

ROUNDING = 1e-12
"""Share by which sums in another order may differ."""

MORE_WAYS = 8
"""Labels kept at a place beside one for each station."""

TIMED_WAYS = 6
"""Recharged ways kept at a station if time counts; else the cheapest is enough."""


@by_pointer
class Labels(NamedTuple):
    """The undominated ways along every route, from both ends; one row for each step.

    Attributes:
        way: to each step, shape (rows, K, 6).
        ways: their number, shape (rows,).
        full: to each station next to it, recharged, shape (rows * S, F, 4).
        fulls: their number, shape (rows * S,).
    """

    way: np.ndarray
    ways: np.ndarray
    full: np.ndarray
    fulls: np.ndarray


@kernel
def new_labels(legs):
    """Return room for the labels of all routes."""
    robots = len(legs.robot)
    stations = legs.hop.shape[1]
    timed = legs.makespan_weight > 0.0
    for r in range(robots):
        timed |= legs.robot[r, LIMIT] < np.inf
    rows = 2 * robots * (legs.goals + 2)
    return Labels(
        np.zeros((rows, stations + MORE_WAYS, 6)),
        np.zeros(rows, np.int64),
        np.zeros((rows * stations, TIMED_WAYS if timed else 1, 4)),
        np.zeros(rows * stations, np.int64),
    )


@leaf_kernel
def row_of(legs, r, end, step):
    """Return the row of a step's labels."""
    return (end * len(legs.robot) + r) * (legs.goals + 2) + step


@leaf_kernel
def add_label(label, row, n, cost, time, origin, station, draw, rate):
    """Add a label to a row of n unless one is as good in all; return their number.

    Recharged ways have no draw and rate. Where there is no room left, the dearest gives
    way.
    """
    whole = label.shape[2] > DRAW
    m = dearest = 0
    for k in range(n):
        better = label[row, k, COST] <= cost and label[row, k, TIME] <= time
        worse = label[row, k, COST] >= cost and label[row, k, TIME] >= time
        if whole:
            better &= label[row, k, DRAW] <= draw and label[row, k, RATE] <= rate
            worse &= label[row, k, DRAW] >= draw and label[row, k, RATE] >= rate
        if better:
            return n
        if worse:
            continue
        if m < k:
            for column in range(label.shape[2]):
                label[row, m, column] = label[row, k, column]
        if label[row, m, COST] > label[row, dearest, COST]:
            dearest = m
        m += 1
    at = m
    if m == label.shape[1]:
        at = dearest
        m -= 1
        if label[row, at, COST] <= cost:
            return m + 1
    label[row, at, COST] = cost
    label[row, at, TIME] = time
    label[row, at, ORIGIN] = origin
    label[row, at, STATION] = station
    if whole:
        label[row, at, DRAW] = draw
        label[row, at, RATE] = rate
    return m + 1


@leaf_kernel
def recharge(legs, labels, r, end, place, row):
    """Lead the ways of a row, to a place, on to each station by the cheapest hops.

    Where time does not count, only the cheapest way to each station is kept.
    """
    stations = legs.hop.shape[1]
    timed = labels.full.shape[1] > 1
    for e in range(stations):
        labels.fulls[row * stations + e] = 0
    for f in range(stations):
        s = legs.goals + f
        leg = legs.cost[r, place, s] if end == 0 else legs.cost[r, s, place]
        time = legs.time[r, place, s] if end == 0 else legs.time[r, s, place]
        cheapest = np.inf
        for k in range(labels.ways[row]):
            drawn = labels.way[row, k, DRAW] + leg
            if drawn > legs.robot[r, USABLE] * (1.0 + ROUNDING):
                continue
            cost = labels.way[row, k, COST] + leg
            if cost >= cheapest and not timed:
                continue
            cheapest = cost
            begun = labels.way[row, k, TIME] + time + labels.way[row, k, RATE] * drawn
            for e in range(stations):
                hop = legs.hop[r, f, e] if end == 0 else legs.hop[r, e, f]
                at = row * stations + e
                n = labels.fulls[at]
                if hop == np.inf:
                    continue
                if not timed and n > 0 and labels.full[at, 0, COST] <= cost + hop:
                    continue
                late = legs.hop_time[r, f, e] if end == 0 else legs.hop_time[r, e, f]
                labels.fulls[at] = add_label(
                    labels.full, at, n, cost + hop, begun + late, k, f, leg, leg
                )


@leaf_kernel
def extend(legs, labels, r, end, place, follower, row):
    """Lead the ways of a row, to a place, on to its neighbour in the next row."""
    stations = legs.hop.shape[1]
    usable = legs.robot[r, USABLE] * (1.0 + ROUNDING)
    n = 0
    for f in range(-1, stations):
        a = place if f < 0 else legs.goals + f
        leg = legs.cost[r, a, follower] if end == 0 else legs.cost[r, follower, a]
        time = legs.time[r, a, follower] if end == 0 else legs.time[r, follower, a]
        if leg > usable:
            continue
        at = row * stations + f
        for k in range(labels.ways[row] if f < 0 else labels.fulls[at]):
            if f < 0:
                cost, late = labels.way[row, k, COST], labels.way[row, k, TIME]
                drawn = labels.way[row, k, DRAW] + leg
                rate = labels.way[row, k, RATE]
            else:
                cost, late = labels.full[at, k, COST], labels.full[at, k, TIME]
                drawn = leg
                rate = legs.robot[r, CHARGE_TIME]
            if drawn <= usable:
                n = add_label(
                    labels.way, row + 1, n, cost + leg, late + time, k, f, drawn, rate
                )
    labels.ways[row + 1] = n


@leaf_kernel
def place_at(legs, goal, length, end, step):
    """Return the place of a route that is some steps away from one of its ends."""
    if step == 0 or step > length:
        return legs.cost.shape[1] - 1
    return goal[step - 1] if end == 0 else goal[length - step]


@leaf_kernel
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


@leaf_kernel
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


@leaf_kernel
def least_rest(legs, labels, r, goal, b, back):
    """Return the least energy from a goal to the end of a route, by the place behind.

    What the way to the goal has drawn is left out.
    """
    stations = legs.hop.shape[1]
    least = np.inf
    for s in range(-1, stations):
        leg = legs.cost[r, goal, b if s < 0 else legs.goals + s]
        at = back * stations + s
        for j in range(labels.ways[back] if s < 0 else labels.fulls[at]):
            rest = labels.way[back, j, COST] if s < 0 else labels.full[at, j, COST]
            least = min(least, leg + rest)
    return least


@leaf_kernel
def value_with(legs, labels, r, front, a, goal, b, back, longest, ceiling):
    """Return the value of a route with one more goal; inf if it cannot be driven.

    Args:
        legs, labels, r: the problem, and robot r's labels in it.
        front, a: row of the place before the goal, and that place.
        goal: the goal.
        b, back: the place behind it, and its row.
        longest: as of `route_value`.
        ceiling: values that are not below it count as inf.
    """
    stations = legs.hop.shape[1]
    usable, limit = legs.robot[r, USABLE], legs.robot[r, LIMIT]
    weight = legs.energy_weight
    least = least_rest(legs, labels, r, goal, b, back)
    best, worth = np.inf, ceiling
    for f in range(-1, stations):
        place = a if f < 0 else legs.goals + f
        leg, time = legs.cost[r, place, goal], legs.time[r, place, goal]
        if leg > usable:
            continue
        at = front * stations + f
        for k in range(labels.ways[front] if f < 0 else labels.fulls[at]):
            if f < 0:
                cost = labels.way[front, k, COST] + leg
                begun = labels.way[front, k, TIME] + time
                draw = labels.way[front, k, DRAW] + leg
            else:
                cost = labels.full[at, k, COST] + leg
                begun = labels.full[at, k, TIME] + time
                draw = leg
            if draw > usable or weight * (cost + least) >= worth:
                continue
            for s in range(-1, stations):
                place = b if s < 0 else legs.goals + s
                leg_on, time_on = legs.cost[r, goal, place], legs.time[r, goal, place]
                on = back * stations + s
                for j in range(labels.ways[back] if s < 0 else labels.fulls[on]):
                    drawn = draw + leg_on
                    if s < 0:
                        drawn += labels.way[back, j, DRAW]
                        rate = labels.way[back, j, RATE]
                        rest = labels.way[back, j, COST]
                        late = labels.way[back, j, TIME]
                    else:
                        rate = legs.robot[r, CHARGE_TIME]
                        rest = labels.full[on, j, COST]
                        late = labels.full[on, j, TIME]
                    if weight * (cost + leg_on + rest) >= worth:
                        continue
                    late += begun + time_on + rate * drawn
                    value = route_value(legs, cost + leg_on + rest, late, longest)
                    if value < worth and drawn <= usable and late <= limit:
                        best = worth = value
    return best


@leaf_kernel
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


@leaf_kernel
def append(tour, n, target):
    """Write a target behind n others if there is room; return n + 1."""
    if n < len(tour):
        tour[n] = target
    return n + 1


@leaf_kernel
def reverse(items, first, end):
    """Turn a piece of an array round, if it lies within it."""
    if end > len(items):
        return
    for k in range((end - first) // 2):
        low, high = first + k, end - 1 - k
        items[low], items[high] = items[high], items[low]
