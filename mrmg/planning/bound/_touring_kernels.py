"""Compiled label setting: the cheapest tours of a fleet, in order of goals visited.

A fleet's tours are one chain: robots drive one after the other, each from its own start
with the goals visited that those before it left behind. States are (robot, goals
visited, node, arc of the node's border); nodes are targets and, last, the start. A
label of a state is a cost and the energy left, and is dropped where another one costs
no more and leaves no less (resource-constrained shortest paths, Desrochers 1988).

Where visits are counted (`_completion_kernels`), no label leads straight back to the
goal before. So labels that come from different goals differ in where they may lead, and
two are needed to drop a third (elimination of 2-cycles, Houck et al. 1980).

What a leg drains a battery by and what it costs are two things: the cost may be energy,
time or nothing, and it may depend on the arcs where regions are touched.
"""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.bound._completion_kernels import (
    after_visit,
    before_visit,
    states_of,
)
from mrmg.planning.bound._label_kernels import (
    NOTHING,
    Labels,
    set_trace,
)


@kernel
def cheapest_tours(search, room, work):
    """Return the least cost of each state of visits, and its tours' labels.

    Args:
        search: `TourSearch`.
        room: labels at most.
        work: candidates at most.

    Returns:
        (cost, last, place, parent, tried): of each state, inf where no tours lead to it
        that cost at most `search.most`, shape (X,); the last label of its tours; of
        each label as in `Labels`, empty if there are more than there is room for, or
        more candidates than may be; and how many of these there were.
    """
    problem = search.routing
    n, start = len(search.goal_list), search.leg.shape[3]
    states = states_of(n, search.remembered)
    labels = Labels(
        np.empty((room, 2)),
        np.empty((room, 3), np.int16),
        np.empty(room, np.int32),
        np.zeros(states + 1, np.int64),
        np.empty(room, np.int32),
        np.empty((room, 2)),
        np.empty(room, np.int32),
        np.zeros(1, np.int64),
    )
    cost = np.full(states, np.inf)
    last = np.full(states, NOTHING, np.int32)
    cost[0] = 0.0
    count = 0
    for r in range(len(problem.energy)):
        labels.first[0] = count
        for state in range(states):
            if cost[state] < np.inf and (
                cost[state] + search.rest.before[state] <= search.most
            ):
                if count < room:
                    priced = cost[state] + search.setting_out[r]
                    labels.value[count, 0], labels.value[count, 1] = (
                        priced,
                        problem.energy[r],
                    )
                    set_trace(labels, count, r, start, 0, last[state])
                count += 1
            for g in range(n):
                rest = before_visit(state, g, search.remembered)
                # Nothing is called in vain: a call's many arrays take their time.
                some = rest >= 0 and labels.first[rest] < labels.first[rest + 1]
                if some and count <= room:
                    count = _visit_goal(search, labels, r, state, g, count)
            if labels.first[state] < count <= room:
                count = _visit_stations(search, labels, r, state, count)
            tried = labels.tried[0]
            if count > room or tried > work:
                return cost, last, labels.place[:0], labels.parent[:0], tried
            labels.first[state + 1] = count
        _end_tours(search, labels, r, cost, last)
    return cost, last, labels.place[:count], labels.parent[:count], labels.tried[0]


@kernel
def _visit_goal(search, labels, r, state, g, count):
    """Set the labels of robot r at the g-th goal, in a state of visits.

    Returns:
        The number of labels; more than there is room for if they do not fit.
    """
    goal, ahead = search.goal_list[g], search.rest.after[state, g]
    rest = before_visit(state, g, search.remembered)
    near = _near(search, labels, r, rest, g, ahead)
    for arc in range(search.leg.shape[4] if near else 0):
        offers = _offers(search, labels, r, near, goal, arc, ahead)
        if offers == 0:
            continue
        if count + offers > len(labels.value):
            return len(labels.value) + 1
        first = count
        # Most energy left, the goal it comes from, and most by way of another one.
        most_left, source, other_left = -np.inf, NOTHING, -np.inf
        for k in np.argsort(labels.offer[:offers, 0], kind="mergesort"):
            cost, left = labels.offer[k, 0], labels.offer[k, 1]
            origin = _counted_origin(search, labels, labels.origin[k])
            if left <= other_left:
                continue
            if left <= most_left and source in (NOTHING, origin):
                continue
            alike = count > first and labels.value[count - 1, 0] == cost
            if alike and left >= most_left and origin < 0:
                count -= 1  # as costly, and no more energy left
            if left <= most_left:
                other_left = left
            else:
                if source != origin:
                    other_left = most_left
                most_left, source = left, origin
            labels.value[count, 0], labels.value[count, 1] = cost, left
            set_trace(labels, count, r, goal, arc, labels.origin[k])
            count += 1
    return count


