"""What routes are made of: legs between places, and hops from station to station.

Robots for which all legs between targets are alike share one table. Places of a table:
0..T-1 are targets, goals first; each robot has one more, its home: the start where a
leg begins, the finish where it ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._nrpa_kernels import RoutingArrays

USABLE, MISSING, CHARGE_TIME, LIMIT = range(4)
"""Columns of robots: energy of a full battery above the reserve, how much of it is
missing at the start [J], time that recharging takes [s/J], longest time [s]."""

MOST_NEAR = 8
"""Stations next to a place that are thought of on legs from and to it: the nearest.
Any others may stand between those of two places."""


class Legs(NamedTuple):
    """What the routes of a problem are made of.

    Attributes:
        goals: number of goals G.
        table: of each robot, shape (R,).
        home: each robot's place in its table, shape (R,).
        cost, time: from place to place [J], [s], shape (tables, P, P).
        hop, hop_time: from station to station over any others, (tables, S, S).
        follower: next station on that way, shape (tables, S, S).
        near: the nearest stations from each place, and to it, nearest first, shape
            (tables, P, 2, min(S, MOST_NEAR)).
        rank: of each station among these, -1 for others, (tables, P, 2, S).
        round_trip: least cost from goal to goal and back over the robots, (G, G).
        robot: shape (R, 4).
        energy_weight, makespan_weight: of the objective.
    """

    goals: int
    table: np.ndarray
    home: np.ndarray
    cost: np.ndarray
    time: np.ndarray
    hop: np.ndarray
    hop_time: np.ndarray
    follower: np.ndarray
    near: np.ndarray
    rank: np.ndarray
    round_trip: np.ndarray
    robot: np.ndarray
    energy_weight: float
    makespan_weight: float


def new_legs(problem: RoutingArrays) -> Legs:
    """Return the legs of a routing problem."""
    robots, targets = len(problem.energy), problem.cost.shape[2]
    goals, stations = problem.goals, targets - problem.goals
    table, home = problem.table, problem.home
    tables, places = problem.cost.shape[:2]
    cost = np.full((tables, places, places), np.inf)
    time = np.zeros_like(cost)
    cost[:, :, :targets], time[:, :, :targets] = problem.cost, problem.time
    cost[table, :targets, home] = problem.finish[:, :targets]
    time[table, :targets, home] = problem.finish_time[:, :targets]
    cost[table, home, home] = problem.finish[:, targets]
    time[table, home, home] = problem.finish_time[:, targets]
    robot = np.zeros((robots, 4))
    robot[:, USABLE] = problem.capacity - problem.reserve
    robot[:, MISSING] = problem.capacity - problem.energy
    robot[:, CHARGE_TIME] = 1.0 / problem.charge_power
    robot[:, LIMIT] = problem.limit
    one = np.flatnonzero(home == targets)
    between = slice(goals, targets)
    hop = cost[:, between, between].copy()
    hop[:, range(stations), range(stations)] = 0.0
    hop_time = time[:, between, between].copy()
    hop_time[:, range(stations), range(stations)] = 0.0
    within = hop <= robot[one, USABLE, None, None]
    hop_time += robot[one, CHARGE_TIME, None, None] * np.where(within, hop, 0.0)
    hop[~within] = np.inf
    follower = np.broadcast_to(np.arange(stations), hop.shape).copy()
    for over in range(stations):
        detour = hop[:, :, over, None] + hop[:, None, over]
        shorter = detour < hop
        longer = hop_time[:, :, over, None] + hop_time[:, None, over]
        hop[shorter] = detour[shorter]
        hop_time[shorter] = longer[shorter]
        first = np.broadcast_to(follower[:, :, over, None], hop.shape)
        follower[shorter] = first[shorter]
    apart = np.stack([cost[:, :, between], cost[:, between].transpose(0, 2, 1)], axis=2)
    near = np.argsort(apart, axis=3, kind="stable")[..., :MOST_NEAR].copy()
    rank = np.full((tables, places, 2, stations), -1)
    np.put_along_axis(rank, near, np.arange(near.shape[3]), axis=3)
    return Legs(
        goals,
        table,
        home,
        cost,
        time,
        hop,
        hop_time,
        follower,
        near,
        rank,
        (cost + cost.transpose(0, 2, 1))[:, :goals, :goals].min(axis=0),
        robot,
        problem.energy_weight,
        problem.makespan_weight,
    )


@kernel
def towards(table, own, end, a, b):
    """Return the entry for the leg from a to b, as seen from an end of the route."""
    return table[own, a, b] if end == 0 else table[own, b, a]
