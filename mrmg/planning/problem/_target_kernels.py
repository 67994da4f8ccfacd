"""Where robots must go, as arrays, and whether they are there."""

from __future__ import annotations

from math import hypot, pi
from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.problem._control_kernels import wrap
from mrmg.world._kernels import point_in_convex


class Targets(NamedTuple):
    """Goals, stations and finishes: convex regions; T targets, in that order.

    Attributes:
        goals: number of goals.
        places: number of goals and stations.
        finish: target in which each robot must end, -1 for anywhere, shape (R,).
        center: shape (T, 2).
        reach: radius of the circle about the centre that holds the region, shape (T,).
        corner: padded corners of polygons, shape (T, M, 2).
        corners: number of corners; 0 for a circle, shape (T,).
        heading: with which it is visited [rad], shape (T,).
        tolerance: allowed deviation from that [rad]; at least pi for any, shape (T,).
        dwell: how long a visit takes [s], shape (T,).
        zone: number among the gates of the safety kernels, -1 for none, shape (T,).
    """

    goals: int
    places: int
    finish: np.ndarray
    center: np.ndarray
    reach: np.ndarray
    corner: np.ndarray
    corners: np.ndarray
    heading: np.ndarray
    tolerance: np.ndarray
    dwell: np.ndarray
    zone: np.ndarray


@kernel
def in_target(targets, t, x, y):
    """Return whether a point lies in a target's region."""
    far = hypot(x - targets.center[t, 0], y - targets.center[t, 1])
    if far > targets.reach[t]:
        return False
    n = targets.corners[t]
    return n == 0 or point_in_convex(x, y, targets.corner[t, :n])


@kernel
def askew(targets, t, state):
    """Return how far a robot is off a target's heading beyond what is allowed [rad]."""
    if targets.tolerance[t] >= pi:
        return 0.0
    return max(0.0, abs(wrap(targets.heading[t] - state[2])) - targets.tolerance[t])


@kernel
def at_target(targets, t, state):
    """Return whether a robot is in a target's region, with its heading."""
    return in_target(targets, t, state[0], state[1]) and askew(targets, t, state) == 0.0
