"""Compiled bounds of what the rest of a mission costs, were batteries to last for ever.

Dynamic programming over the sets of goals visited (Held and Karp 1962). Where there are
too many sets, only the first goals are remembered, and visits of the others are counted
(state-space relaxation, Christofides, Mingozzi and Toth 1981). A state holds a bit for
each goal that is remembered, and above the bits the number of the other visits. A robot
may get to a goal of these again, though not straight back from the next one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel

NONE = -1
"""No state, no goal."""


class Legs(NamedTuple):
    """The least cost of legs of any robot, over any stations.

    Attributes:
        between: from goal to goal, shape (G, G); inf from a goal to itself.
        pair: of two such legs with the same arc in the middle, shape (G, G, G), or
            (0, 0, 0) to know of single legs alone; inf from a goal to itself.
        from_start: from any start to goal, shape (G,).
        to_end: from goal to any finish, shape (G,).
        price: added to each visit, shape (G,).
    """

    between: np.ndarray
    pair: np.ndarray
    from_start: np.ndarray
    to_end: np.ndarray
    price: np.ndarray


class Completions(NamedTuple):
    """What the rest of a mission costs at least.

    Robots that have ended may set out again in these bounds, so that one table is that
    of all robots.

    Attributes:
        after: with a robot at a goal in a state, shape (X, G).
        before: before another robot sets out, shape (X,).
        from_station: least priced cost from station to goal, shape (R, S, G).
        to_finish: least cost from node to finish over any stations, (R, T + 1).
    """

    after: np.ndarray
    before: np.ndarray
    from_station: np.ndarray
    to_finish: np.ndarray


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
            (X, G); else (0, G).
    """

    after: np.ndarray
    before: np.ndarray
    second: np.ndarray
    follower: np.ndarray


@kernel
def completions(legs, remembered):
    """Return the bounds of what visiting the rest of the goals costs, as `Tables`.

    Args:
        legs: `Legs`.
        remembered: number of the first goals whose visits are remembered.
    """
    n, by_pairs = len(legs.between), len(legs.pair) > 0
    states, counted = states_of(n, remembered), remembered < n
    after, before = np.full((states, n), np.inf), np.zeros(states)
    second = np.full((states if counted else 0, n), np.inf)
    follower = np.full(second.shape, NONE, np.int16)
    tables = Tables(after, before, second, follower)
    rest, on = np.empty(n, np.int64), np.empty(n, np.int64)
    single, ahead = np.empty(n), np.full((n, n), np.inf)
    for state in range(states - 1, -1, -1):
        left = 0
        for u in range(n):
            following = after_visit(state, u, remembered, states)
            if following >= 0:
                rest[left], on[left] = u, following
                left += 1
        before[state] = np.inf if left else 0.0
        for i in range(left):
            value = after[on[i], rest[i]] + legs.price[rest[i]]
            before[state] = min(before[state], legs.from_start[rest[i]] + value)
        _look_ahead(legs, tables, remembered, rest[:left], on[:left], single, ahead)
        for g in range(n):
            if before_visit(state, g, remembered) < 0:
                continue
            least = legs.to_end[g] + before[state]
            other, leader = np.inf, NONE
            for i in range(left):
                u, value = rest[i], single[i]
                if counted and not by_pairs and follower[on[i], u] == g:
                    value = second[on[i], u] + legs.price[u]
                value += legs.between[g, u]
                for j in range(left if by_pairs else 0):
                    value = min(value, legs.pair[g, u, rest[j]] + ahead[i, j])
                if value < least:
                    least, other, leader = value, least, u
                elif value < other:
                    other = value
            after[state, g] = least
            if counted:
                second[state, g], follower[state, g] = other, leader
    return tables


@kernel
def _look_ahead(legs, tables, remembered, rest, on, single, ahead):
    """Write what follows the next goal, and the next two goals.

    Args:
        legs, tables: `Legs`, `Tables`.
        remembered: number of the first goals whose visits are remembered.
        rest: goals that may be next.
        on: the states after their visits.
        single: receives the cost after each next goal; with pairs, without another goal
            directly after it, shape (G,).
        ahead: receives the cost after each two next goals, shape (G, G).
    """
    states, counted = len(tables.before), len(tables.second) > 0
    for i in range(len(rest)):
        u = rest[i]
        if len(legs.pair) == 0:
            single[i] = tables.after[on[i], u] + legs.price[u]
            continue
        single[i] = legs.to_end[u] + tables.before[on[i]] + legs.price[u]
        for j in range(len(rest)):
            w, ahead[i, j] = rest[j], np.inf
            following = after_visit(on[i], w, remembered, states)
            if following >= 0:
                value = tables.after[following, w]
                if counted and tables.follower[following, w] == u:
                    value = tables.second[following, w]
                ahead[i, j] = value + legs.price[u] + legs.price[w]
