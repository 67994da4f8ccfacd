"""How an elastic band bends: its turns, their cost, and that of missed headings."""

from __future__ import annotations

from math import atan2, sqrt
from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.problem._control_kernels import wrap

SOFT_TURN = 0.05
"""Angle below which the scrub of turning is rounded off [rad]."""

CURVATURE_WEIGHT = 60.0
"""Cost per metre of a curvature that exceeds the limit by its own size [m/m]."""

RATE_WEIGHT = 20.0
"""Likewise for changes of curvature."""


class Shape(NamedTuple):
    """The form of a path, by node, with the cost's derivatives.

    Attributes:
        size: length of the segment from the node on; none from the last one [m].
        way: length its turn is spread over [m].
        turn: at the node [rad].
        bend: curvature there [1/m].
        d_turn, d_bend, d_size: derivatives of the cost.
    """

    size: np.ndarray
    way: np.ndarray
    turn: np.ndarray
    bend: np.ndarray
    d_turn: np.ndarray
    d_bend: np.ndarray
    d_size: np.ndarray


@kernel
def new_shape(nodes):
    """Return an empty `Shape`."""
    zero = np.zeros((7, nodes))
    return Shape(zero[0], zero[1], zero[2], zero[3], zero[4], zero[5], zero[6])


@kernel
def write_turns(p, gear, nose, shape):
    """Write the length of each segment, and the turn and curvature at each node.

    At a change of gear the turn is that of the heading. The first turn is that from the
    robot's heading at the start, along the unit vector `nose[0]`, the last one that to
    its heading at the end, `nose[1]`; none if that is zero.
    """
    ax, ay, last = nose[0, 0], nose[0, 1], 1
    n = len(p) - 1
    for i in range(n + 1):
        bx, by, next_gear = nose[1, 0], nose[1, 1], 1
        if i < n:
            bx, by, next_gear = p[i + 1, 0] - p[i, 0], p[i + 1, 1] - p[i, 1], gear[i]
            shape.size[i] = max(sqrt(bx * bx + by * by), 1e-6)
        sign = last * next_gear
        shape.turn[i] = atan2((ax * by - ay * bx) * sign, (ax * bx + ay * by) * sign)
        ahead = shape.size[i] if i < n else 0.0
        shape.way[i] = 0.5 * (shape.size[max(i - 1, 0)] + ahead)
        shape.bend[i] = shape.turn[i] / shape.way[i]
        ax, ay, last = bx, by, next_gear
    if not nose[1].any():
        shape.turn[n] = shape.bend[n] = 0.0


@kernel
def bending_cost(cost_map, gear, pivot, stiff, free_end, shape):
    """Return the cost of turning, of too much curvature and of its changes.

    Turns on the spot (`pivot`) have no curvature. Any at the start costs `stiff` per
    square radian; a free end has no curvature of its own. Writes the cost's derivatives
    by turn and size.
    """
    total = stiff * shape.turn[0] * shape.turn[0]
    n = len(shape.turn)
    shape.d_bend[:] = 0.0
    shape.d_size[:] = 0.0
    for i in range(n):
        rounded = sqrt(shape.turn[i] * shape.turn[i] + SOFT_TURN * SOFT_TURN)
        total += cost_map.scrub * (rounded - SOFT_TURN)
        shape.d_turn[i] = cost_map.scrub * shape.turn[i] / rounded
    shape.d_turn[0] += 2.0 * stiff * shape.turn[0]
    for i in range(n - free_end):
        at, after = max(i - 1, 0), min(i, n - 2)
        if pivot[after]:
            continue
        sharp = abs(shape.bend[i]) / cost_map.curvature - 1.0
        if sharp > 0.0:
            total += CURVATURE_WEIGHT * shape.way[i] * sharp * sharp
            slope = 2.0 * CURVATURE_WEIGHT * shape.way[i] * sharp / cost_map.curvature
            shape.d_bend[i] += slope if shape.bend[i] > 0.0 else -slope
            shape.d_size[at] += 0.5 * CURVATURE_WEIGHT * sharp * sharp
            shape.d_size[i] += 0.5 * CURVATURE_WEIGHT * sharp * sharp
        if i == 0 or gear[after] != gear[at] or pivot[at]:
            continue
        rate = (shape.bend[i] - shape.bend[at]) / shape.size[at]
        fast = abs(rate) / cost_map.curvature_rate - 1.0
        if fast > 0.0:
            total += RATE_WEIGHT * shape.size[at] * fast * fast
            slope = 2.0 * RATE_WEIGHT * fast / cost_map.curvature_rate
            slope = slope if rate > 0.0 else -slope
            shape.d_bend[i] += slope
            shape.d_bend[at] -= slope
            shape.d_size[at] -= RATE_WEIGHT * fast * (fast + 2.0)
    for i in range(n):
        shape.d_turn[i] += shape.d_bend[i] / shape.way[i]
        longer = -0.5 * shape.d_bend[i] * shape.bend[i] / shape.way[i]
        shape.d_size[max(i - 1, 0)] += longer
        shape.d_size[i] += longer
    return total


@kernel
def add_aim(cost_map, a, b, gear, aim, gradient):
    """Add the cost of too much curvature between a segment and the heading at its end.

    Args:
        cost_map: gives the greatest curvature.
        a, b: nodes of the segment; half of it turns to the heading.
        gear: in which the segment is driven from a to b.
        aim: heading at one of them [rad].
        gradient: of the two nodes, shape (2, 2).
    """
    ex, ey = b[0] - a[0], b[1] - a[1]
    size = max(sqrt(ex * ex + ey * ey), 1e-6)
    off = wrap(atan2(gear * ey, gear * ex) - aim)
    sharp = abs(off) / (0.5 * size * cost_map.curvature) - 1.0
    if sharp <= 0.0:
        return 0.0
    swing = 2.0 * CURVATURE_WEIGHT * sharp / cost_map.curvature / (size * size)
    swing = swing if off > 0.0 else -swing
    stretch = -0.5 * CURVATURE_WEIGHT * sharp * (sharp + 2.0) / size
    gx, gy = stretch * ex - swing * ey, stretch * ey + swing * ex
    gradient[0, 0] -= gx
    gradient[0, 1] -= gy
    gradient[1, 0] += gx
    gradient[1, 1] += gy
    return CURVATURE_WEIGHT * 0.5 * size * sharp * sharp
