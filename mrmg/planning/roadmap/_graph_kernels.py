"""Compiled parts of the roadmap as a graph: neighbours, cheapest ways, parts."""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np

from mrmg.compilation import kernel, leaf_kernel
from mrmg.planning.roadmap._heap_kernels import pop, push

CROWD = 3
"""Vertices in a bucket of the search for neighbours, about."""


@kernel
def nearest_vertices(vertex, count):
    """Return each vertex's nearest others, in order; of equally near ones the first.

    Args:
        vertex: positions, shape (V, 2).
        count: number of neighbours, less than V.

    Returns:
        Shape (V, count).
    """
    n = len(vertex)
    nearest = np.empty((n, count), np.int64)
    if count == 0:
        return nearest
    x_min, x_max = _extremes(vertex[:, 0])
    y_min, y_max = _extremes(vertex[:, 1])
    extent = max(x_max - x_min, y_max - y_min)
    side = extent / ceil(sqrt(n / CROWD)) if extent > 0.0 else 1.0
    columns = int((x_max - x_min) / side) + 1
    rows = int((y_max - y_min) / side) + 1
    bucket = np.empty(n, np.int64)
    start = np.zeros(rows * columns + 1, np.int64)
    for v in range(n):
        column = int((vertex[v, 0] - x_min) / side)
        bucket[v] = int((vertex[v, 1] - y_min) / side) * columns + column
        start[bucket[v] + 1] += 1
    _add_up(start)
    member = np.empty(n, np.int64)
    filled = start[:-1].copy()
    for v in range(n):
        member[filled[bucket[v]]] = v
        filled[bucket[v]] += 1
    square = np.empty(count)
    for v in range(n):
        column, row = bucket[v] % columns, bucket[v] // columns
        x, y = vertex[v, 0] - x_min - column * side, vertex[v, 1] - y_min - row * side
        margin = max(0.0, min(min(x, side - x), min(y, side - y)))
        found = 0
        ring = 0
        while True:
            for i in range(max(0, row - ring), min(rows, row + ring + 1)):
                whole = abs(i - row) == ring
                for j in range(max(0, column - ring), min(columns, column + ring + 1)):
                    if not whole and abs(j - column) != ring:
                        continue
                    for k in range(start[i * columns + j], start[i * columns + j + 1]):
                        if member[k] != v:
                            found = _insert(
                                vertex, v, member[k], nearest, square, found
                            )
            # What lies in further rings is farther than that.
            sure = (1.0 - 1e-9) * (margin + ring * side)
            if found == count and square[count - 1] < sure * sure:
                break
            ring += 1
            if ring > max(rows, columns):
                break
    return nearest


@leaf_kernel
def _insert(vertex, v, other, nearest, square, found):
    """Insert a vertex among the nearest of v, if it is; return their number."""
    x, y = vertex[other, 0] - vertex[v, 0], vertex[other, 1] - vertex[v, 1]
    away = x * x + y * y
    at = found
    while at > 0 and (
        away < square[at - 1] or (away == square[at - 1] and other < nearest[v, at - 1])
    ):
        at -= 1
    if at == len(square):
        return found
    last = min(found, len(square) - 1)
    for k in range(last, at, -1):
        square[k], nearest[v, k] = square[k - 1], nearest[v, k - 1]
    square[at], nearest[v, at] = away, other
    return last + 1


@kernel
def cheapest_ways(vertices, low, high, cost, entry, entry_start):
    """Return each target's cost and successor for all vertices: Dijkstra, backwards.

    Args:
        vertices: their number V.
        low, high: ends of edges, shape (E,).
        cost: of edges from low to high and back, at least 0, shape (E, 2).
        entry: vertices at which targets are entered, those of the first target first.
        entry_start: first entry of each target, and the number of all, shape (T + 1,).

    Returns:
        (cost, successor), shape (T, V): inf and -1 where there is no way; the successor
        of an entry is -1.
    """
    start, edge = _edges_by_vertex(vertices, low, high)
    targets = len(entry_start) - 1
    total = np.full((targets, vertices), np.inf)
    successor = np.full((targets, vertices), -1, np.int32)
    key = np.empty(2 * len(low) + len(entry) + 1)
    waiting = np.empty(len(key), np.int32)
    done = np.empty(vertices, np.bool_)
    for t in range(targets):
        done[:] = False
        size = 0
        for v in entry[entry_start[t] : entry_start[t + 1]]:
            total[t, v] = 0.0
            size = push(key, waiting, size, 0.0, v)
        while size > 0:
            v = waiting[0]
            size = pop(key, waiting, size)
            if done[v]:
                continue
            done[v] = True
            for k in range(start[v], start[v + 1]):
                e = edge[k]
                back = low[e] == v
                u = high[e] if back else low[e]
                over = total[t, v] + cost[e, 1 if back else 0]
                if over < total[t, u]:
                    total[t, u] = over
                    successor[t, u] = v
                    size = push(key, waiting, size, over, u)
    return total, successor


@leaf_kernel
def _extremes(values):
    """Return the least and the greatest of values."""
    low = high = values[0]
    for value in values:
        low, high = min(low, value), max(high, value)
    return low, high


@leaf_kernel
def _add_up(values):
    """Add to each of values all before it."""
    for i in range(1, len(values)):
        values[i] += values[i - 1]


@kernel
def _edges_by_vertex(vertices, low, high):
    """Return the first of each vertex's edges in a list, shape (V + 1,), and that."""
    start = np.zeros(vertices + 1, np.int64)
    for e in range(len(low)):
        start[low[e] + 1] += 1
        start[high[e] + 1] += 1
    _add_up(start)
    edge = np.empty(2 * len(low), np.int64)
    filled = start[:-1].copy()
    for e in range(len(low)):
        for v in (low[e], high[e]):
            edge[filled[v]] = e
            filled[v] += 1
    return start, edge


@kernel
def parts(vertices, low, high):
    """Return for each vertex the least one that edges (low, high) join it to, (V,)."""
    least = np.arange(vertices)
    for e in range(len(low)):
        first, second = low[e], high[e]
        while least[first] != first:
            first = least[first]
        while least[second] != second:
            second = least[second]
        joined = min(first, second)
        least[first] = least[second] = joined
        least[low[e]] = least[high[e]] = joined
    for v in range(vertices):
        least[v] = least[least[v]]
    return least
