"""Convex regions: where goals, stations and finishes are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from shapely.geometry import Polygon

from mrmg.scene.content import ByContent, content, contents

HEADING_TOLERANCE_RAD = 0.2
"""Allowed deviation from a heading that a scene states without one."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Region(ByContent):
    """A convex set of positions: a circle or a convex polygon.

    Attributes:
        center: [m], shape (2,): the circle's centre or the polygon's centroid.
        radius_m: of the circle; 0 for a polygon.
        corners: counter-clockwise [m], shape (n, 2); shape (0, 2) for a circle.
    """

    center: np.ndarray
    radius_m: float
    corners: np.ndarray

    def content(self) -> dict[str, Any]:
        """Return what counts for a digest; the last bits of a centroid do not."""
        if not len(self.corners):
            return contents(self)
        center = [round(float(value), 9) for value in self.center]
        return {
            **contents(self),
            "center": content(center),
            "corners": content(Polygon(self.corners)),
        }

    @cached_property
    def shape(self) -> Polygon:
        """The region as a polygon (a circle with 64 sides, from within)."""
        if len(self.corners):
            return Polygon(self.corners)
        angle = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * self.radius_m
        return Polygon(ring + self.center)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Return how far points lie inside [m]; negative outside. Shape (n, 2) -> (n,).

        The depth is the distance to the nearest side's line (or to the circle), so a
        point is in the region exactly when its depth is not negative.
        """
        points = np.atleast_2d(points)
        if not len(self.corners):
            offset = points - self.center
            return np.asarray(self.radius_m - np.hypot(offset[:, 0], offset[:, 1]))
        start = self.corners
        edge = np.roll(start, -1, axis=0) - start
        edge = edge / np.hypot(edge[:, 0], edge[:, 1])[:, None]
        offset = points[:, None, :] - start[None]
        inside = edge[None, :, 0] * offset[..., 1] - edge[None, :, 1] * offset[..., 0]
        return np.asarray(inside.min(axis=1))

    def covers(self, other: Region) -> bool:
        """Return whether all of another region is inside, but for rounding."""
        points = other.corners if len(other.corners) else other.center
        return bool((self.depth(points) >= other.radius_m - 1e-9).all())
