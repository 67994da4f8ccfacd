"""Costs-to-go over grids: what a point robot's cheapest way through its targets takes.

Static ones know obstacles alone; timed ones also know where the other robots are when.
"""

from __future__ import annotations

from math import cos, floor, pi, sin, sqrt

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.path_following.coordination._guide_kernels import BEARINGS
from mrmg.planning.problem._clearance_kernels import keeps_clear
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS
from mrmg.planning.roadmap._heap_kernels import pop, push
from mrmg.world._polygon_kernels import (
    place_turned,
    point_convex_distance,
    point_distance,
)

DIAGONAL = sqrt(2.0)

FITTING = 16
"""Headings with which a robot may stand beside a wall."""


@kernel
def cost_to_go(price, seed):
    """Return the least cost from each cell to a seed and on (Dijkstra).

    Args:
        price: cost of a cell's side, inf where it may not be passed, shape (ny, nx).
        seed: cost from a cell on where the way may end, else inf, shape (ny, nx).

    Returns:
        Shape (ny, nx); inf where no seed can be reached from.
    """
    rows, columns = price.shape
    cost = seed.copy()
    room = 8 * rows * columns + 8
    key, entry = np.empty(room), np.empty(room, np.int64)
    size = 0
    for i in range(rows):
        for j in range(columns):
            if cost[i, j] < np.inf:
                size = push(key, entry, size, cost[i, j], i * columns + j)
    while size > 0:
        value, node = key[0], entry[0]
        size = pop(key, entry, size)
        i, j = node // columns, node % columns
        if value > cost[i, j]:
            continue
        for a in range(max(0, i - 1), min(rows, i + 2)):
            for b in range(max(0, j - 1), min(columns, j + 2)):
                way = DIAGONAL if a != i and b != j else 1.0
                there = value + 0.5 * way * (price[i, j] + price[a, b])
                if there < cost[a, b]:
                    cost[a, b] = there
                    size = push(key, entry, size, there, a * columns + b)
    return cost


