"""Ways over poses made shorter: the cheapest chain of shortest curves between them."""

from __future__ import annotations

from math import hypot

import numpy as np

from mrmg.compilation import borrowed, kernel
from mrmg.planning.path_following._curve_kernels import (
    PARTS,
    PIECES,
    parts_cost,
    write_curve,
    write_parts,
)
from mrmg.planning.path_following._pose_kernels import tight_cost
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS

FARTHEST = 64
"""Arcs of a way that one curve takes the place of, at most: ways of small robots have
nearly a thousand, and chains of shorter curves cost hardly more."""


@kernel
def shortest_way(search, pose, stop, kept):
    """Return (way, stop): the cheapest chain of curves between poses of a way.

    Targets and gates stay where they are; each curve is the shortest between its ends.

    Args:
        search: what was searched for.
        pose: the way, shape (n, 3).
        stop: numbers of its poses at targets, shape (S,).
        kept: whether a pose stays where it is, shape (n,).

    Returns:
        Its (x, y, heading, gear) at the ends of pieces, shape (m, 4), and the numbers
        of those at targets.
    """
    search = borrowed(search)
    n, corner = len(pose), np.empty((MOST_CORNERS, 2))
    curve = np.empty((PIECES * (n + PARTS), 4))
    parts, turn = np.empty(PARTS), np.empty(PARTS)
    cost, before = np.full(n, np.inf), np.zeros(n, np.int64)
    cost[0], first = 0.0, 0
    keys = np.zeros(n, np.bool_)
    keys[::PIECES] = True
    keys |= kept
    for j in range(1, n):
        first = j - 1 if kept[j - 1] else first
        for i in range(max(first, j - FARTHEST * PIECES), j):
            far = hypot(pose[j, 0] - pose[i, 0], pose[j, 1] - pose[i, 1])
            if not (keys[i] and keys[j] and cost[i] + far < cost[j]):
                continue
            if not write_parts(search, pose[i], pose[j], parts, turn):
                continue
            more, _ = parts_cost(search, 0, parts, turn)
            if not cost[i] + more < cost[j]:
                continue
            count = write_curve(search, pose[i], parts, turn, curve)
            if count >= 0:
                more += tight_cost(search, curve[:count], 0, corner)
                if cost[i] + more < cost[j]:
                    cost[j], before[j] = cost[i] + more, i
    chain, m, size, j = np.zeros(n, np.int64), 0, 1, n - 1  # last curve first
    while j > 0:
        write_parts(search, pose[before[j]], pose[j], parts, turn)
        size += write_curve(search, pose[before[j]], parts, turn, curve)
        chain[m], m, j = j, m + 1, before[j]
    way, there = np.empty((size, 4)), np.zeros(len(stop), np.int64)
    way[0, :3], way[0, 3], size = pose[0], 0.0, 1
    for j in chain[:m][::-1]:
        write_parts(search, pose[before[j]], pose[j], parts, turn)
        count = write_curve(search, pose[before[j]], parts, turn, curve)
        way[size : size + count] = curve[:count]
        size += count
        there[stop == j] = size - 1
    return way, there
