"""Cost-to-go over a grid: what a point robot's shortest way to a target takes."""

from __future__ import annotations

from math import floor, sqrt

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.roadmap._heap_kernels import pop, push


@kernel
def cost_to_go(free, price, row, column):
    """Return the cost from each cell to one of them, in sides of a cell (Dijkstra).

    Args:
        free: whether a cell may be passed, shape (ny, nx).
        price: cost of a cell's side, shape (ny, nx).
        row, column: of the cell to reach; it counts as free.

    Returns:
        Shape (ny, nx); inf where the cell cannot be reached from.
    """
    rows, columns = free.shape
    cost = np.full((rows, columns), np.inf)
    room = 8 * rows * columns + 8
    key, entry = np.empty(room), np.empty(room, np.int64)
    cost[row, column] = 0.0
    size = push(key, entry, 0, 0.0, row * columns + column)
    diagonal = sqrt(2.0)
    while size > 0:
        value, node = key[0], entry[0]
        size = pop(key, entry, size)
        i, j = node // columns, node % columns
        if value > cost[i, j]:
            continue
        for di in range(-1, 2):
            for dj in range(-1, 2):
                a, b = i + di, j + dj
                if a < 0 or b < 0 or a >= rows or b >= columns or not free[a, b]:
                    continue
                way = diagonal if di != 0 and dj != 0 else 1.0
                there = value + 0.5 * way * (price[i, j] + price[a, b])
                if there < cost[a, b]:
                    cost[a, b] = there
                    size = push(key, entry, size, there, a * columns + b)
    return cost


@kernel
def field_at(field, f, x_min, y_min, cell, x, y):
    """Return field f at a point: bilinear, of the cells around it that have a value."""
    rows, columns = field.shape[1], field.shape[2]
    fx, fy = (x - x_min) / cell - 0.5, (y - y_min) / cell - 0.5
    column = min(max(int(floor(fx)), 0), columns - 1)
    row = min(max(int(floor(fy)), 0), rows - 1)
    u, v = min(1.0, max(0.0, fx - column)), min(1.0, max(0.0, fy - row))
    total = weight = 0.0
    for i in range(2):
        for j in range(2):
            value = field[f, min(row + i, rows - 1), min(column + j, columns - 1)]
            share = (v if i else 1.0 - v) * (u if j else 1.0 - u)
            if value < np.inf and share > 0.0:
                total += share * value
                weight += share
    return total / weight if weight > 0.0 else np.inf