@kernel
def turning_cost_to_go(price, turn_s, back, cost):
    """Lower the costs of poses by way of each other (Dijkstra).

    A robot drives ahead or back to the next cell in the line of its heading, or turns
    from one of BEARINGS to the next one.

    Args:
        price: cost of a cell's side, inf where it may not be passed, shape (ny, nx).
        turn_s: cost of turning by one heading, shape (ny, nx).
        back: cost of driving back over that of driving ahead; inf if it cannot.
        cost: where the way may end from each pose on, else inf; receives the least
            costs, shape (BEARINGS, ny, nx).
    """
    rows, columns = price.shape
    poses = BEARINGS * rows * columns
    key, entry = np.empty(5 * poses + 8), np.empty(5 * poses + 8, np.int64)
    size = 0
    for pose in range(poses):
        value = cost[pose // (rows * columns), pose // columns % rows, pose % columns]
        if value < np.inf:
            size = push(key, entry, size, value, pose)
    while size > 0:
        value, pose = key[0], entry[0]
        size = pop(key, entry, size)
        h, i, j = pose // (rows * columns), pose // columns % rows, pose % columns
        if value > cost[h, i, j]:
            continue
        angle = 2.0 * pi * h / BEARINGS
        di, dj = round(sin(angle)), round(cos(angle))
        way = DIAGONAL if di != 0 and dj != 0 else 1.0
        for move in range(4):
            g, a, b, more = h, i, j, turn_s[i, j]
            if move < 2:  # it comes from behind, or from ahead and drives back
                side = -1 if move == 0 else 1
                a, b = i + side * int(di), j + side * int(dj)
                if not (0 <= a < rows and 0 <= b < columns):
                    continue
                more = 0.5 * way * (price[i, j] + price[a, b])
                more *= 1.0 if move == 0 else back
            else:
                g = (h + (1 if move == 2 else BEARINGS - 1)) % BEARINGS
            if value + more < cost[g, a, b]:
                cost[g, a, b] = value + more
                pose = (g * rows + a) * columns + b
                size = push(key, entry, size, value + more, pose)


@kernel
def timed_cost_to_go(price, penalty, hold, field):
    """Fill in the costs-to-go of all layers of time but the last one, latest first.

    In the time of a layer a point robot moves to a cell beside its own, or holds.

    Args:
        price: cost of a cell's side, inf where it may not be passed, shape (ny, nx).
        penalty: cost of being in a cell, inf where other robots are, (T, ny, nx).
        hold: cost of holding for the time of a layer, shape (ny, nx).
        field: cost from a cell on where the way may end, else inf; receives the
            costs-to-go; those of the last layer are there, shape (T, ny, nx).
    """
    rows, columns = price.shape
    # Borders spare the loops all branches, so that several cells are reckoned at once.
    beside = np.full((rows + 2, columns + 2), np.inf)
    across = beside.copy()
    for t in range(len(field) - 2, -1, -1):
        for i in range(rows):
            for j in range(columns):
                half = 0.5 * price[i, j]
                beside[i + 1, j + 1] = half + field[t + 1, i, j]
                across[i + 1, j + 1] = DIAGONAL * half + field[t + 1, i, j]
        for i in range(rows):
            for j in range(columns):
                half = 0.5 * price[i, j]
                sides = min(beside[i, j + 1], beside[i + 2, j + 1])
                sides = min(sides, beside[i + 1, j], beside[i + 1, j + 2])
                corners = min(across[i, j], across[i, j + 2])
                corners = min(corners, across[i + 2, j], across[i + 2, j + 2])
                best = min(half + sides, DIAGONAL * half + corners)
                best = min(best, field[t, i, j], hold[i, j] + field[t + 1, i, j])
                field[t, i, j] = penalty[t, i, j] + (best if half < np.inf else half)


@kernel
def descend(price, region, stay, hold, field, way):
    """Write the cells of the cheapest way down the costs-to-go; return their number.

    Args:
        price: cost of a cell's side, inf where it may not be passed, shape (ny, nx).
        region: cells of each leg's target, shape (L, ny, nx).
        stay: layers to stand in each of them, -1 for good, shape (L,).
        hold: cost of holding for the time of a layer outside of where it ends.
        field: costs-to-go, shape (L, T, ny, nx); the last layer lasts.
        way: row and column of the first cell; receives the next ones, shape (n, 2).
    """
    rows, columns = price.shape
    legs, last = len(field), field.shape[1] - 1
    leg = t = 0
    i, j = way[0]
    for n in range(1, len(way)):
        while leg < legs and region[leg, i, j] and (stay[leg] >= 0 or t == last):
            after = 0.0
            if stay[leg] >= 0 and leg + 1 < legs:
                after = field[leg + 1, min(t + stay[leg], last), i, j]
            if after > field[leg, t, i, j]:
                break
            t = min(t + max(stay[leg], 0), last)
            leg += 1
        if leg == legs:
            return n
        u, best, row, column = min(t + 1, last), np.inf, -1, -1
        if t < last:
            ends = region[leg, i, j] and stay[leg] < 0
            best, row, column = field[leg, u, i, j] + (0.0 if ends else hold), i, j
        for a in range(max(0, i - 1), min(rows, i + 2)):
            for b in range(max(0, j - 1), min(columns, j + 2)):
                side = DIAGONAL if a != i and b != j else 1.0
                cost = field[leg, u, a, b] + 0.5 * side * (price[i, j] + price[a, b])
                if cost < best and (a != i or b != j):
                    best, row, column = cost, a, b
        if not best < np.inf:
            return n
        t, i, j = u, row, column
        way[n, 0], way[n, 1] = i, j
    return len(way)


@kernel
def add_others(own, traffic, inner, grid, layer, soft_s, penalty):
    """Add to penalties where the other robots are in each layer of time.

    Where the robot cannot be whatever its heading, penalties are inf; of robots of
    lower priority they grow with the nearness.

    Args:
        own: the robot, shape (1,).
        traffic: the others.
        inner: radius of the circle around its reference point in its footprint, with
            what the size of cells adds [m].
        grid: corner (x, y) of the grid and side of its cells [m].
        layer: steps that a layer lasts.
        soft_s: cost of a layer in conflict with a robot of lower priority.
        penalty: of cells, shape (T, ny, nx).
    """
    layers, rows, columns = penalty.shape
    x_min, y_min, cell = grid
    corner = np.empty((MOST_CORNERS, 2))
    for other in range(len(traffic.robot)):
        hard = traffic.robot[other].hard
        if not (hard or traffic.robot[other].soft):
            continue
        it = traffic.fleet[other]
        outline, placed = it.corner[: it.corners], corner[: it.corners]
        near = inner + max(own[0].spacing, it.spacing)
        reach = own[0].radius + it.radius
        far = near + it.radius
        t = 0
        while t < layers:
            k = min(t * layer, traffic.robot[other].last)
            stands = k == traffic.robot[other].last
            after = layers if stands else t + 1  # layers that look alike
            pose, middle = traffic.pose[other, k], traffic.middle[other, k]
            place_turned(outline, pose[0], pose[1], pose[3], pose[4], placed)
            first_row = max(0, int(floor((middle[1] - far - y_min) / cell)))
            last_row = min(rows - 1, int(floor((middle[1] + far - y_min) / cell)))
            for i in range(first_row, last_row + 1):
                y = y_min + (i + 0.5) * cell
                half = sqrt(max(0.0, far * far - (y - middle[1]) ** 2))
                a = max(0, int(floor((middle[0] - half - x_min) / cell)))
                b = min(columns - 1, int(floor((middle[0] + half - x_min) / cell)))
                # The footprint is convex: cells between the outermost near it are, too.
                while a <= b and not (
                    point_convex_distance(x_min + (a + 0.5) * cell, y, placed) < near
                ):
                    a += 1
                while b > a and not (
                    point_convex_distance(x_min + (b + 0.5) * cell, y, placed) < near
                ):
                    b -= 1
                for u in range(t, after):
                    for j in range(a, b + 1):
                        if hard:
                            penalty[u, i, j] = np.inf
                            continue
                        x = x_min + (j + 0.5) * cell
                        apart = point_distance(x, y, middle[0], middle[1])
                        penalty[u, i, j] += soft_s * max(0.0, 1.0 - apart / reach)
            t = after


@kernel
def add_region(targets, t, x_min, y_min, cell, region):
    """Mark the cells of a grid whose middles are in a target, and the one of its own.

    Args:
        targets: all targets.
        t: number of one.
        x_min, y_min, cell: corner of the grid and side of its cells [m].
        region: receives them, shape (ny, nx).
    """
    rows, columns = region.shape
    column = int(floor((targets.target[t].center[0] - x_min) / cell))
    row = int(floor((targets.target[t].center[1] - y_min) / cell))
    more = int(targets.target[t].reach / cell) + 1
    for i in range(max(0, row - more), min(rows, row + more + 1)):
        for j in range(max(0, column - more), min(columns, column + more + 1)):
            x, y = x_min + (j + 0.5) * cell, y_min + (i + 0.5) * cell
            if in_target(targets, t, x, y):
                region[i, j] = True
    region[min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)] = True


@kernel
def add_fitting(own, spaces, place, grid, fits):
    """Mark the cells near a place where a robot keeps clear with some heading.

    Args:
        own: the robot, shape (1,).
        spaces: free spaces of the fleet.
        place: (x, y) [m].
        grid: corner (x, y) of the grid and side of its cells [m].
        fits: receives them, shape (ny, nx).
    """
    rows, columns = fits.shape
    x_min, y_min, cell = grid
    px, py = place
    reach, corner, pose = 2.0 * own[0].radius, np.empty((MOST_CORNERS, 2)), np.zeros(3)
    column, row = int(floor((px - x_min) / cell)), int(floor((py - y_min) / cell))
    more = int(reach / cell) + 1
    for i in range(max(0, row - more), min(rows, row + more + 1)):
        for j in range(max(0, column - more), min(columns, column + more + 1)):
            pose[0], pose[1] = x_min + (j + 0.5) * cell, y_min + (i + 0.5) * cell
            if point_distance(px, py, pose[0], pose[1]) > reach:
                continue
            for k in range(FITTING):
                pose[2] = 2.0 * pi * k / FITTING
                if keeps_clear(own, spaces, pose, own[0].margin, corner):
                    fits[i, j] = True
                    break
