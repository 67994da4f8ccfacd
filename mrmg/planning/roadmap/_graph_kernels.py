"""Compiled parts of the roadmap as a graph: neighbours, cheapest paths, parts."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.roadmap._bucket_kernels import nearest_points
from mrmg.planning.roadmap._heap_kernels import pop, push


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


@kernel
def cheapest_paths(low, high, cost, start, edge, entry, entry_start):
    """Return each target's cost and successor for all vertices: Dijkstra, backwards.

    Args:
        low, high: ends of edges, shape (E,).
        cost: of edges from low to high and back, at least 0, shape (E, 2).
        start: first of each vertex's edges, and the number of all, shape (V + 1,).
        edge: each vertex's edges, shape (2 E,).
        entry: vertices at which targets are entered, those of the first target first.
        entry_start: first entry of each target, and the number of all, shape (T + 1,).

    Returns:
        (cost, successor), shape (T, V): inf and -1 where there is no way; the successor
        of an entry is -1.
    """
    vertices, targets = len(start) - 1, len(entry_start) - 1
    total = np.full((targets, vertices), np.inf)
    successor = np.full((targets, vertices), -1, np.int32)
    key = np.empty(2 * len(low) + len(entry) + 1)
    waiting = np.empty(len(key), np.int32)
    # Neighbours, and the costs from there, side by side: memory is read in order.
    neighbour, price = np.empty(len(edge), np.int32), np.empty(len(edge))
    for v in range(vertices):
        for k in range(start[v], start[v + 1]):
            e = edge[k]
            back = low[e] == v
            neighbour[k] = high[e] if back else low[e]
            price[k] = cost[e, 1 if back else 0]
    for t in range(targets):
        own, after = total[t], successor[t]
        size = 0
        for v in entry[entry_start[t] : entry_start[t + 1]]:
            own[v] = 0.0
            size = push(key, waiting, size, 0.0, v)
        while size > 0:
            value, v = key[0], waiting[0]
            size = pop(key, waiting, size)
            if value > own[v]:
                continue
            for k in range(start[v], start[v + 1]):
                over, u = value + price[k], neighbour[k]
                if over < own[u]:
                    own[u] = over
                    after[u] = v
                    size = push(key, waiting, size, over, u)
    return total, successor


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
