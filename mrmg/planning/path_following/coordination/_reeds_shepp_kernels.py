"""Shortest curves of a car between two poses without obstacles.

J. A. Reeds, L. A. Shepp: Optimal paths for a car that goes both forwards and backwards,
Pacific Journal of Mathematics 145, 1990. Of their words, those with at most three
pieces (C|C|C, CC|C, C|CC and CSC) are looked at: the others are seldom shorter, and
never by much.

A car that cannot reverse drives CSC and CCC: L. E. Dubins, On curves of minimal length
with a constraint on average curvature, American Journal of Mathematics 79, 1957. An arc
that a word drives backwards leads to the same pose as the rest of its circle.
"""

from __future__ import annotations

from math import asin, atan2, cos, hypot, pi, sin, sqrt

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.problem._control_kernels import wrap

MOST_PIECES = 3
"""Pieces of a curve."""

ROUNDING = 1e-6
"""Arc below which a piece is none [rad]: rounding must not make it a full circle, nor
have a word refused as driven backwards."""


@kernel
def _straight_same(x, y, phi):
    """Return (found, t, u, v) of L S+ L (formula 8.1), its arcs either way."""
    dx, dy = x - sin(phi), y - 1.0 + cos(phi)
    t = atan2(dy, dx)
    return True, t, hypot(dx, dy), wrap(phi - t)


@kernel
def _straight_other(x, y, phi):
    """Return (found, t, u, v) of L S+ R (formula 8.2), its arcs either way."""
    dx, dy = x + sin(phi), y - 1.0 - cos(phi)
    far2 = dx * dx + dy * dy
    if far2 < 4.0:
        return False, 0.0, 0.0, 0.0
    u = sqrt(far2 - 4.0)
    t = wrap(atan2(dy, dx) + atan2(2.0, u))
    return True, t, u, wrap(t - phi)


@kernel
def _turns(x, y, phi):
    """Return (found, t, u, v) of L R- L (formulas 8.3 and 8.4), others either way."""
    dx, dy = x - sin(phi), y - 1.0 + cos(phi)
    far = hypot(dx, dy)
    if far > 4.0:
        return False, 0.0, 0.0, 0.0
    direction = atan2(dy, dx)
    u = -2.0 * asin(0.25 * far)
    t = wrap(direction + 0.5 * u + pi)
    return True, t, u, wrap(phi - t + u)


@kernel
def _forwards(arc):
    """Return the arc forwards that leads where an arc either way does [rad]."""
    arc %= 2.0 * pi
    return 0.0 if arc > 2.0 * pi - ROUNDING else arc


@kernel
def _or_none(arc):
    """Return an arc, or none where it is but rounding [rad]."""
    return 0.0 if abs(arc) < ROUNDING else arc


@kernel
def reeds_shepp(dx, dy, start, goal, radius, reverses, turn, length):
    """Write the shortest curve found between two poses; return its length [m].

    Args:
        dx, dy: from the first position to the second [m].
        start, goal: headings there [rad].
        radius: of turns [m].
        reverses: whether the car may drive backwards.
        turn: receives 1 for pieces to the left, 0 straight, -1 to the right; (3,).
        length: receives the pieces' lengths [m], negative in reverse; (3,).
    """
    c, s = cos(start), sin(start)
    x0, y0 = (c * dx + s * dy) / radius, (c * dy - s * dx) / radius
    phi0 = wrap(goal - start)
    best = np.inf
    for word in range(4):
        for mirrored in range(4):
            back, side = mirrored & 1, mirrored >> 1
            if back and not reverses:
                continue
            x = -x0 if back else x0
            y = -y0 if side else y0
            phi = -phi0 if back != side else phi0
            second = -1.0
            if word == 0:
                found, t, u, v = _straight_same(x, y, phi)
                second, third = 0.0, 1.0
            elif word == 1:
                found, t, u, v = _straight_other(x, y, phi)
                second, third = 0.0, -1.0
            elif word == 2:
                found, t, u, v = _turns(x, y, phi)
                third = 1.0
            else:  # the curve of the way back, run through from its end
                xb = x * cos(phi) + y * sin(phi)
                yb = x * sin(phi) - y * cos(phi)
                found, v, u, t = _turns(xb, yb, phi)
                third = 1.0
            if not found:
                continue
            if word == 0 and u < ROUNDING:  # one arc, in two parts by chance
                t, v = (phi, 0.0) if phi >= 0.0 else (0.0, phi)
            t, v = _or_none(t), _or_none(v)
            if not reverses:
                t, v = _forwards(t), _forwards(v)
                u = _forwards(u) if second != 0.0 else u
            elif (v if word == 3 else t) < 0.0 or (word < 2 and v < 0.0):
                continue
            total = abs(t) + abs(u) + abs(v)
            if total >= best:
                continue
            best = total
            sign = -1.0 if back else 1.0
            mirror = -1.0 if side else 1.0
            length[0], length[1], length[2] = sign * t, sign * u, sign * v
            turn[0], turn[1], turn[2] = mirror, mirror * second, mirror * third
    for i in range(MOST_PIECES):
        length[i] *= radius
    return best * radius
