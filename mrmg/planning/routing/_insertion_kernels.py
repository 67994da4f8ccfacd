"""What a route is worth with one more goal: labels from both of its ends meet there."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._legs_kernels import CHARGE_TIME, LIMIT, USABLE
from mrmg.planning.routing._refuel_kernels import (
    COST,
    DRAW,
    RATE,
    ROUNDING,
    TIME,
    arrive,
    extend,
    route_value,
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
    at = len(labels.ways) - 1
    extend(legs, labels, r, 0, before[1], before[0], goal, at)
    row, place = behind
    own, most = legs.table[r], legs.robot[r, LIMIT] * (1.0 + ROUNDING)
    usable = legs.robot[r, USABLE] * (1.0 + ROUNDING)
    best, worth = np.inf, ceiling
    for k in range(labels.ways[at]):
        for j in range(labels.ways[row]):
            leg, time = legs.cost[own, goal, place], legs.time[own, goal, place]
            cost = labels.way[at, k, COST] + leg + labels.way[row, j, COST]
            drawn = labels.way[at, k, DRAW] + leg + labels.way[row, j, DRAW]
            if legs.energy_weight * cost >= worth or drawn > usable:
                continue
            late = labels.way[at, k, TIME] + time + labels.way[row, j, TIME]
            late += labels.way[row, j, RATE] * drawn
            value = route_value(legs, cost, late, longest)
            if value < worth and late <= most:
                best = worth = value
    if not legs.energy_weight * (labels.least[at] + labels.least[row]) < worth:
        return best
    near, battery = legs.near.shape[3], (usable, legs.robot[r, CHARGE_TIME])
    rule = legs.energy_weight, legs.makespan_weight, longest, most
    for i in range(near):
        f = legs.near[own, goal, 0, i]
        s = legs.goals + f
        leg, time = legs.cost[own, goal, s], legs.time[own, goal, s]
        n = arrive(
            labels.way, at, labels.ways[at], leg, time, battery, f, labels.arrival
        )
        rank = legs.rank[own, place, 1, f] if n > 0 else 0
        low, high = (0, near) if rank < 0 else (rank, rank + 1)
        for j in range(low, high if n > 0 else low):
            hop, hop_time = 0.0, 0.0
            if rank < 0:
                e = legs.near[own, place, 1, j]
                hop, hop_time = legs.hop[own, f, e], legs.hop_time[own, f, e]
            fulls = labels.full, row * near + j, labels.fulls[row * near + j]
            value = joined_value(labels.arrival, n, hop, hop_time, fulls, rule)
            best = min(best, value)
    return best if best < ceiling else np.inf


@kernel
def joined_value(arrival, n, hop, time, others, rule):
    """Return the least value of n arrivals with recharged ways from the finish.

    Args:
        arrival, n: of the arrivals at a station.
        hop, time: from there to the other ways' station.
        others: these, their row, and how many of them.
        rule: weights of energy and makespan, longest time of the other routes, and of
            this one at most.
    """
    full, at, fulls = others
    best = np.inf
    for k in range(n):
        for j in range(fulls):
            cost = arrival[0, k, COST] + hop + full[at, j, COST]
            late = arrival[0, k, TIME] + time + full[at, j, TIME]
            value = rule[0] * cost + rule[1] * (max(late, rule[2]) + 1e-3 * late)
            if value < best and late <= rule[3]:
                best = value
    return best


@kernel
def cost_without_stations(labels, front, back, way, usable):
    """Return the cost of a route with one more goal and no more stations.

    It is inf unless the cheapest labels of the goal's neighbours suffice.

    Args:
        labels: of all routes.
        front, back: rows of the goal's neighbours.
        way: cost from one over the goal to the other.
        usable: what a battery holds.
    """
    cost = labels.least[front] + way + labels.least[back]
    for k in range(labels.ways[front]):
        if labels.way[front, k, COST] <= labels.least[front]:
            drawn = labels.way[front, k, DRAW] + way
            for j in range(labels.ways[back]):
                fits = drawn + labels.way[back, j, DRAW] <= usable
                if fits and labels.way[back, j, COST] <= labels.least[back]:
                    return cost
    return np.inf
