"""Compiled preparation of a free space: edges in buckets, distances in cells.

What `_kernels` asks, this module lays out.
"""

from __future__ import annotations

from math import ceil, floor, hypot, sqrt

import numpy as np

from mrmg.compilation import kernel, leaf_kernel
from mrmg.world._kernels import point_segment_distance


@kernel
def bucket_edges(edge, x_min, y_min, bucket, columns, rows, reach):
    """Return (bucket_start, bucket_edge): for each bucket the edges within `reach`."""
    count = np.zeros(columns * rows + 1, np.int64)
    half = 0.5 * bucket * sqrt(2.0)
    for sweep in range(2):
        if sweep == 1:
            start = np.zeros(columns * rows + 1, np.int64)
            for b in range(columns * rows):
                start[b + 1] = start[b] + count[b]
            index = np.zeros(start[-1], np.int64)
            fill = start.copy()
        for e in range(len(edge)):
            x0 = min(edge[e, 0], edge[e, 2]) - reach - x_min
            x1 = max(edge[e, 0], edge[e, 2]) + reach - x_min
            y0 = min(edge[e, 1], edge[e, 3]) - reach - y_min
            y1 = max(edge[e, 1], edge[e, 3]) + reach - y_min
            for row in range(
                max(0, int(floor(y0 / bucket))), min(rows, int(floor(y1 / bucket)) + 1)
            ):
                for column in range(
                    max(0, int(floor(x0 / bucket))),
                    min(columns, int(floor(x1 / bucket)) + 1),
                ):
                    cx = x_min + (column + 0.5) * bucket
                    cy = y_min + (row + 0.5) * bucket
                    d = point_segment_distance(
                        cx, cy, edge[e, 0], edge[e, 1], edge[e, 2], edge[e, 3]
                    )
                    if d <= reach + half:
                        b = row * columns + column
                        if sweep == 0:
                            count[b] += 1
                        else:
                            index[fill[b]] = e
                            fill[b] += 1
    return start, index


@kernel
def fill_rings(ring_start, point, x_min, y_min, cell, rows, columns):
    """Return which cell centres lie inside the rings, by the even-odd rule."""
    inside = np.zeros((rows, columns), np.bool_)
    crossing = np.zeros(len(point), np.float64)
    for row in range(rows):
        y = y_min + (row + 0.5) * cell
        n = 0
        for ring in range(len(ring_start) - 1):
            first, last = ring_start[ring], ring_start[ring + 1]
            for i in range(first, last):
                j = i + 1 if i + 1 < last else first
                y0, y1 = point[i, 1], point[j, 1]
                if (y0 <= y) != (y1 <= y):
                    t = (y - y0) / (y1 - y0)
                    crossing[n] = point[i, 0] + t * (point[j, 0] - point[i, 0])
                    n += 1
        _sort(crossing[:n])
        for pair in range(0, n - 1, 2):
            low = int(ceil((crossing[pair] - x_min) / cell - 0.5))
            high = int(floor((crossing[pair + 1] - x_min) / cell - 0.5))
            for column in range(max(low, 0), min(high, columns - 1) + 1):
                inside[row, column] = True
    return inside


@leaf_kernel
def _sort(values):
    """Put a few values in order."""
    for i in range(1, len(values)):
        value = values[i]
        place = i
        while place > 0 and values[place - 1] > value:
            values[place] = values[place - 1]
            place -= 1
        values[place] = value


@kernel
def edge_distance_field(edge, x_min, y_min, cell, rows, columns):
    """Return the distance of each cell centre from the nearest edge [m].

    Cells crossed by an edge know it exactly; one sweep up and one down (rows there and
    back; Danielsson 1980) hand the index of the nearest edge on to the neighbours,
    which measure their own distance from it.
    Where many edges crowd, the nearest one may not get through: centimetres too far.
    """
    grid = (x_min, y_min, cell)
    nearest = np.full((rows, columns), -1, np.int64)
    distance = np.full((rows, columns), np.inf)
    for e in range(len(edge)):
        length = hypot(edge[e, 2] - edge[e, 0], edge[e, 3] - edge[e, 1])
        n = int(ceil(length / (0.5 * cell))) + 1
        for i in range(n + 1):
            t = i / n
            x = edge[e, 0] + t * (edge[e, 2] - edge[e, 0])
            y = edge[e, 1] + t * (edge[e, 3] - edge[e, 1])
            c0 = int(floor((x - x_min) / cell))
            r0 = int(floor((y - y_min) / cell))
            for r in range(max(0, r0 - 1), min(rows, r0 + 2)):
                for c in range(max(0, c0 - 1), min(columns, c0 + 2)):
                    _offer(edge, e, r, c, x_min, y_min, cell, nearest, distance)
    for sweep in range(2):
        ahead = 1 if sweep == 0 else -1
        for i in range(rows):
            r = i if sweep == 0 else rows - 1 - i
            for j in range(columns):
                c = j if sweep == 0 else columns - 1 - j
                for dc in range(-1, 2):
                    _hand_on(edge, r - ahead, c + dc, r, c, grid, nearest, distance)
                _hand_on(edge, r, c - ahead, r, c, grid, nearest, distance)
            for j in range(columns):
                c = columns - 1 - j if sweep == 0 else j
                _hand_on(edge, r, c + ahead, r, c, grid, nearest, distance)
    return distance


@leaf_kernel
def _hand_on(edge, from_row, from_column, r, c, grid, nearest, distance):
    """Offer a cell the edge its neighbour is nearest to."""
    rows, columns = distance.shape
    if 0 <= from_row < rows and 0 <= from_column < columns:
        e = nearest[from_row, from_column]
        if e >= 0 and e != nearest[r, c]:
            x_min, y_min, cell = grid
            _offer(edge, e, r, c, x_min, y_min, cell, nearest, distance)


@leaf_kernel
def _offer(edge, e, r, c, x_min, y_min, cell, nearest, distance):
    d = point_segment_distance(
        x_min + (c + 0.5) * cell,
        y_min + (r + 0.5) * cell,
        edge[e, 0],
        edge[e, 1],
        edge[e, 2],
        edge[e, 3],
    )
    if d < distance[r, c]:
        distance[r, c] = d
        nearest[r, c] = e


@leaf_kernel
def correct_near(
    distance, edge, bucket_start, bucket_edge, x_min, y_min, cell, bucket, columns
):
    """Make the distances of cells within reach of their bucket's edges exact.

    Args:
        distance: distance of each cell centre from the nearest edge [m], changed in
            place, shape (ny, nx).
        edge: (x0, y0, x1, y1) [m], shape (n, 4).
        bucket_start: first edge of each bucket.
        bucket_edge: indices of the edges within reach of each bucket.
        x_min: left side of all grids [m].
        y_min: lower side of them [m].
        cell: side of a cell [m].
        bucket: side of a bucket, a multiple of the cell's [m].
        columns: number of buckets in a row.
    """
    for row in range(distance.shape[0]):
        y = y_min + (row + 0.5) * cell
        for column in range(distance.shape[1]):
            x = x_min + (column + 0.5) * cell
            b = int((y - y_min) / bucket) * columns + int((x - x_min) / bucket)
            for i in range(bucket_start[b], bucket_start[b + 1]):
                e = bucket_edge[i]
                d = point_segment_distance(
                    x, y, edge[e, 0], edge[e, 1], edge[e, 2], edge[e, 3]
                )
                distance[row, column] = min(distance[row, column], d)
