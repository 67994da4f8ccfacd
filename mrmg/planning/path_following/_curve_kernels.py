"""Curves of a robot: parts with one turn each, driven one after another, in pieces.

A part has a length, negative backwards [m], and a turn [rad]; one without a length is
a turn on the spot.
"""

from __future__ import annotations

from math import atan2, ceil, cos, hypot, pi, sin

import numpy as np

from mrmg.compilation import kernel
from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.path_following.coordination._reeds_shepp_kernels import (
    MOST_PIECES,
    reeds_shepp,
)
from mrmg.planning.problem._control_kernels import wrap

PARTS = MOST_PIECES + 1
"""Parts of a curve: those of a shortest one, and a straight way on."""

PIECES = 3
"""Pieces of an arc; the pose at the end of each is looked at."""

SHORTEST_M = 1e-3
"""Length below which a curve has no such part."""


@kernel
def _straight_parts(search, a, b, way, turn):
    """Write the turn, the straight way and the turn to a pose; return True."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    far = hypot(dx, dy)
    ahead = atan2(dy, dx) if far > SHORTEST_M else b[2]
    first, last = wrap(ahead - a[2]), wrap(b[2] - ahead)
    if search.own[0].limit[0] < 0.0 and abs(first) + abs(last) > pi:
        far, first, last = -far, wrap(first + pi), wrap(last + pi)
    way[1], turn[0], turn[2] = far, first, last
    return True


@kernel
def _arc_parts(search, a, b, way, turn):
    """Write the parts of the shortest curve of a car; return whether there is one."""
    dx, dy, reverses = b[0] - a[0], b[1] - a[1], search.own[0].limit[0] < 0.0
    radius = 1.0 / search.bend
    found = reeds_shepp(dx, dy, a[2], b[2], radius, reverses, turn, way) < np.inf
    for p in range(MOST_PIECES):
        if abs(way[p]) < SHORTEST_M:
            way[p] = 0.0
        turn[p] *= search.bend * way[p]
    return found


@kernel
def write_parts(search, a, b, way, turn):
    """Write the parts of the shortest curve between poses; return whether there is one.

    Args:
        search: gives the robot and the curvature of its turns.
        a, b: poses, (x, y, heading) in front.
        way: receives the length of each part [m], shape (PARTS,).
        turn: receives how far it turns there [rad], shape (PARTS,).
    """
    way[:], turn[:] = 0.0, 0.0
    if search.own[0].model == UNICYCLE:
        return _straight_parts(search, a, b, way, turn)
    return _arc_parts(search, a, b, way, turn)


@kernel
def parts_cost(search, gear, way, turn):
    """Return (cost, gear) of a curve that is driven after a way in some gear.

    Args:
        search: gives what turning and changes of gear cost.
        gear: 1 forwards, -1 backwards, 0 for none.
        way, turn: length and turn of each part, as `write_parts` writes them.

    Returns:
        cost [m of plain ground], and the gear it ends in.
    """
    cost = 0.0
    for p in range(PARTS):
        cost += abs(way[p]) + search.scrub * abs(turn[p])
        if way[p] != 0.0:
            after = 1 if way[p] > 0.0 else -1
            cost += search.change if after * gear < 0 else 0.0
            gear = after
    return cost, gear


@kernel
def pieces_of(search, way, turn):
    """Return how many pieces a part of a curve has."""
    turns = abs(turn) * search.headings / (2.0 * pi)
    return int(ceil(PIECES * max(abs(way) / search.length, turns) - 1e-9))


@kernel
def write_curve(search, a, way, turn, curve):
    """Write a curve from a pose on, piece by piece.

    Args:
        search: gives the length of pieces.
        a: pose, (x, y, heading) in front.
        way, turn: length and turn of each part, as `write_parts` writes them.
        curve: receives (x, y, heading, gear) at the ends of pieces, shape (n, 4).

    Returns:
        number of them; -1 if there is no room.
    """
    x, y, theta, n = a[0], a[1], a[2], 0
    for p in range(PARTS):
        pieces = pieces_of(search, way[p], turn[p])
        if n + pieces > len(curve):
            return -1
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
