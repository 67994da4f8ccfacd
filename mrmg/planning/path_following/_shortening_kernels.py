"""Ways over poses made shorter: the cheapest chain of shortest curves between them."""

from __future__ import annotations

from math import atan2, ceil, cos, hypot, pi, sin

import numpy as np

from mrmg.compilation import borrowed, kernel
from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.path_following._pose_kernels import PIECES, is_free
from mrmg.planning.path_following.coordination._reeds_shepp_kernels import (
    MOST_PIECES,
    reeds_shepp,
)
from mrmg.planning.problem._control_kernels import wrap
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS

SHORTEST_M = 1e-3
"""Length below which a curve has no such part."""


@kernel
def write_turns(search, a, b, curve):
    """Write the turn, the straight way and the turn from one pose to another.

    Arguments and what is returned are those of `write_curve`; turns take no way.
    """
    dx, dy = b[0] - a[0], b[1] - a[1]
    far = hypot(dx, dy)
    ahead, gear = (atan2(dy, dx) if far > SHORTEST_M else b[2]), 1.0
    first, last = wrap(ahead - a[2]), wrap(b[2] - ahead)
    if search.own[0].limit[0] < 0.0 and abs(first) + abs(last) > pi:
        gear, first, last = -1.0, wrap(first + pi), wrap(last + pi)
    step = 2.0 * pi / search.headings / PIECES
    sizes = abs(first) / step, far * PIECES / search.length, abs(last) / step
    if not sizes[0] + sizes[1] + sizes[2] < len(curve) - MOST_PIECES:
        return 0, np.inf
    x, y, theta, n = a[0], a[1], a[2], 0
    for p in range(MOST_PIECES):
        pieces = int(ceil(sizes[p] - 1e-9))
        for _ in range(pieces):
            if p == 1:
                x, y = x + dx / pieces, y + dy / pieces
            else:
                theta += (first if p == 0 else last) / pieces
            curve[n, 0], curve[n, 1], curve[n, 2], curve[n, 3] = x, y, theta, gear
            n += 1
    return n, far + search.scrub * (abs(first) + abs(last))


@kernel
def write_curve(search, a, b, curve):
    """Write the shortest curve from one pose to another, piece by piece.

    Args:
        search: gives the robot and the curvature of its turns.
        a, b: poses, shape (3,).
        curve: receives (x, y, heading, gear) at the ends of pieces, shape (n, 4).

    Returns:
        (number of them, cost [m of plain ground]); (0, inf) if there is no room.
    """
    if search.own[0].model == UNICYCLE:
        return write_turns(search, a, b, curve)
    turn, length = np.zeros(MOST_PIECES), np.zeros(MOST_PIECES)
    radius = 1.0 / search.bend
    dx, dy, reverses = b[0] - a[0], b[1] - a[1], search.own[0].limit[0] < 0.0
    total = reeds_shepp(dx, dy, a[2], b[2], radius, reverses, turn, length)
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
        Its (x, y, heading, gear) at the ends of pieces, shape (m, 4), and the numbers
        of those at targets.
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
    chain, m, size, j = np.zeros(n, np.int64), 0, 1, n - 1  # last curve first
    while j > 0:
        size += write_curve(search, pose[before[j]], pose[j], curve)[0]
        chain[m], m, j = j, m + 1, before[j]
    way, there = np.empty((size, 4)), np.zeros(len(stop), np.int64)
    way[0, :3], way[0, 3], size = pose[0], 0.0, 1
    for j in chain[:m][::-1]:
        count, _ = write_curve(search, pose[before[j]], pose[j], curve)
        way[size : size + count] = curve[:count]
        size += count
        there[stop == j] = size - 1
    return way, there
