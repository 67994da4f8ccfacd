"""Convex regions: of targets, and of zones in which only one robot may be."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import inlined, record_type
from mrmg.world._polygon_kernels import point_distance, point_in_convex

REGION = record_type(
    [
        ("center", np.float64, (2,)),  # [m]
        ("reach", np.float64),  # radius of the circle about it that holds the region
        ("corners", np.int64),  # number of corners; 0 for a circle
    ]
)
"""A convex region."""


class Zones(NamedTuple):
    """Mutual-exclusion zones.

    Attributes:
        zone: `REGION`, shape (S,).
        corner: padded corners of polygons, shape (S, M, 2).
    """

    zone: np.ndarray
    corner: np.ndarray


@inlined
def in_region(region, corner, x, y):
    """Return whether a point lies in a region.

    Args:
        region: a record with what a `REGION` has.
        corner: its padded corners, shape (M, 2).
        x, y: the point [m].
    """
    if point_distance(x, y, region.center[0], region.center[1]) > region.reach:
        return False
    return region.corners == 0 or point_in_convex(x, y, corner[: region.corners])
