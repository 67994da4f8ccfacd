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

FARTHEST = 64
"""Arcs of a way that one curve takes the place of, at most: ways of small robots have
nearly a thousand, and chains of shorter curves cost hardly more."""


@kernel
def straight_parts(search, a, b, way, turn):
    """Write the turn, the straight way and the turn from one pose to another.

    Arguments and what is returned are those of `arc_parts`.
    """
    dx, dy = b[0] - a[0], b[1] - a[1]
    far = hypot(dx, dy)
    ahead = atan2(dy, dx) if far > SHORTEST_M else b[2]
    first, last = wrap(ahead - a[2]), wrap(b[2] - ahead)
    if search.own[0].limit[0] < 0.0 and abs(first) + abs(last) > pi:
        far, first, last = -far, wrap(first + pi), wrap(last + pi)
    way[1], turn[0], turn[2] = far, first, last
    return abs(far) + search.scrub * (abs(first) + abs(last))


@kernel
def arc_parts(search, a, b, way, turn):
    """Write the parts of the shortest curve of a car; return its cost, inf if none.

    Args:
        search: gives the robot and the curvature of its turns.
        a, b: poses, shape (3,).
        way: receives the length of each part, negative backwards [m], shape (n,).
        turn: receives how far it turns there [rad], shape (n,).
    """
    dx, dy, reverses = b[0] - a[0], b[1] - a[1], search.own[0].limit[0] < 0.0
    radius, last = 1.0 / search.bend, 0.0
    cost = reeds_shepp(dx, dy, a[2], b[2], radius, reverses, turn, way)
    for p in range(MOST_PIECES):
        if abs(way[p]) < SHORTEST_M:
            way[p] = 0.0
        turn[p] *= search.bend * way[p]
        cost += search.scrub * abs(turn[p])
        if way[p] != 0.0:
            cost += search.change if way[p] * last < 0.0 else 0.0
            last = way[p]
    return cost


@kernel
def curve_parts(search, a, b, way, turn):
    """Write the parts of the shortest curve from one pose to another.

    Arguments and what is returned are those of `arc_parts`.
    """
    if search.own[0].model == UNICYCLE:
        way[:], turn[:] = 0.0, 0.0
        return straight_parts(search, a, b, way, turn)
    return arc_parts(search, a, b, way, turn)


@kernel
def write_curve(search, a, way, turn, curve):
    """Write the curve of some parts from a pose on, piece by piece.

    Args:
        search: gives the length of pieces.
        a: pose, shape (3,).
        way, turn: length and turn of each part, as `curve_parts` writes them.
        curve: receives (x, y, heading, gear) at the ends of pieces, shape (n, 4).

    Returns:
        number of them; -1 if there is no room.
    """
    x, y, theta, n = a[0], a[1], a[2], 0
    for p in range(MOST_PIECES):
        turns = abs(turn[p]) * search.headings / (2.0 * pi)
        size = PIECES * max(abs(way[p]) / search.length, turns)
        if not n + size < len(curve) - 1:
            return -1
        pieces = int(ceil(size - 1e-9))
        for _ in range(pieces):
            swing = 0.5 * turn[p] / pieces
            chord = way[p] / pieces * (sin(swing) / swing if swing != 0.0 else 1.0)
            x += chord * cos(theta + swing)
            y += chord * sin(theta + swing)
            theta += 2.0 * swing
            curve[n, 0], curve[n, 1], curve[n, 2] = x, y, theta
            curve[n, 3] = 1.0 if way[p] > 0.0 else -1.0
            n += 1
    return n


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
    parts, turn = np.empty(MOST_PIECES), np.empty(MOST_PIECES)
    cost, before, leg = np.full(n, np.inf), np.zeros(n, np.int64), 0
    cost[0], first = 0.0, 0
    keys = np.zeros(n, np.bool_)
    keys[::PIECES] = True
    keys[stop] = True
    for j in range(1, n):
        while leg < len(stop) and stop[leg] < j:
            first, leg = stop[leg], leg + 1
        for i in range(max(first, j - FARTHEST * PIECES), j):
            far = hypot(pose[j, 0] - pose[i, 0], pose[j, 1] - pose[i, 1])
            if not (keys[i] and keys[j] and cost[i] + far < cost[j]):
                continue
            more = curve_parts(search, pose[i], pose[j], parts, turn)
            if not cost[i] + more < cost[j]:
                continue
            count = write_curve(search, pose[i], parts, turn, curve)
            if count >= 0 and is_free(search, leg, curve[:count], corner):
                cost[j], before[j] = cost[i] + more, i
    chain, m, size, j = np.zeros(n, np.int64), 0, 1, n - 1  # last curve first
    while j > 0:
        curve_parts(search, pose[before[j]], pose[j], parts, turn)
        size += write_curve(search, pose[before[j]], parts, turn, curve)
        chain[m], m, j = j, m + 1, before[j]
    way, there = np.empty((size, 4)), np.zeros(len(stop), np.int64)
    way[0, :3], way[0, 3], size = pose[0], 0.0, 1
    for j in chain[:m][::-1]:
        curve_parts(search, pose[before[j]], pose[j], parts, turn)
        count = write_curve(search, pose[before[j]], parts, turn, curve)
        way[size : size + count] = curve[:count]
        size += count
        there[stop == j] = size - 1
    return way, there
