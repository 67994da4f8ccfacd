"""Compiled bounds of what the rest of a mission costs, were batteries to last for ever.

Dynamic programming over the sets of goals visited (Held and Karp 1962). Where there are
too many sets, only the first goals are remembered, and visits of the others are counted
(state-space relaxation, Christofides, Mingozzi and Toth 1981). A state holds a bit for
each goal that is remembered, and above the bits the number of the other visits. A robot
may get to a goal of these again, though not straight back from the next one.

Batteries count by penalties: legs between two charges that drain more than a battery
holds pay for each joule above that, and get as much for each joule below it (Lagrangian
relaxation). After the last charge of a tour, where a battery need not be used up, the
penalty is another one. So there are two modes of being at a goal: without a charge to
come, and with one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel

NONE = -1
"""No state, no goal."""


class Legs(NamedTuple):
    """The least cost of legs of any robot, in M modes: 1, or 2 if charges are counted.

    In the second mode the next charge is still to come. With one mode alone, legs lead
    over any stations.

    Attributes:
        between: from goal to goal, shape (G, G); inf from a goal to itself.
        pair: of two such legs with the same arc in the middle, shape (G, G, G), or
            (0, 0, 0) to know of single legs alone; inf from a goal to itself.
        scale: factor on both in each mode, shape (M,).
        from_start: from any start to goal, shape (M, G).
        from_station: from station to goal over any stations, shape (M, S, G).
        to_end: from goal to any finish, less a full battery's penalty, shape (G,).
        to_station: from goal to station, less the same, shape (G, S).
        start_station, station_end: from any start, and to any finish, shape (S,).
        price: added to each visit, shape (G,).
    """

    between: np.ndarray
    pair: np.ndarray
    scale: np.ndarray
    from_start: np.ndarray
    from_station: np.ndarray
    to_end: np.ndarray
    to_station: np.ndarray
    start_station: np.ndarray
    station_end: np.ndarray
    price: np.ndarray


class Completions(NamedTuple):
    """What the rest of a mission costs at least.

    Robots that have ended may set out again in these bounds, so that one table is that
    of all robots.

    Attributes:
        after: with a robot at a goal in a state, in each mode, shape (M, X, G).
        before: before another robot sets out, shape (X,).
        from_station: least priced cost from station to goal, shape (R, M, S, G).
        to_finish: least cost from node to finish over any stations, (R, T + 1).
        penalty: in each mode, for each joule above what a battery holds, shape (M,).
        full_J: usable energy that `after` takes a battery to hold.
    """

    after: np.ndarray
    before: np.ndarray
    from_station: np.ndarray
    to_finish: np.ndarray
    penalty: np.ndarray
    full_J: float


@kernel
def states_of(goals, remembered):
    """Return the number of states of the visits to so many goals."""
    return (goals - remembered + 1) << remembered


@kernel
def before_visit(state, g, remembered):
    """Return the state before the g-th goal is visited, NONE if it has not been."""
    if g < remembered:
        return state ^ (1 << g) if state >> g & 1 else NONE
    return max(NONE, state - (1 << remembered))


@kernel
def after_visit(state, g, remembered, states):
    """Return the state once the g-th goal is visited, NONE if it cannot be."""
    if g < remembered:
        return NONE if state >> g & 1 else state | 1 << g
    following = state + (1 << remembered)
    return following if following < states else NONE


class Tables(NamedTuple):
    """What is known of states so far.

    Attributes:
        after, before: as in `Completions`.
        second, follower: where visits are counted, the least cost with another goal
            next than the one that follows at the least cost, and that goal, shape
            (M, X, G); else (M, 0, 0).
        station: with a robot at a station in a state, shape (X, S).
    """

    after: np.ndarray
    before: np.ndarray
    second: np.ndarray
    follower: np.ndarray
    station: np.ndarray


@kernel
def completions(legs, remembered):
    """Return the bounds of what visiting the rest of the goals costs, as `Tables`.

    Args:
        legs: `Legs`.
        remembered: number of the first goals whose visits are remembered.
    """
    n, modes, by_pairs = len(legs.between), len(legs.scale), len(legs.pair) > 0
    states, counted = states_of(n, remembered), remembered < n
    after = np.full((modes, states, n), np.inf)
    second = np.full((modes, states if counted else 0, n), np.inf)
    follower = np.full(second.shape, NONE, np.int16)
    stations = len(legs.start_station) if modes > 1 else 0
    station = np.full((states, stations), np.inf)
    tables = Tables(after, np.zeros(states), second, follower, station)
    rest, on = np.empty(n, np.int64), np.empty(n, np.int64)
    single, ahead = np.empty((modes, n)), np.full((modes, n, n), np.inf)
    for state in range(states - 1, -1, -1):
        left = 0
        for u in range(n):
            following = after_visit(state, u, remembered, states)
            if following >= 0:
                rest[left], on[left] = u, following
                left += 1
        _set_out(legs, tables, state, rest[:left], on[:left])
        _look_ahead(legs, tables, remembered, rest[:left], on[:left], single, ahead)
        for mode in range(modes):
            scale = legs.scale[mode]
            for g in range(n):
                if before_visit(state, g, remembered) < 0:
                    continue
                least = legs.to_end[g] + tables.before[state]
                other, leader = np.inf, NONE
                if mode > 0:
                    least = _by_station(legs, g, station[state])
                for i in range(left):
                    u, value = rest[i], single[mode, i]
                    if counted and not by_pairs and follower[mode, on[i], u] == g:
                        value = second[mode, on[i], u] + legs.price[u]
                    value += scale * legs.between[g, u]
                    for j in range(left if by_pairs else 0):
                        two = scale * legs.pair[g, u, rest[j]] + ahead[mode, i, j]
                        value = min(value, two)
                    if value < least:
                        least, other, leader = value, least, u
                    elif value < other:
                        other = value
                after[mode, state, g] = least
                if counted:
                    second[mode, state, g], follower[mode, state, g] = other, leader
    return tables


@kernel
def _set_out(legs, tables, state, rest, on):
    """Write what it costs to set out in a state, and to go on from stations.

    Args:
        legs, tables: `Legs`, `Tables`.
        state: visits so far.
        rest: goals that may be next.
        on: the states after their visits.
    """
    least = np.inf if len(rest) else 0.0
    station = tables.station[state]
    for mode in range(len(legs.scale)):
        for i in range(len(rest)):
            u = rest[i]
            value = tables.after[mode, on[i], u] + legs.price[u]
            least = min(least, legs.from_start[mode, u] + value)
            for s in range(len(station)):
                station[s] = min(station[s], legs.from_station[mode, s, u] + value)
    for s in range(len(station)):
        least = min(least, legs.start_station[s] + station[s])
    for s in range(len(station)):
        station[s] = min(station[s], legs.station_end[s] + least)
    tables.before[state] = least


@kernel
def _look_ahead(legs, tables, remembered, rest, on, single, ahead):
    """Write what follows the next goal, and the next two goals.

    Args:
        legs, tables, rest, on: as in `_set_out`.
        remembered: number of the first goals whose visits are remembered.
        single: receives the cost after each next goal; with pairs, without another goal
            directly after it, shape (M, G).
        ahead: receives the cost after each two next goals, shape (M, G, G).
    """
    states, counted = len(tables.before), len(tables.second[0]) > 0
    for mode in range(len(single)):
        for i in range(len(rest)):
            u = rest[i]
            single[mode, i] = tables.after[mode, on[i], u] + legs.price[u]
            if len(legs.pair) == 0:
                continue
            last = legs.to_end[u] + tables.before[on[i]]
            if mode > 0:
                last = _by_station(legs, u, tables.station[on[i]])
            single[mode, i] = last + legs.price[u]
            for j in range(len(rest)):
                w, ahead[mode, i, j] = rest[j], np.inf
                following = after_visit(on[i], w, remembered, states)
                if following >= 0:
                    value = tables.after[mode, following, w]
                    if counted and tables.follower[mode, following, w] == u:
                        value = tables.second[mode, following, w]
                    ahead[mode, i, j] = value + legs.price[u] + legs.price[w]


@kernel
def _by_station(legs, g, station):
    """Return the least cost with a charge after the g-th goal."""
    least = np.inf
    for s in range(len(station)):
        least = min(least, legs.to_station[g, s] + station[s])
    return least
