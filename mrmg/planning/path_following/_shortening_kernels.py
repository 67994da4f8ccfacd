"""Ways over poses made shorter: the cheapest chain of shortest curves between them."""

from __future__ import annotations

from math import ceil, cos, sin

import numpy as np

from mrmg.compilation import borrowed, kernel
from mrmg.planning.path_following._pose_kernels import PIECES, is_free
from mrmg.planning.path_following.coordination._reeds_shepp_kernels import (
    MOST_PIECES,
    reeds_shepp,
)
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS

SHORTEST_M = 1e-3
"""Length below which a curve has no such part."""


@kernel
def write_curve(search, a, b, curve):
    """Write the shortest curve from one pose to another, piece by piece.

    Args:
        search: gives the curvature of turns.
        a, b: poses, shape (3,).
        curve: receives (x, y, heading, gear) at the ends of pieces, shape (n, 4).

    Returns:
        (number of them, cost [m of plain ground]); (0, inf) if there is no room.
    """
    turn, length = np.zeros(MOST_PIECES), np.zeros(MOST_PIECES)
    radius = 1.0 / search.bend
    total = reeds_shepp(b[0] - a[0], b[1] - a[1], a[2], b[2], radius, turn, length)
    if not total < search.length * (len(curve) / PIECES - MOST_PIECES):
        return 0, np.inf
    x, y, theta = a[0], a[1], a[2]
    n, cost, last = 0, total, 0.0
    for p in range(MOST_PIECES):
        if abs(length[p]) < SHORTEST_M:
            continue
        gear = 1.0 if length[p] > 0.0 else -1.0
        cost += search.scrub * search.bend * abs(length[p] * turn[p])
        cost += search.change if gear * last < 0.0 else 0.0
        last = gear
        pieces = int(ceil(abs(length[p]) * PIECES / search.length))
        way = length[p] / pieces
        swing = 0.5 * abs(way) * turn[p] * gear / radius
        chord = way * (sin(swing) / swing if abs(swing) > 1e-9 else 1.0)
        for _ in range(pieces):
            x += chord * cos(theta + swing)
            y += chord * sin(theta + swing)
            theta += 2.0 * swing
            curve[n, 0], curve[n, 1], curve[n, 2], curve[n, 3] = x, y, theta, gear
            n += 1
    return n, cost


@kernel
def shortest_way(search, pose, stop):
    """Return (way, stop): the cheapest chain of curves between poses of a way.

    Targets stay where they are; each curve is the shortest between its ends.

    Args:
        search: what was searched for.
        pose: the way, shape (n, 3).
        stop: numbers of its poses at targets, shape (S,).

    Returns:
        Its (x, y, gear) at the ends of pieces, shape (m, 3), and the numbers of those
        at targets.
    """
    search = borrowed(search)
    n, corner = len(pose), np.empty((MOST_CORNERS, 2))
    curve = np.empty((PIECES * (n + MOST_PIECES + 1), 4))
    cost, before, leg = np.full(n, np.inf), np.zeros(n, np.int64), 0
    cost[0], first = 0.0, 0
    keys = np.zeros(n, np.bool_)
    keys[::PIECES] = True
    keys[stop] = True
    for j in range(1, n):
        while leg < len(stop) and stop[leg] < j:
            first, leg = stop[leg], leg + 1
        for i in range(first, j):
            if not (keys[i] and keys[j] and cost[i] < cost[j]):
                continue
            count, more = write_curve(search, pose[i], pose[j], curve)
            if cost[i] + more < cost[j] and is_free(search, leg, curve[:count], corner):
                cost[j], before[j] = cost[i] + more, i
    # The chain, last curve first, then its pieces in order.
    chain, m = np.zeros(n, np.int64), 0
    j = n - 1
    while j > 0:
        chain[m], m = j, m + 1
        j = before[j]
    way, size = np.empty((4 * PIECES * (n + MOST_PIECES), 3)), 1
    way[0, 0], way[0, 1], way[0, 2] = pose[0, 0], pose[0, 1], 0.0
    there = np.zeros(len(stop), np.int64)
    for k in range(m - 1, -1, -1):
        j = chain[k]
        count, _ = write_curve(search, pose[before[j]], pose[j], curve)
        for i in range(count):
            way[size, 0], way[size, 1] = curve[i, 0], curve[i, 1]
            way[size, 2] = curve[i, 3]
            size += 1
        there[stop == j] = size - 1
    return way[:size].copy(), there
