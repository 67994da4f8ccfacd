"""What routes are made of: legs between places, and hops from station to station.

Robots for which all legs between targets are alike share one table. Places of a table:
0..T-1 are targets, goals first; each robot has one more, its home: the start where a
leg begins, the finish where it ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.planning.routing._nrpa_kernels import RoutingArrays

USABLE, MISSING, CHARGE_TIME, LIMIT = range(4)
"""Columns of robots: energy of a full battery above the reserve, how much of it is
missing at the start [J], time that recharging takes [s/J], longest time [s]."""

MOST_NEAR = 8
"""Stations next to a place that are thought of on legs from and to it: the nearest.
Any others may stand between those of two places."""

NEIGHBOURS = 100
"""Goals next to a goal that are taken out with it: the nearest."""


class Legs(NamedTuple):
    """What the routes of a problem are made of.

    Attributes:
        goals: number of goals G.
        table: of each robot, shape (R,).
        home: each robot's place in its table, shape (R,).
        cost, time: from place to place [J], [s], shape (tables, P, P).
        draw: of the battery [J], what consumers draw on the way, too, as `cost`.
        hop, hop_time: from station to station over any others, (tables, S, S).
        follower: next station on that way, shape (tables, S, S).
        near: the nearest stations from each place, and to it, nearest first, shape
            (tables, P, 2, min(S, MOST_NEAR)).
        reach: energy to the nearest station from each place, and from the nearest one
            to it, inf if there is none, shape (tables, P, 2).
        neighbour: of each goal, itself and others, nearest first, (G, at most
            NEIGHBOURS).
        remote: least cost from a home to each goal, shape (G,).
        robot: shape (R, 4).
        timed: whether times count; all are 0 if not.
        energy_weight, makespan_weight: of the objective.
    """

    goals: int
    table: np.ndarray
    home: np.ndarray
    cost: np.ndarray
    time: np.ndarray
    draw: np.ndarray
    hop: np.ndarray
    hop_time: np.ndarray
    follower: np.ndarray
    near: np.ndarray
    reach: np.ndarray
    neighbour: np.ndarray
    remote: np.ndarray
    robot: np.ndarray
    timed: bool
    energy_weight: float
    makespan_weight: float


def new_legs(problem: RoutingArrays) -> Legs:
    """Return the legs of a routing problem."""
    robots, targets = len(problem.energy), problem.cost.shape[2]
    goals = problem.goals
    timed = problem.makespan_weight > 0.0 or bool(np.isfinite(problem.limit).any())
    table, home = problem.table, problem.home
    tables, places = problem.cost.shape[:2]
    draw = np.full((tables, places, places), np.inf)
    time = np.zeros_like(draw)
    draw[:, :, :targets], time[:, :, :targets] = problem.cost, problem.time
    draw[table, :targets, home] = problem.finish[:, :targets]
    time[table, :targets, home] = problem.finish_time[:, :targets]
    draw[table, home, home] = problem.finish[:, targets]
    time[table, home, home] = problem.finish_time[:, targets]
    if not timed:
        time[:] = 0.0
    cost = _driving_J(draw, time, table, problem.consumers)
    robot = np.zeros((robots, 4))
    robot[:, USABLE] = problem.capacity - problem.reserve
    robot[:, MISSING] = problem.capacity - problem.energy
    robot[:, CHARGE_TIME] = 1.0 / problem.charge_power if timed else 0.0
    robot[:, LIMIT] = problem.limit
    one = np.flatnonzero(home == targets)
    between = slice(goals, targets)
    battery = robot[one][:, (USABLE, CHARGE_TIME)]
    hop, hop_time, hop_draw = (
        leg[:, between, between].copy() for leg in (cost, time, draw)
    )
    follower = _extend_hops(hop, hop_time, hop_draw, battery)
    apart = np.stack([cost[:, :, between], cost[:, between].transpose(0, 2, 1)], axis=2)
    reach = apart.min(axis=3, initial=np.inf)
    near = np.argsort(apart, axis=3, kind="stable")[..., :MOST_NEAR].copy()
    apart = (cost + cost.transpose(0, 2, 1))[:, :goals, :goals].min(axis=0)
    np.fill_diagonal(apart, -1.0)
    neighbour = np.argsort(apart, axis=1, kind="stable")[:, :NEIGHBOURS].copy()
    return Legs(
        goals,
        table,
        home,
        cost,
        time,
        draw,
        hop,
        hop_time,
        follower,
        near,
        reach,
        neighbour,
        cost[table, home, :goals].min(axis=0),
        robot,
        timed,
        problem.energy_weight,
        problem.makespan_weight,
    )


def _driving_J(
    draw: np.ndarray, time: np.ndarray, table: np.ndarray, consumers: np.ndarray
) -> np.ndarray:
    """Return the energies of legs without what consumers draw on them."""
    if not (consumers.any() and time.any()):
        return draw
    power_W = consumers[np.unique(table, return_index=True)[1], None, None]
    there = np.isfinite(draw)
    driving_J = draw - power_W * np.where(there, time, 0.0)
    return np.where(there, np.maximum(0.0, driving_J), np.inf)


def _extend_hops(
    hop: np.ndarray, hop_time: np.ndarray, draw: np.ndarray, battery: np.ndarray
) -> np.ndarray:
    """Lead ways from station to station over any others; return the next on each.

    Args:
        hop, hop_time: cost and time of straight ways, shape (tables, S, S); changed to
            those of the cheapest.
        draw: of straight ways.
        battery: energy that it holds, and time that recharging takes, (tables, 2).
    """
    stations = hop.shape[1]
    for legs in (hop, hop_time, draw):
        legs[:, range(stations), range(stations)] = 0.0
    within = draw <= battery[:, 0, None, None]
    hop_time += battery[:, 1, None, None] * np.where(within, draw, 0.0)
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
    return follower
