"""Points sorted into the squares of a coarse grid, and the nearest of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel


class Buckets(NamedTuple):
    """Points by the squares that they lie in.

    Attributes:
        x_min, y_min: corner of the first square [m].
        side: of a square [m].
        columns, rows: number of squares.
        start: first member of each square, row by row, and their number, (B + 1,).
        member: numbers of the points.
    """

    x_min: float
    y_min: float
    side: float
    columns: int
    rows: int
    start: np.ndarray
    member: np.ndarray


@kernel
def bucket_of(buckets, x, y):
    """Return (column, row) of the square that holds a point, or of the nearest one."""
    column = int((x - buckets.x_min) / buckets.side)
    row = int((y - buckets.y_min) / buckets.side)
    return min(max(column, 0), buckets.columns - 1), min(max(row, 0), buckets.rows - 1)


@kernel
def nearest_points(buckets, point, usable, x, y, nearest, square):
    """Write the nearest usable points; return their number.

    Rings of squares are searched outwards. What lies in further rings is at least as
    far as the rest of the point's own square and the rings so far are wide.

    Args:
        buckets: of the points.
        point: positions, shape (V, 2).
        usable: which of them count, shape (V,).
        x, y: what they are near to.
        nearest: receives numbers, nearest first, of equally near ones the least, (K,).
        square: receives their squared distances, shape (K,).
    """
    side, columns = buckets.side, buckets.columns
    column, row = bucket_of(buckets, x, y)
    u, v = x - buckets.x_min - column * side, y - buckets.y_min - row * side
    margin = max(0.0, min(min(u, side - u), min(v, side - v)))
    found = 0
    for ring in range(max(buckets.rows, columns)):
        for i in range(max(0, row - ring), min(buckets.rows, row + ring + 1)):
            step = 1 if abs(i - row) == ring else 2 * ring
            for j in range(column - ring, column + ring + 1, step):
                if j < 0 or j >= columns:
                    continue
                b = i * columns + j
                for k in range(buckets.start[b], buckets.start[b + 1]):
                    if usable[buckets.member[k]]:
                        found = _insert(
                            point, buckets.member[k], x, y, nearest, square, found
                        )
        sure = (1.0 - 1e-9) * (margin + ring * side)
        if found == len(nearest) and square[found - 1] < sure * sure:
            break
    return found


@kernel
def _insert(point, other, x, y, nearest, square, found):
    """Insert a point among the nearest, if it is one of them; return their number."""
    dx, dy = point[other, 0] - x, point[other, 1] - y
    away = dx * dx + dy * dy
    at = found
    while at > 0 and (
        away < square[at - 1] or (away == square[at - 1] and other < nearest[at - 1])
    ):
        at -= 1
    if at == len(square):
        return found
    last = min(found, len(square) - 1)
    for k in range(last, at, -1):
        square[k], nearest[k] = square[k - 1], nearest[k - 1]
    square[at], nearest[at] = away, other
    return last + 1


@kernel
def nearest_vertices(buckets, vertex, count):
    """Return each vertex's nearest others, in order; of equally near ones the first.

    Args:
        buckets: of the vertices.
        vertex: positions, shape (V, 2).
        count: number of neighbours, from 1 to V - 1.

    Returns:
        Shape (V, count).
    """
    nearest = np.empty((len(vertex), count), np.int64)
    square = np.empty(count)
    others = np.ones(len(vertex), np.bool_)
    for v in range(len(vertex)):
        others[v] = False
        x, y = vertex[v, 0], vertex[v, 1]
        nearest_points(buckets, vertex, others, x, y, nearest[v], square)
        others[v] = True
    return nearest
