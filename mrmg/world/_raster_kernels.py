"""Compiled preparation of a free space: cells in obstacles, distances of cells."""

from __future__ import annotations

from math import ceil, floor, log2, sqrt

import numpy as np

from mrmg.compilation import kernel
from mrmg.world._polygon_kernels import point_segment_distance


@kernel
def cells_inside(edge, x_min, y_min, cell, rows, columns):
    """Return which cell centres lie inside closed rings, by the even-odd rule.

    Args:
        edge: their edges, shape (n, 4).
        x_min, y_min, cell: corner of the grid, and side of a cell.
        rows, columns: number of cells.
    """
    inside = np.zeros((rows, columns), np.bool_)
    crossing = np.zeros(len(edge), np.float64)
    for row in range(rows):
        y = y_min + (row + 0.5) * cell
        n = 0
        for x0, y0, x1, y1 in edge:
            if (y0 <= y) != (y1 <= y):
                crossing[n] = x0 + (y - y0) / (y1 - y0) * (x1 - x0)
                n += 1
        crossing[:n].sort()
        for pair in range(0, n - 1, 2):
            low = int(ceil((crossing[pair] - x_min) / cell - 0.5))
            high = int(floor((crossing[pair + 1] - x_min) / cell - 0.5))
            for column in range(max(low, 0), min(high, columns - 1) + 1):
                inside[row, column] = True
    return inside


@kernel
def edge_distance_field(edge, x_min, y_min, cell, rows, columns):
    """Return the distance of each cell centre from the nearest edge [m].

    Squares are quartered down to cells, depth first. An edge farther from a square's
    centre than the nearest one by more than its diagonal is nearest nowhere in it.
    """
    levels = 1 + int(ceil(log2(max(rows, columns))))
    distance = np.empty((rows, columns))
    near = np.empty((levels + 1, len(edge)), np.int64)  # by level, of the last square
    count = np.zeros(levels + 1, np.int64)
    away2 = np.empty(len(edge))
    way = np.empty((len(edge), 3))  # dx, dy and the inverse of the squared length
    for e in range(len(edge)):
        near[0, e] = e
        dx, dy = edge[e, 2] - edge[e, 0], edge[e, 3] - edge[e, 1]
        length2 = dx * dx + dy * dy
        way[e, 0], way[e, 1] = dx, dy
        way[e, 2] = 1.0 / length2 if length2 > 0.0 else 0.0
    count[0] = len(edge)
    square = np.zeros((3 * levels + 1, 3), np.int64)  # level, row, column
    waiting = 1
    while waiting > 0:
        waiting -= 1
        level, row, column = square[waiting]
        size = 1 << (levels - 1 - level)
        if row * size >= rows or column * size >= columns:
            continue
        x = x_min + (column + 0.5) * size * cell
        y = y_min + (row + 0.5) * size * cell
        least2 = np.inf
        for i in range(count[level]):
            e = near[level, i]
            px, py = x - edge[e, 0], y - edge[e, 1]
            t = min(1.0, max(0.0, (px * way[e, 0] + py * way[e, 1]) * way[e, 2]))
            px, py = px - t * way[e, 0], py - t * way[e, 1]
            away2[i] = px * px + py * py
            least2 = min(least2, away2[i])
        if size == 1:
            distance[row, column] = sqrt(least2)
            continue
        count[level + 1] = 0
        farthest = sqrt(least2) + sqrt(2.0) * size * cell
        for i in range(count[level]):
            if away2[i] <= farthest * farthest:
                near[level + 1, count[level + 1]] = near[level, i]
                count[level + 1] += 1
        for quarter in range(4):
            square[waiting, 0] = level + 1
            square[waiting, 1] = 2 * row + quarter // 2
            square[waiting, 2] = 2 * column + quarter % 2
            waiting += 1
    return distance


@kernel
def buckets_near(edge, x_min, y_min, side, rows, columns, reach):
    """Return (edge, bucket) for all edges that are near to the centre of a bucket.

    Args:
        edge: shape (n, 4).
        x_min, y_min, side: corner of the grid of buckets, and side of one.
        rows, columns: number of buckets.
        reach: distance from the centre within which edges are near.
    """
    found = [(0, 0)]
    for e in range(len(edge)):
        x0, y0, x1, y1 = edge[e, 0], edge[e, 1], edge[e, 2], edge[e, 3]
        left = max(0, int((min(x0, x1) - reach - x_min) / side))
        right = min(columns - 1, int((max(x0, x1) + reach - x_min) / side))
        low = max(0, int((min(y0, y1) - reach - y_min) / side))
        high = min(rows - 1, int((max(y0, y1) + reach - y_min) / side))
        for row in range(low, high + 1):
            for column in range(left, right + 1):
                x, y = x_min + (column + 0.5) * side, y_min + (row + 0.5) * side
                if point_segment_distance(x, y, x0, y0, x1, y1) <= reach:
                    found.append((e, row * columns + column))
    return np.array(found[1:])
