"""What routes are made of: legs between places, and hops from station to station.

Places: 0..T-1 are targets, goals first; T is the start where a leg begins, the finish
where it ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel

USABLE, MISSING, CHARGE_TIME, LIMIT = range(4)
"""Columns of robots: energy of a full battery above the reserve, how much of it is
missing at the start [J], time that recharging takes [s/J], longest time [s]."""

ROUNDING = 1e-12
"""Share by which sums in another order may differ."""


class Legs(NamedTuple):
    """What the routes of a problem are made of.

    Attributes:
        goals: number of goals G.
        cost, time: from place to place [J], [s], shape (R, T + 1, T + 1).
        hop, hop_time: from station to station over any others, shape (R, S, S).
        follower: next station on that way, shape (R, S, S).
        robot: shape (R, 4).
        metric: whether no way to or from a station is shorter over another one, as on
            roadmaps, shape (R,).
        energy_weight, makespan_weight: of the objective.
    """

    goals: int
    cost: np.ndarray
    time: np.ndarray
    hop: np.ndarray
    hop_time: np.ndarray
    follower: np.ndarray
    robot: np.ndarray
    metric: np.ndarray
    energy_weight: float
    makespan_weight: float


@kernel
def new_legs(problem):
    """Return the legs of a `RoutingArrays`."""
    robots, places, targets = problem.cost.shape
    stations = targets - problem.goals
    legs = Legs(
        problem.goals,
        np.zeros((robots, places, places)),
        np.zeros((robots, places, places)),
        np.zeros((robots, stations, stations)),
        np.zeros((robots, stations, stations)),
        np.zeros((robots, stations, stations)),
        np.zeros((robots, 4)),
        np.ones(robots, np.bool_),
        problem.energy_weight,
        problem.makespan_weight,
    )
    goals = problem.goals
    for r in range(robots):
        for a in range(places):
            for t in range(targets):
                legs.cost[r, a, t] = problem.cost[r, a, t]
                legs.time[r, a, t] = problem.time[r, a, t]
            legs.cost[r, a, targets] = problem.finish[r, a]
            legs.time[r, a, targets] = problem.finish_time[r, a]
        usable = problem.capacity[r] - problem.reserve[r]
        rate = 1.0 / problem.charge_power[r]
        legs.robot[r, USABLE] = usable
        legs.robot[r, MISSING] = problem.capacity[r] - problem.energy[r]
        legs.robot[r, CHARGE_TIME] = rate
        legs.robot[r, LIMIT] = problem.limit[r]
        for s in range(stations):
            for e in range(stations):
                leg = problem.cost[r, goals + s, goals + e] if s != e else 0.0
                time = problem.time[r, goals + s, goals + e] if s != e else 0.0
                legs.hop[r, s, e] = leg if leg <= usable else np.inf
                legs.hop_time[r, s, e] = time + rate * leg
                legs.follower[r, s, e] = e
        for over in range(stations):
            for s in range(stations):
                for e in range(stations):
                    detour = legs.hop[r, s, over] + legs.hop[r, over, e]
                    if detour < legs.hop[r, s, e]:
                        legs.hop[r, s, e] = detour
                        legs.hop_time[r, s, e] = (
                            legs.hop_time[r, s, over] + legs.hop_time[r, over, e]
                        )
                        legs.follower[r, s, e] = legs.follower[r, s, over]
        for s in range(goals, targets):
            for e in range(goals, targets):
                for a in range(places):
                    there = legs.cost[r, a, s] + legs.cost[r, s, e]
                    back = legs.cost[r, e, s] + legs.cost[r, s, a]
                    shorter = there < legs.cost[r, a, e] * (1.0 - ROUNDING)
                    shorter |= back < legs.cost[r, e, a] * (1.0 - ROUNDING)
                    if a != e and shorter:
                        legs.metric[r] = False
    return legs
