"""Compiled part of the touring bound: cheapest tours by where goals are first touched.

A fleet's tours are one chain: robots drive one after the other, each from its own start
with the goals visited that those before it left behind. States are (robot, goals
visited, place, arc of the place's border).
"""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel

NOTHING = -1
"""Parent of the first label."""


@kernel
def least_completions(way, start):
    """Return bounds of what visiting the rest of the goals costs.

    Args:
        way: from goal to goal by any stations, shape (R, G, G).
        start: from start to goal, shape (R, G).

    Returns:
        (after, before): with a robot at a goal, shape (R, 2^G, G), and with a robot
        that has not set out, shape (R + 1, 2^G).
    """
    robots, n = start.shape
    full = (1 << n) - 1
    after = np.full((robots, full + 1, n), np.inf)
    before = np.full((robots + 1, full + 1), np.inf)
    before[robots, full] = 0.0
    for r in range(robots - 1, -1, -1):
        for mask in range(full, -1, -1):
            for g in range(n):
                if not mask >> g & 1:
                    continue
                least = before[r + 1, mask]
                for u in range(n):
                    if not mask >> u & 1:
                        least = min(least, way[r, g, u] + after[r, mask | 1 << u, u])
                after[r, mask, g] = least
            least = before[r + 1, mask]
            for u in range(n):
                if not mask >> u & 1:
                    least = min(least, start[r, u] + after[r, mask | 1 << u, u])
            before[r, mask] = least
    return after, before


@kernel
def touring_labels(problem, goal_list, leg, from_station, after, before, most, room):
    """Return the cheapest tours of a fleet that cost at most `most`.

    Args:
        problem: the routing problem of least legs, which drain batteries.
        goal_list: the open goals, shape (G,).
        leg: what legs cost from arc to arc, shape (R, T + 1, K, T, K); row T is the
            start, in whose arc 0 robots are.
        from_station: least cost from station to goal, shape (R, S, G).
        after, before: as `least_completions` returns them.
        most: cost of tours of interest; others may be missed.
        room: labels at most.

    Returns:
        (cost, last, trace): of the cheapest tours, inf if none costs at most `most`;
        their last label; and robot, place, arc and parent of each label, shape (n, 4).
        No labels if there are more than there is room for.
    """
    n = len(goal_list)
    targets, arcs = leg.shape[3], leg.shape[4]
    goals = problem.goals
    stations = targets - goals
    masks = 1 << n
    count = 0
    label = np.empty((1024, 2))
    trace = np.empty((1024, 4), np.int32)
    base = np.full(masks, np.inf)
    base_from = np.full(masks, NOTHING, np.int32)
    base[0] = 0.0
    offer = np.empty((64, 2))
    origin = np.empty(64, np.int32)
    for r in range(len(problem.energy)):
        first_of = np.zeros(masks + 1, np.int64)
        for mask in range(masks):
            first_of[mask] = count
            label, trace = _with_room(label, trace, count + 1 + stations * arcs)
            if base[mask] + before[r, mask] <= most:
                label[count, 0], label[count, 1] = base[mask], problem.energy[r]
                trace[count, 0], trace[count, 1] = r, targets
                trace[count, 2], trace[count, 3] = 0, base_from[mask]
                count += 1
            for g in range(n):
                rest = mask ^ (1 << g)
                ahead = after[r, mask, g]
                if not mask >> g & 1 or first_of[rest] == first_of[rest + 1]:
                    continue
                goal = goal_list[g]
                low, high = first_of[rest], first_of[rest + 1]
                if high - low > len(origin):
                    offer = np.empty((2 * (high - low), 2))
                    origin = np.empty(2 * (high - low), np.int32)
                for arc in range(arcs):
                    offers = 0
                    for k in range(low, high):
                        place = trace[k, 1]
                        left = label[k, 1] - problem.cost[r, place, goal]
                        if left < problem.reserve[r]:
                            continue
                        cost = label[k, 0] + leg[r, place, trace[k, 2], goal, arc]
                        if cost + ahead <= most:
                            offer[offers, 0], offer[offers, 1] = cost, left
                            origin[offers] = k
                            offers += 1
                    label, trace = _with_room(
                        label, trace, count + offers + 1 + stations * arcs
                    )
                    most_left = -np.inf
                    for k in np.argsort(offer[:offers, 0], kind="mergesort"):
                        if offer[k, 1] <= most_left:
                            continue
                        most_left = offer[k, 1]
                        label[count, 0], label[count, 1] = offer[k, 0], offer[k, 1]
                        trace[count, 0], trace[count, 1] = r, goal
                        trace[count, 2], trace[count, 3] = arc, origin[k]
                        count += 1
                if count > room:
                    return np.inf, -1, trace[:0]
            count = _append_stations(
                problem,
                r,
                goal_list,
                leg,
                from_station,
                after,
                most,
                mask,
                label,
                trace,
                first_of[mask],
                count,
            )
            first_of[mask + 1] = count
        for mask in range(masks):
            for k in range(first_of[mask], first_of[mask + 1]):
                if trace[k, 1] < goals and label[k, 0] < base[mask]:
                    base[mask] = label[k, 0]
                    base_from[mask] = k
    return base[masks - 1], base_from[masks - 1], trace[:count]


@kernel
def _with_room(label, trace, count):
    """Return the arrays, or copies of more than twice the length that hold `count`."""
    if count <= len(label):
        return label, trace
    longer = np.empty((2 * count, 2))
    longer[: len(label)] = label
    further = np.empty((2 * count, 4), np.int32)
    further[: len(trace)] = trace
    return longer, further


@kernel
def _append_stations(
    problem,
    r,
    goal_list,
    leg,
    from_station,
    after,
    most,
    mask,
    label,
    trace,
    low,
    count,
):
    """Write the labels of a robot at the stations with a mask's goals visited."""
    goals, targets, arcs = problem.goals, leg.shape[3], leg.shape[4]
    stations = targets - goals
    cost = np.full((stations, arcs), np.inf)
    origin = np.full((stations, arcs), -1, np.int32)
    ahead = np.full(stations, np.inf)
    for s in range(stations):
        for u in range(len(goal_list)):
            if not mask >> u & 1:
                further = from_station[r, s, u] + after[r, mask | 1 << u, u]
                ahead[s] = min(ahead[s], further)
        for k in range(low, count):
            place = trace[k, 1]
            left = label[k, 1] - problem.cost[r, place, goals + s]
            if left < problem.reserve[r]:
                continue
            for arc in range(arcs):
                value = label[k, 0] + leg[r, place, trace[k, 2], goals + s, arc]
                if value < cost[s, arc] and value + ahead[s] <= most:
                    cost[s, arc] = value
                    origin[s, arc] = k
    usable = problem.capacity[r] - problem.reserve[r]
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
        label[count, 0], label[count, 1] = least, problem.capacity[r]
        trace[count, 0], trace[count, 1] = r, goals + s
        trace[count, 2], trace[count, 3] = arc, origin[s, arc]
        for other in range(stations):
            if problem.cost[r, goals + s, goals + other] > usable or other == s:
                continue
            for j in range(arcs):
                value = least + leg[r, goals + s, arc, goals + other, j]
                if value < cost[other, j] and value + ahead[other] <= most:
                    cost[other, j] = value
                    origin[other, j] = count
        count += 1
