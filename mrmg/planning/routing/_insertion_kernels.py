"""What a route is worth with one more goal: labels from both of its ends meet there."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._legs_kernels import LIMIT, USABLE
from mrmg.planning.routing._refuel_kernels import (
    COST,
    DRAW,
    RATE,
    TIME,
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
    stations = legs.hop.shape[1]
    row, place = before
    best = least = np.inf
    for s in range(-1, stations):
        b = behind[1] if s < 0 else legs.goals + s
        label = labels.way if s < 0 else labels.full
        at = behind[0] if s < 0 else behind[0] * stations + s
        for k in range(labels.ways[at] if s < 0 else labels.fulls[at]):
            least = min(least, legs.cost[r, goal, b] + label[at, k, COST])
    for f in range(-1, stations):
        a = place if f < 0 else legs.goals + f
        leg, time = legs.cost[r, a, goal], legs.time[r, a, goal]
        label = labels.way if f < 0 else labels.full
        at = row if f < 0 else row * stations + f
        for k in range(labels.ways[row] if f < 0 else labels.fulls[at]):
            begun = (
                label[at, k, COST] + leg,
                label[at, k, TIME] + time,
                label[at, k, DRAW] + leg,
            )
            worth = min(best, ceiling)
            if legs.energy_weight * (begun[0] + least) >= worth:
                continue  # whatever comes behind the goal
            if begun[2] <= legs.robot[r, USABLE]:
                value = least_on(legs, labels, r, begun, goal, behind, longest, worth)
                best = min(best, value)
    return best


@kernel
def least_on(legs, labels, r, begun, goal, behind, longest, ceiling):
    """Return the least value of a route whose beginning ends with a goal.

    Args:
        begun: energy, time, and energy drawn since the last recharge, at the goal.
        legs, labels, r, goal, behind, longest, ceiling: as of `value_with`.
    """
    stations = legs.hop.shape[1]
    row, place = behind
    best, worth = np.inf, ceiling
    for s in range(-1, stations):
        b = place if s < 0 else legs.goals + s
        leg = legs.cost[r, goal, b]
        label = labels.way if s < 0 else labels.full
        at = row if s < 0 else row * stations + s
        for j in range(labels.ways[row] if s < 0 else labels.fulls[at]):
            cost = begun[0] + leg + label[at, j, COST]
            drawn = begun[2] + leg + label[at, j, DRAW]
            if legs.energy_weight * cost >= worth or drawn > legs.robot[r, USABLE]:
                continue
            late = begun[1] + legs.time[r, goal, b] + label[at, j, TIME]
            late += label[at, j, RATE] * drawn
            value = route_value(legs, cost, late, longest)
            if value < worth and late <= legs.robot[r, LIMIT]:
                best = worth = value
    return best
