"""Where robots must go, as arrays, and whether they are there."""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.world._kernels import point_in_convex


class Targets(NamedTuple):
    """Goals, stations and finishes: convex regions; T targets, in that order.

    Attributes:
        goals: number of goals.
        places: number of goals and stations.
        finish: target in which each robot must end, -1 for anywhere, shape (R,).
        heading: heading with which it must end there [rad], shape (R,).
        tolerance: allowed deviation from that [rad]; at least pi for any, shape (R,).
        center: shape (T, 2).
        reach: radius of the circle about the centre that holds the region, shape (T,).
        corner: padded corners of polygons, shape (T, M, 2).
        corners: number of corners; 0 for a circle, shape (T,).
        dwell: how long a visit takes [s], shape (T,).
        zone: number among the gates of the safety kernels, -1 for none, shape (T,).
    """

    goals: int
    places: int
    finish: np.ndarray
    heading: np.ndarray
    tolerance: np.ndarray
    center: np.ndarray
    reach: np.ndarray
    corner: np.ndarray
    corners: np.ndarray
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
