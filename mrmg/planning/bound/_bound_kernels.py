"""Compiled parts of the lower bound: exact tours, and a bound of any."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel


@kernel
def _station_values(problem, r, hop, goal_list, label, start_of, mask, station, came):
    """Write the least cost of standing at each station with a mask's goals visited.

    `came` receives the label it was driven from (-1: the start) and the first station
    on the way, shape (S, 2).
    """
    goals, targets = problem.goals, problem.cost.shape[2]
    stations = targets - goals
    first = np.full(stations, np.inf)
    origin = np.full(stations, -1, np.int64)
    for s in range(stations):
        if mask == 0:
            leg = problem.cost[r, targets, goals + s]
            if problem.energy[r] - leg >= problem.reserve[r]:
                first[s] = leg
            continue
        for g in range(len(goal_list)):
            leg = problem.cost[r, goal_list[g], goals + s]
            state = mask * len(goal_list) + g
            for k in range(start_of[state], start_of[state + 1]):
                enough = label[k, 1] - leg >= problem.reserve[r]
                if enough and label[k, 0] + leg < first[s]:
                    first[s] = label[k, 0] + leg
                    origin[s] = k
    for s in range(stations):
        station[s] = np.inf
        for f in range(stations):
            if first[f] + hop[f, s] < station[s]:
                station[s] = first[f] + hop[f, s]
                came[s, 0] = origin[f]
                came[s, 1] = f


@kernel
def subset_labels(problem, r, hop, goal_list, most_labels):
    """Return all undominated ways of one robot to visit each subset of the goals.

    Args:
        problem: the problem.
        r: robot.
        hop: least cost from station to station by way of any others, shape (S, S).
        goal_list: the open goals, shape (G,).
        most_labels: labels at most.

    Returns:
        (label, parent, start_of, station, came): cost and energy left of each label,
        shape (n, 2); the label (>= 0), the start (-1) or the station s (-2 - s) it was
        driven from; the first label of each state mask * G + goal; and each mask's
        costs at the stations with where they were driven from. No labels if there are
        more than `most_labels`.
    """
    n = len(goal_list)
    targets = problem.cost.shape[2]
    stations = targets - problem.goals
    label = np.empty((1024, 2))
    parent = np.empty(1024, np.int64)
    start_of = np.zeros((1 << n) * n + 1, np.int64)
    station = np.full((1 << n, stations), np.inf)
    came = np.full((1 << n, stations, 2), -1, np.int64)
    count = 0
    offer = np.empty((1024, 2))
    origin = np.empty(1024, np.int64)
    for mask in range(1 << n):
        for g in range(n):
            start_of[mask * n + g] = count
            if not mask >> g & 1:
                continue
            before = mask ^ (1 << g)
            goal = goal_list[g]
            offers = 0
            low, high = start_of[before * n], start_of[before * n + n]
            need = high - low + stations + 1
            if need > len(origin):
                offer = np.empty((2 * need, 2))
                origin = np.empty(2 * need, np.int64)
            if before == 0:
                leg = problem.cost[r, targets, goal]
                if problem.energy[r] - leg >= problem.reserve[r]:
                    offer[0, 0], offer[0, 1] = leg, problem.energy[r] - leg
                    origin[0] = -1
                    offers = 1
            for p in range(n):
                leg = problem.cost[r, goal_list[p], goal]
                state = before * n + p
                for k in range(start_of[state], start_of[state + 1]):
                    if label[k, 1] - leg >= problem.reserve[r]:
                        offer[offers, 0] = label[k, 0] + leg
                        offer[offers, 1] = label[k, 1] - leg
                        origin[offers] = k
                        offers += 1
            for s in range(stations):
                leg = problem.cost[r, problem.goals + s, goal]
                left = problem.capacity[r] - leg
                if left >= problem.reserve[r] and station[before, s] < np.inf:
                    offer[offers, 0] = station[before, s] + leg
                    offer[offers, 1] = left
                    origin[offers] = -2 - s
                    offers += 1
            most_energy = -np.inf
            for k in np.argsort(offer[:offers, 0], kind="mergesort"):
                if offer[k, 1] <= most_energy:
                    continue
                most_energy = offer[k, 1]
                if count == len(parent):
                    if count >= most_labels:
                        return label[:0], parent[:0], start_of, station, came
                    label = np.concatenate((label, np.empty_like(label)))
                    parent = np.concatenate((parent, np.empty_like(parent)))
                label[count] = offer[k]
                parent[count] = origin[k]
                count += 1
        start_of[mask * n + n] = count
        _station_values(
            problem, r, hop, goal_list, label, start_of, mask, station[mask], came[mask]
        )
    return label[:count], parent[:count], start_of, station, came


@kernel
def cheapest_labels(problem, r, goal_list, label, start_of, station):
    """Return the cost of every subset, to the finish, and what the finish follows.

    Args:
        problem, r, goal_list: as of `subset_labels`.
        label, start_of, station: as `subset_labels` returned them.

    Returns:
        (cost, last), shape (2^n,) each; last is a label (>= 0), the start (-1) or the
        station s (-2 - s).
    """
    n = len(goal_list)
    targets = problem.cost.shape[2]
    cost = np.full(1 << n, np.inf)
    last = np.full(1 << n, -1, np.int64)
    leg = problem.finish[r, targets]
    if leg == 0.0 or problem.energy[r] - leg >= problem.reserve[r]:
        cost[0] = leg
    for mask in range(1 << n):
        for g in range(n):
            leg = problem.finish[r, goal_list[g]]
            for k in range(start_of[mask * n + g], start_of[mask * n + g + 1]):
                enough = label[k, 1] - leg >= problem.reserve[r]
                if enough and label[k, 0] + leg < cost[mask]:
                    cost[mask] = label[k, 0] + leg
                    last[mask] = k
        for s in range(targets - problem.goals):
            leg = problem.finish[r, problem.goals + s]
            enough = problem.capacity[r] - leg >= problem.reserve[r]
            if enough and station[mask, s] + leg < cost[mask]:
                cost[mask] = station[mask, s] + leg
                last[mask] = -2 - s
    return cost, last


@kernel
def join_robot(fleet, own):
    """Return the least cost of each subset with one more robot, and its own share."""
    joined = np.full(len(fleet), np.inf)
    share = np.zeros(len(fleet), np.int64)
    for mask in range(len(fleet)):
        part = mask
        while True:
            value = fleet[mask ^ part] + own[part]
            if value < joined[mask]:
                joined[mask] = value
                share[mask] = part
            if part == 0:
                break
            part = (part - 1) & mask
    return joined, share


@kernel
def join_longest(fleet, own):
    """Return each subset's least longest share, shared with one more robot."""
    joined = np.full(len(fleet), np.inf)
    for mask in range(len(fleet)):
        part = mask
        while True:
            joined[mask] = min(joined[mask], max(fleet[mask ^ part], own[part]))
            if part == 0:
                break
            part = (part - 1) & mask
    return joined