@kernel
def _near(search, labels, r, rest, g, ahead):
    """Write the labels that a goal may follow at one of its arcs; return their number.

    Args:
        search, labels: `TourSearch`, `Labels`.
        r: robot.
        rest: state before this visit.
        g: which goal of the list.
        ahead: what bounds the rest of the mission after it.
    """
    problem, goal = search.routing, search.goal_list[g]
    counted, price = g >= search.remembered, search.price[goal]
    near = 0
    labels.tried[0] += labels.first[rest + 1] - labels.first[rest]
    for k in range(labels.first[rest], labels.first[rest + 1]):
        node, from_arc = labels.place[k, 1], labels.place[k, 2]
        if counted and node < problem.goals:
            before = labels.place[labels.parent[k], 1]
            if goal in (node, before):
                continue
        cost, left = labels.value[k, 0], labels.value[k, 1]
        left -= problem.cost[r, node, goal]
        cost += price + search.nearest[r, node, from_arc, goal]
        if left < problem.reserve[r] or cost == np.inf:
            continue
        if cost + ahead <= search.most:
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
        ahead: what bounds the rest of the mission after it.
    """
    problem, start, price = search.routing, search.leg.shape[3], search.price[goal]
    leg, drain = search.leg[r, :, :, goal, arc], search.drain[r, :, :, goal, arc]
    offers = 0
    # The cheapest so far: most others leave no more energy, and need not be sorted.
    least, least_left, least_origin = np.inf, -np.inf, NOTHING
    labels.tried[0] += near
    for k in labels.near[:near]:
        node, from_arc = labels.place[k, 1], labels.place[k, 2]
        cost, left = labels.value[k, 0], labels.value[k, 1]
        cost += price + leg[node, from_arc]
        if problem.goals <= node < start:
            left -= search.station_drain[r, node - problem.goals, goal, arc]
        else:
            left -= drain[node, from_arc]
        if left < problem.reserve[r] or cost == np.inf:
            continue
        if cost + ahead > search.most:
            continue
        left = min(left, problem.capacity[r])
        origin = _counted_origin(search, labels, k)
        if cost >= least and left <= least_left and least_origin in (NOTHING, origin):
            continue
        if cost < least:
            least, least_left, least_origin = cost, left, origin
        labels.offer[offers, 0], labels.offer[offers, 1] = cost, left
        labels.origin[offers] = k
        offers += 1
    return offers


@kernel
def _counted_origin(search, labels, k):
    """Return the goal that label k is at, if its visits are counted."""
    node = labels.place[k, 1]
    return node if search.is_counted[node] else NOTHING


@kernel
def _visit_stations(search, labels, r, state, count):
    """Set the labels of robot r at the stations in a state of visits.

    A full battery is the same whatever came before, so that costs decide: Dijkstra over
    the stations' arcs, from the labels of this state.

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
        ahead[s] = _after_station(search, r, state, s)
    for k in range(labels.first[state], count):
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
        labels.value[count, 0], labels.value[count, 1] = least, problem.capacity[r]
        set_trace(labels, count, r, goals + s, arc, origin[s, arc])
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
    node, from_arc = labels.place[k, 1], labels.place[k, 2]
    goals, start = search.routing.goals, search.leg.shape[3]
    charged, before = goals <= node < start, labels.value[k, 0]
    for s in range(len(cost)):
        if search.routing.cost[r, node, goals + s] > usable or node == goals + s:
            continue
        nearest = search.nearest[r, node, from_arc, goals + s]
        if before + nearest + ahead[s] > search.most:
            continue
        for arc in range(cost.shape[1]):
            drain = search.drain[r, node, from_arc, goals + s, arc]
            if charged:
                drain = search.station_drain[r, node - goals, goals + s, arc]
            if drain > usable:
                continue
            value = before + search.leg[r, node, from_arc, goals + s, arc]
            if value < cost[s, arc] and value + ahead[s] <= search.most:
                cost[s, arc] = value
                origin[s, arc] = k


@kernel
def _after_station(search, r, state, s):
    """Return a bound of what is still to come with robot r at a station."""
    rest, states = search.rest, len(search.rest.before)
    least = rest.to_finish[r, search.routing.goals + s] + rest.before[state]
    for u in range(len(search.goal_list)):
        following = after_visit(state, u, search.remembered, states)
        if following >= 0:
            on = rest.from_station[r, s, u] + rest.after[following, u]
            least = min(least, on)
    return least


@kernel
def _end_tours(search, labels, r, cost, last):
    """Write the cost of each state once robot r has ended, and its last label.

    A robot that may end where it starts need not have any energy for that.
    """
    problem = search.routing
    for state in range(len(cost)):
        cost[state] = np.inf
        for k in range(labels.first[state], labels.first[state + 1]):
            node = labels.place[k, 1]
            before, left = labels.value[k, 0], labels.value[k, 1]
            drain = problem.finish[r, node]
            total = before + search.finish[r, node]
            enough = drain <= 0.0 or left - drain >= problem.reserve[r]
            # Of what costs more, tours that cost less may have been missed.
            few = total + search.rest.before[state] <= search.most
            if enough and few and total < cost[state]:
                cost[state] = total
                last[state] = k
