"""Lower bounds of paths between convex sets, in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely
from shapely.geometry import Polygon

from mrmg.scene.region import Region


@dataclass(frozen=True)
class Walls:
    """Obstacles as shortest ways meet them.

    Attributes:
        core: their inside, prepared for many lines.
        corners: the points of their outlines.
    """

    core: shapely.Geometry
    corners: np.ndarray

    @staticmethod
    def of(blocked: shapely.Geometry) -> Walls:
        """Return the walls that obstacles are."""
        core = shapely.buffer(blocked, -1e-6)
        shapely.prepare(core)
        return Walls(core, shapely.points(shapely.get_coordinates(blocked)))


def shortest_way_m(
    start: shapely.Geometry, end: shapely.Geometry, walls: Walls
) -> float:
    """Return a lower bound of the shortest way between two convex sets [m].

    Where an obstacle is in the way of the straight line, the way goes by one of the
    obstacles' corners at least: a free line that is moved there meets one first. Not so
    where a set reaches into an obstacle, out of which its end may have slid.
    """
    straight = float(start.distance(end))
    line = shapely.shortest_line(start, end)
    reach_in = shapely.intersects(walls.core, [start, end]).any()
    if reach_in or not line.intersects(walls.core):
        return straight
    to_start, to_end = (shapely.distance(walls.corners, one) for one in (start, end))
    by_corner = to_start + to_end
    return max(straight, float(by_corner.min()))


def outer_polygon(region: Region) -> shapely.Geometry:
    """Return a polygon that holds the region; a circle's is drawn about it."""
    if len(region.corners):
        return region.shape
    return _circumscribed(*region.center, region.radius_m)


@lru_cache(maxsize=1024)
def _circumscribed(x: float, y: float, radius_m: float) -> shapely.Geometry:
    """Return the regular polygon whose sides touch a circle from outside."""
    angle = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Polygon(ring * (radius_m / np.cos(np.pi / _SIDES)) + (x, y))


_SIDES = 32
"""Sides of the polygons that hold circles: 0.5 % of the radius looser than circles."""
