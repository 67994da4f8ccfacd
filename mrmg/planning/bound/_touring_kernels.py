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
from mrmg.planning.routing._nrpa_kernels import RoutingArrays

NOTHING = -1
"""Parent of the first label."""


class Completions(NamedTuple):
    """What the rest of a mission costs at least, were batteries to last for ever.

    Attributes:
        from_station: least cost from station to goal over any stations, (R, S, G).
        to_finish: least cost from node to finish over any stations, (R, T + 1).
        after: with a robot at a goal and goals visited, shape (R, 2^G, G).
        before: with a robot that has not set out, shape (R + 1, 2^G).
    """

    from_station: np.ndarray
    to_finish: np.ndarray
    after: np.ndarray
    before: np.ndarray


class TourSearch(NamedTuple):
    """What cheapest tours are sought among.

    Attributes:
        routing: the problem, whose costs drain batteries.
        goal_list: the open goals, shape (G,).
        leg: what legs cost from arc to arc, shape (R, T + 1, K, T, K); row T is the
            start, in whose arc 0 robots are.
        finish: what the last leg costs from each node, shape (R, T + 1).
        rest: bounds of what is still to come, by which labels are dropped.
        most: cost of tours of interest; others may be missed.
    """

    routing: RoutingArrays
    goal_list: np.ndarray
    leg: np.ndarray
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
        offer, origin: candidates' values and parents, shape (N, 2) and (N,).
    """

    value: np.ndarray
    trace: np.ndarray
    first: np.ndarray
    offer: np.ndarray
    origin: np.ndarray


@kernel
def completions(between, from_start, from_station, to_finish, goal_list):
    """Return the bounds of what visiting the rest of the goals costs.

    Args:
        between: least cost from goal to goal over any stations, shape (R, G, G).
        from_start: from start to goal, shape (R, G).
        from_station, to_finish: as in `Completions`.
        goal_list: the open goals, shape (G,).
    """
    robots, n = from_start.shape
    full = (1 << n) - 1
    after = np.full((robots, full + 1, n), np.inf)
    before = np.full((robots + 1, full + 1), np.inf)
    before[robots, full] = 0.0
    for r in range(robots - 1, -1, -1):
        for mask in range(full, -1, -1):
            done = before[r + 1, mask]
            for g in range(n):
                if not mask >> g & 1:
                    continue
                least = to_finish[r, goal_list[g]] + done
                for u in range(n):
                    if not mask >> u & 1:
                        on = between[r, g, u] + after[r, mask | 1 << u, u]
                        least = min(least, on)
                after[r, mask, g] = least
            least = to_finish[r, -1] + done
            for u in range(n):
                if not mask >> u & 1:
                    least = min(least, from_start[r, u] + after[r, mask | 1 << u, u])
            before[r, mask] = least
    return Completions(from_station, to_finish, after, before)


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
                cost[mask] + search.rest.before[r, mask] <= search.most
            ):
                if count < room:
                    _set(labels, count, cost[mask], problem.energy[r])
                    _trace(labels, count, r, start, 0, last[mask])
                count += 1
            for g in range(n):
                if mask >> g & 1 and count <= room:
                    count = _visit_goal(search, labels, r, mask, g, count)
            if count <= room:
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
    goal, rest = search.goal_list[g], mask ^ (1 << g)
    for arc in range(search.leg.shape[4]):
        offers = _offers(search, labels, r, rest, g, arc)
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
def _offers(search, labels, r, rest, g, arc):
    """Write what comes of all labels that the g-th goal may follow; return the number.

    Args:
        search, labels: `TourSearch`, `Labels`.
        r: robot.
        rest: goals visited before this one, as bits.
        g: number of the goal in the list.
        arc: of its border.
    """
    problem = search.routing
    goal = search.goal_list[g]
    ahead = search.rest.after[r, rest | 1 << g, g]
    offers = 0
    for k in range(labels.first[rest], labels.first[rest + 1]):
        node = labels.trace[k, 1]
        left = labels.value[k, 1] - problem.cost[r, node, goal]
        if left < problem.reserve[r]:
            continue
        leg = search.leg[r, node, labels.trace[k, 2], goal, arc]
        cost = labels.value[k, 0] + leg
        if leg < np.inf and cost + ahead <= search.most:
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
        for arc in range(cost.shape[1]):
            value = labels.value[k, 0] + search.leg[r, node, from_arc, goals + s, arc]
            if value < cost[s, arc] and value + ahead[s] <= search.most:
                cost[s, arc] = value
                origin[s, arc] = k


@kernel
def _after_station(search, r, mask, s):
    """Return a bound of what is still to come with robot r at a station."""
    rest = search.rest
    least = rest.to_finish[r, search.routing.goals + s] + rest.before[r + 1, mask]
    for u in range(len(search.goal_list)):
        if not mask >> u & 1:
            on = rest.from_station[r, s, u] + rest.after[r, mask | 1 << u, u]
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
            if enough and total < cost[mask]:
                cost[mask] = total
                last[mask] = k
