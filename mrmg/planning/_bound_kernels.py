"""Compiled parts of the lower bound: certified distance fields and exact tours.

A field u over a grid is certified if it is nowhere steeper than the ground is dear:
then u(b) - u(a) is at most the cost of any way from a to b through free cells, however
u was found. Between the nodes of the grid fields are bilinear.
"""

from __future__ import annotations

import heapq
from math import sqrt

import numpy as np

from mrmg.compilation import kernel

UNREACHED = 1e18
"""Field value of nodes that no free cell joins to the source."""


@kernel
def certified_field(price, cell, seed, rounds, band):
    """Return a field that is nearly the cost from a source, and what certifies it.

    Solves the eikonal equation, lowers the price where the solution is too steep for
    the given price, and starts again, as fronts that spread are too steep behind. What
    steepness is left, mostly where fronts meet, is divided out level by level: f(u) is
    certified if f grows no faster than 1 / (largest excess among cells on a level).

    Args:
        price: cost per metre of each cell, inf where blocked, shape (Y, X).
        cell: side of a cell [m].
        seed: values near the source, UNREACHED elsewhere, shape (Y + 1, X + 1).
        rounds: solutions.
        band: width of a level.

    Returns:
        (u, level, certified): the field, shape (Y + 1, X + 1), and f at rising levels;
        it is linear between them.
    """
    lowered = price.copy()
    field = _solve_eikonal(lowered, cell, seed)
    for _ in range(rounds - 1):
        _lower_where_steep(field, price, cell, lowered)
        field = _solve_eikonal(lowered, cell, seed)
    low, high = field.min(), field.min()
    for value in field.ravel():
        if value < UNREACHED:
            high = max(high, value)
    excess = np.ones(int((high - low) / band) + 2)
    for row in range(price.shape[0]):
        for column in range(price.shape[1]):
            if price[row, column] == np.inf or field[row, column] >= UNREACHED:
                continue
            ratio = steepness(field, cell, row, column) / price[row, column]
            corners = field[row : row + 2, column : column + 2]
            first = int((corners.min() - low) / band)
            last = int((corners.max() - low) / band)
            for k in range(first, last + 1):
                excess[k] = max(excess[k], ratio)
    level = low + band * np.arange(len(excess) + 1)
    certified = np.zeros(len(level))
    certified[1:] = np.cumsum(band / excess)
    return field, level, certified


@kernel
def steepness(field, cell, row, column):
    """Return the largest gradient of the bilinear field in a cell.

    Each partial derivative lies between its values on two opposite sides, so the
    gradient is largest at a corner.
    """
    a, b = field[row, column], field[row, column + 1]
    c, d = field[row + 1, column], field[row + 1, column + 1]
    across = max(abs(b - a), abs(d - c))
    along = max(abs(c - a), abs(d - b))
    return sqrt(across * across + along * along) / cell


@kernel
def _lower_where_steep(field, price, cell, lowered):
    """Lower the working price of too steep cells, by sqrt(2) at most."""
    for row in range(price.shape[0]):
        for column in range(price.shape[1]):
            if price[row, column] == np.inf:
                continue
            ratio = steepness(field, cell, row, column) / price[row, column]
            if ratio > 1.0:
                floor = price[row, column] / sqrt(2.0)
                lowered[row, column] = max(floor, lowered[row, column] / ratio)


@kernel
def _solve_eikonal(price, cell, seed):
    """Return the solution of |grad u| = price from the seeds: fast marching."""
    rows, columns = seed.shape
    field = seed.copy()
    done = np.zeros((rows, columns), np.bool_)
    heap = [(0.0, 0)]
    heap.pop()
    for row in range(rows):
        for column in range(columns):
            if seed[row, column] < UNREACHED:
                heap.append((seed[row, column], row * columns + column))
    heapq.heapify(heap)
    while heap:
        _, node = heapq.heappop(heap)
        row, column = node // columns, node % columns
        if done[row, column]:
            continue
        done[row, column] = True
        for side in range(4):
            i = row + (side == 0) - (side == 1)
            j = column + (side == 2) - (side == 3)
            if i < 0 or j < 0 or i >= rows or j >= columns or done[i, j]:
                continue
            value = _node_value(price, cell, field, i, j)
            if value < field[i, j]:
                field[i, j] = value
                heapq.heappush(heap, (value, i * columns + j))
    return field


@kernel
def _node_value(price, cell, field, row, column):
    """Return the least value the four cells about a node allow it."""
    best = UNREACHED
    for quadrant in range(4):
        up, right = quadrant // 2, quadrant % 2
        i, j = row - 1 + up, column - 1 + right
        if i < 0 or j < 0 or i >= price.shape[0] or j >= price.shape[1]:
            continue
        if price[i, j] == np.inf:
            continue
        step = price[i, j] * cell
        a, b = field[row - 1 + 2 * up, column], field[row, column - 1 + 2 * right]
        if abs(a - b) < step:
            value = 0.5 * (a + b + sqrt(2.0 * step * step - (a - b) * (a - b)))
        else:
            value = min(a, b) + step
        best = min(best, value)
    return best


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