@kernel
def spanning_bound(between, start, rounds):
    """Return a lower bound of the cost of paths from the starts through all goals.

    Paths are a spanning tree of the goals and a root in the place of all starts, in
    which no goal has more than two edges and no start more than one. Prices on edges in
    excess (Held and Karp 1971) raise the tree's cost; every price >= 0 gives a bound.

    Args:
        between: symmetric, from goal to goal, shape (G, G).
        start: from start to goal, shape (R, G).
        rounds: changes of the prices.
    """
    robots, n = start.shape
    price = np.zeros(n)
    toll = np.zeros(robots)
    best = 0.0
    step = 0.0
    for i in range(rounds):
        degree = np.zeros(n)
        leaving = np.zeros(robots)
        total = 0.0
        near = np.full(n, np.inf)
        link = np.zeros(n, np.int64)
        for g in range(n):
            for r in range(robots):
                if start[r, g] + toll[r] + price[g] < near[g]:
                    near[g] = start[r, g] + toll[r] + price[g]
                    link[g] = -1 - r
        joined = np.zeros(n, np.bool_)
        for _ in range(n):
            best_goal, least = -1, np.inf
            for g in range(n):
                if not joined[g] and near[g] < least:
                    best_goal, least = g, near[g]
            if best_goal < 0:
                return np.inf
            total += least
            joined[best_goal] = True
            degree[best_goal] += 1.0
            if link[best_goal] < 0:
                leaving[-1 - link[best_goal]] += 1.0
            else:
                degree[link[best_goal]] += 1.0
            for g in range(n):
                way = between[best_goal, g] + price[best_goal] + price[g]
                if not joined[g] and way < near[g]:
                    near[g] = way
                    link[g] = best_goal
        best = max(best, total - 2.0 * price.sum() - toll.sum())
        if i == 0:
            step = 0.5 * total / n
        for g in range(n):
            price[g] = max(0.0, price[g] + step * (degree[g] - 2.0))
        for r in range(robots):
            toll[r] = max(0.0, toll[r] + step * (leaving[r] - 1.0))
        step *= 0.98
    return best
