"""What a route is worth with one more goal: labels from both of its ends meet there."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._legs_kernels import LIMIT
from mrmg.planning.routing._refuel_kernels import (
    COST,
    DRAW,
    LEAST,
    ON,
    RATE,
    ROUNDING,
    TIME,
    TO,
    WAYS,
    battery_of,
    extend,
    leg_of,
    route_value,
    slot_of,
)


@kernel
def value_with(legs, labels, r, before, goal, behind, longest, ceiling):
    """Return the value of a route with one more goal; inf if it cannot be driven.

    Args:
        legs, labels, r: the problem, and robot r's labels in it.
        before: row of the place before the goal, and that place.
        goal: the goal.
        behind: row of the place behind it, and that place.
        longest: as of `route_value`.
        ceiling: values that are not below it count as inf.
    """
    at, own, battery = len(labels.head) - 1, legs.table[r], battery_of(legs, r)
    row, place = behind
    leg = leg_of(legs, own, before[1], goal)
    slot = slot_of(legs, labels, own, before[1], goal)
    rows, stops = (before[0], at), (slot, labels.paths[slot], 0)
    extend(labels.way, labels.head, rows, leg, labels.path, stops, battery)
    leg = leg_of(legs, own, goal, place)
    slot = slot_of(legs, labels, own, goal, place)
    most = legs.robot[r, LIMIT] * (1.0 + ROUNDING)
    best = ceiling
    for j in range(-1, labels.paths[slot]):
        hop = leg[0], leg[1], leg[2], -1.0
        if j >= 0:
            path = labels.path[slot, j]
            hop = path[COST], path[TIME], path[TO], path[ON]
        least = labels.head[at, LEAST] + hop[0] + labels.head[row, LEAST]
        if not legs.energy_weight * least < best:
            continue
        for k in range(int(labels.head[at, WAYS])):
            for m in range(int(labels.head[row, WAYS])):
                ends = (at, k), (row, m)
                cost, time = joined(labels.way, ends, hop, battery[0])
                value = route_value(legs, cost, time, longest)
                if value < best and time <= most:
                    best = value
    return best if best < ceiling else np.inf


@kernel
def joined(way, ends, hop, usable):
    """Return cost and time of two labels that meet; inf if the battery is too small.

    Args:
        way, ends: the labels: those of all rows, and row and number of the two.
        hop: cost, time, energy to a station and energy from one, which is negative for
            a leg without any.
        usable: what the battery holds.
    """
    (a, k), (b, m) = ends
    drawn = way[a, k, DRAW] + hop[2]
    time = way[a, k, TIME] + hop[1] + way[b, m, TIME]
    if hop[3] >= 0.0:
        if drawn > usable:
            return np.inf, np.inf
        time += way[a, k, RATE] * drawn
        drawn = hop[3]
    drawn += way[b, m, DRAW]
    if drawn > usable:
        return np.inf, np.inf
    time += way[b, m, RATE] * drawn
    return way[a, k, COST] + hop[0] + way[b, m, COST], time
