"""Where robots must go, as arrays, and whether they are there."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from mrmg.compilation import inlined, record_type
from mrmg.planning.problem._control_kernels import wrap
from mrmg.planning.problem._region_kernels import REGION, in_region

TARGET = record_type(
    [
        *REGION.descr,
        ("heading", np.float64),  # with which it is visited [rad]
        ("tolerance", np.float64),  # allowed deviation from that; pi or more for any
        ("dwell", np.float64),  # how long a visit takes [s]
        ("zone", np.int64),  # number among the mutual-exclusion zones, -1 for none
    ]
)
"""A goal, station or finish."""


class Targets(NamedTuple):
    """Goals, stations and finishes: convex regions; T targets, in that order.

    Attributes:
        goals: number of goals.
        places: number of goals and stations.
        finish: target in which each robot must end, -1 for anywhere, shape (R,).
        target: `TARGET`, shape (T,).
        corner: padded corners of polygons, shape (T, M, 2).
    """

    goals: int
    places: int
    finish: np.ndarray
    target: np.ndarray
    corner: np.ndarray


@inlined
def in_target(targets, t, x, y):
    """Return whether a point lies in a target's region."""
    return in_region(targets.target[t], targets.corner[t], x, y)


@inlined
def askew(targets, t, state):
    """Return how far a robot is off a target's heading beyond what is allowed [rad]."""
    target = targets.target[t]
    if target.tolerance >= pi:
        return 0.0
    return max(0.0, abs(wrap(target.heading - state[2])) - target.tolerance)


@inlined
def at_target(targets, t, state):
    """Return whether a robot is in a target's region, with its heading."""
    return in_target(targets, t, state[0], state[1]) and askew(targets, t, state) == 0.0
