"""Compiled label setting: the cheapest tours of a fleet, in order of goals visited.

A fleet's tours are one chain: robots drive one after the other, each from its own start
with the goals visited that those before it left behind. States are (robot, goals
visited, node, arc of the node's border); nodes are targets and, last, the start. A
label of a state is a cost and the energy left, and is dropped where another one costs
no more and leaves no less (resource-constrained shortest paths, Desrochers 1988).

What a leg drains a battery by and what it costs are two things: the cost may be energy,
time or nothing, and it may depend on the arcs where regions are touched.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.bound._completion_kernels import Completions
from mrmg.planning.routing._nrpa_kernels import RoutingArrays

NOTHING = -1
"""Parent of the first label."""


class TourSearch(NamedTuple):
    """What cheapest tours are sought among.

    Attributes:
        routing: the problem, whose costs drain batteries.
        goal_list: the open goals, shape (G,).
        leg: what legs cost from arc to arc, shape (R, T + 1, K, T, K); row T is the
            start, in whose arc 0 robots are.
        drain: what they drain batteries by, likewise.
        nearest: the least that they cost to any arc, shape (R, T + 1, K, T).
        finish: what the last leg costs from each node, shape (R, T + 1).
        rest: bounds of what is still to come, by which labels are dropped.
        most: cost of tours of interest; others may be missed.
    """

    routing: RoutingArrays
    goal_list: np.ndarray
    leg: np.ndarray
    drain: np.ndarray
    nearest: np.ndarray
    finish: np.ndarray
    rest: Completions
    most: float


class Labels(NamedTuple):
    """Labels in the order in which they were set, and room for candidates.

    Memory that is not written is not used.

    Attributes:
        value: cost and energy left, shape (N, 2).
        trace: robot, node, arc and parent, shape (N, 4).
        first: number of the first label of the present robot with each set of goals
            visited, and of the end, shape (2^G + 1,).
        near: labels that the present goal may follow, shape (N,).
        offer, origin: candidates' values and parents, shape (N, 2) and (N,).
    """

    value: np.ndarray
    trace: np.ndarray
    first: np.ndarray
    near: np.ndarray
    offer: np.ndarray
    origin: np.ndarray


@kernel
def cheapest_tours(search, room):
    """Return the least cost of visiting each set of goals, and its tours' labels.

    Args:
        search: `TourSearch`.
        room: labels at most.

    Returns:
        (cost, last, trace): of each set of goals, inf where no tours visit it that cost
        at most `search.most`, shape (2^G,); the last label of its tours; and `trace` as
        in `Labels`, which is empty if there are more labels than there is room for.
    """
    problem = search.routing
    n, start = len(search.goal_list), search.leg.shape[3]
    sets = 1 << n
    labels = Labels(
        np.empty((room, 2)),
        np.empty((room, 4), np.int32),
        np.zeros(sets + 1, np.int64),
        np.empty(room, np.int32),
        np.empty((room, 2)),
        np.empty(room, np.int32),
    )
    cost = np.full(sets, np.inf)
    last = np.full(sets, NOTHING, np.int32)
    cost[0] = 0.0
    count = 0
    for r in range(len(problem.energy)):
        labels.first[0] = count
        for mask in range(sets):
            if cost[mask] < np.inf and (
                cost[mask] + search.rest.before[mask] <= search.most
            ):
                if count < room:
                    _set(labels, count, cost[mask], problem.energy[r])
                    _trace(labels, count, r, start, 0, last[mask])
                count += 1
            for g in range(n):
                rest = mask ^ (1 << g)
                # Nothing is called in vain: a call's many arrays take their time.
                some = rest < mask and labels.first[rest] < labels.first[rest + 1]
                if some and count <= room:
                    count = _visit_goal(search, labels, r, mask, g, count)
            if labels.first[mask] < count <= room:
                count = _visit_stations(search, labels, r, mask, count)
            if count > room:
                return cost, last, labels.trace[:0]
            labels.first[mask + 1] = count
        _end_tours(search, labels, r, cost, last)
    return cost, last, labels.trace[:count]


@kernel
def _set(labels, k, cost, left):
    """Write the value of label k."""
    labels.value[k, 0], labels.value[k, 1] = cost, left


@kernel
def _trace(labels, k, r, node, arc, parent):
    """Write where label k is, and the label that it continues."""
    labels.trace[k, 0], labels.trace[k, 1] = r, node
    labels.trace[k, 2], labels.trace[k, 3] = arc, parent


@kernel
def _visit_goal(search, labels, r, mask, g, count):
    """Set the labels of robot r at the g-th goal, with a mask's goals visited.

    Returns:
        The number of labels; more than there is room for if they do not fit.
    """
    goal, ahead = search.goal_list[g], search.rest.after[mask, g]
    near = _near(search, labels, r, mask ^ (1 << g), goal, ahead)
    for arc in range(search.leg.shape[4] if near else 0):
        offers = _offers(search, labels, r, near, goal, arc, ahead)
        if offers == 0:
            continue
        if count + offers > len(labels.value):
            return len(labels.value) + 1
        first = count
        most_left = -np.inf
        for k in np.argsort(labels.offer[:offers, 0], kind="mergesort"):
            cost, left = labels.offer[k, 0], labels.offer[k, 1]
            if left <= most_left:
                continue
            if count > first and labels.value[count - 1, 0] == cost:
                count -= 1  # as costly, and less energy left
            most_left = left
            _set(labels, count, cost, left)
            _trace(labels, count, r, goal, arc, labels.origin[k])
            count += 1
    return count


@kernel
def _near(search, labels, r, rest, goal, ahead):
    """Write the labels that a goal may follow at one of its arcs; return their number.

    Args:
        search, labels: `TourSearch`, `Labels`.
        r: robot.
        rest: goals visited before this one, as bits.
        goal: number of the goal.
        ahead: bound of what is still to come after it.
    """
    problem = search.routing
    near = 0
    for k in range(labels.first[rest], labels.first[rest + 1]):
        node, from_arc = labels.trace[k, 1], labels.trace[k, 2]
        left = labels.value[k, 1] - problem.cost[r, node, goal]
        cost = labels.value[k, 0] + search.nearest[r, node, from_arc, goal]
        if left >= problem.reserve[r] and cost < np.inf and cost + ahead <= search.most:
            labels.near[near] = k
            near += 1
    return near


@kernel
def _offers(search, labels, r, near, goal, arc, ahead):
    """Write what comes of labels that a goal follows at an arc; return the number.

    Args:
        search, labels: `TourSearch`, `Labels`.
        r: robot.
        near: number of the labels that the goal may follow.
        goal: number of the goal.
        arc: of its border.
        ahead: bound of what is still to come after it.
    """
    problem = search.routing
    offers = 0
    for k in labels.near[:near]:
        node, from_arc = labels.trace[k, 1], labels.trace[k, 2]
        cost = labels.value[k, 0] + search.leg[r, node, from_arc, goal, arc]
        if cost < np.inf and cost + ahead <= search.most:
            left = labels.value[k, 1] - search.drain[r, node, from_arc, goal, arc]
            if left < problem.reserve[r]:
                continue
            labels.offer[offers, 0] = cost
            labels.offer[offers, 1] = min(left, problem.capacity[r])
            labels.origin[offers] = k
            offers += 1
    return offers


@kernel
def _visit_stations(search, labels, r, mask, count):
    """Set the labels of robot r at the stations with a mask's goals visited.

    A full battery is the same whatever came before, so that costs decide: Dijkstra over
    the stations' arcs, from the labels of this mask.

    Returns:
        The number of labels; more than there is room for if they do not fit.
    """
    problem, goals = search.routing, search.routing.goals
    stations, arcs = search.leg.shape[3] - goals, search.leg.shape[4]
    if count + stations * arcs > len(labels.value):
        return len(labels.value) + 1
    cost = np.full((stations, arcs), np.inf)
    origin = np.full((stations, arcs), NOTHING, np.int32)
    ahead = np.empty(stations)
    for s in range(stations):
        ahead[s] = _after_station(search, r, mask, s)
    for k in range(labels.first[mask], count):
        usable = labels.value[k, 1] - problem.reserve[r]
        _lead_on(search, labels, r, k, usable, ahead, cost, origin)
    done = np.zeros((stations, arcs), np.bool_)
    while True:
        s, arc, least = -1, -1, np.inf
        for i in range(stations):
            for j in range(arcs):
                if not done[i, j] and cost[i, j] < least:
                    s, arc, least = i, j, cost[i, j]
        if s < 0:
            return count
        done[s, arc] = True
        _set(labels, count, least, problem.capacity[r])
        _trace(labels, count, r, goals + s, arc, origin[s, arc])
        usable = problem.capacity[r] - problem.reserve[r]
        _lead_on(search, labels, r, count, usable, ahead, cost, origin)
        count += 1


@kernel
def _lead_on(search, labels, r, k, usable, ahead, cost, origin):
    """Lower the costs of all stations' arcs to what they are by way of label k.

    Args:
        search, labels: `TourSearch`, `Labels`.
        r: robot.
        k: the label.
        usable: its energy above the reserve.
        ahead: bounds of what is still to come after each station, shape (S,).
        cost, origin: of each station's arcs, and the label before, shape (S, K).
    """
    node, from_arc = labels.trace[k, 1], labels.trace[k, 2]
    goals = search.routing.goals
    for s in range(len(cost)):
        if search.routing.cost[r, node, goals + s] > usable or node == goals + s:
            continue
        nearest = search.nearest[r, node, from_arc, goals + s]
        if labels.value[k, 0] + nearest + ahead[s] > search.most:
            continue
        for arc in range(cost.shape[1]):
            if search.drain[r, node, from_arc, goals + s, arc] > usable:
                continue
            value = labels.value[k, 0] + search.leg[r, node, from_arc, goals + s, arc]
            if value < cost[s, arc] and value + ahead[s] <= search.most:
                cost[s, arc] = value
                origin[s, arc] = k


@kernel
def _after_station(search, r, mask, s):
    """Return a bound of what is still to come with robot r at a station."""
    rest = search.rest
    least = rest.to_finish[r, search.routing.goals + s] + rest.before[mask]
    for u in range(len(search.goal_list)):
        if not mask >> u & 1:
            on = rest.from_station[r, s, u] + rest.after[mask | 1 << u, u]
            least = min(least, on)
    return least


@kernel
def _end_tours(search, labels, r, cost, last):
    """Write the cost of each set of goals once robot r has ended, and its last label.

    A robot that may end where it starts need not have any energy for that.
    """
    problem = search.routing
    for mask in range(len(cost)):
        cost[mask] = np.inf
        for k in range(labels.first[mask], labels.first[mask + 1]):
            node = labels.trace[k, 1]
            drain = problem.finish[r, node]
            total = labels.value[k, 0] + search.finish[r, node]
            enough = drain == 0.0 or labels.value[k, 1] - drain >= problem.reserve[r]
            # Of what costs more, tours that cost less may have been missed.
            few = total + search.rest.before[mask] <= search.most
            if enough and few and total < cost[mask]:
                cost[mask] = total
                last[mask] = k
