"""Shapes of scene entries, and what can be wrong with them."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry import Polygon

from mrmg.errors import Fault
from mrmg.scene.loading.faults import EntryError
from mrmg.scene.loading.schema import FinishEntry, RegionEntry
from mrmg.scene.loading.shape_schema import ShapedEntry
from mrmg.scene.region import Region

CIRCLE_SIDES = 32

_ROUNDING_M2 = 1e-6
"""A convex polygon may miss so much of its hull by the rounding of its corners."""


def circle_around(center: list[float], radius_m: float) -> Polygon:
    """Return the regular polygon that touches a circle from outside."""
    half = math.pi / CIRCLE_SIDES
    angle = 2.0 * half * np.arange(CIRCLE_SIDES) + half
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius_m / math.cos(half)
    return Polygon(ring + np.asarray(center))


def box_at(center: list[float], size: list[float], yaw_rad: float) -> Polygon:
    """Return a rectangle [length, width] about its centre, turned by `yaw_rad`."""
    half = 0.5 * np.asarray(size)
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return Polygon(corners @ np.array([[c, s], [-s, c]]) + np.asarray(center))


def shape_of(entry: ShapedEntry, path: str) -> Polygon:
    """Return the outline of an obstacle or terrain area.

    Raises:
        EntryError: if the entry at `path` states none.
    """
    form = entry.given(path)
    if entry.holes and not entry.polygon:
        message = f"only a polygon has holes, not a {form}"
        raise EntryError(Fault(f"{path}.holes", message))
    if entry.box:
        return box_at(entry.box.center, entry.box.size, entry.box.yaw)
    if entry.circle:
        return circle_around(entry.circle.center, entry.circle.radius)
    assert entry.polygon is not None
    shape = Polygon(entry.polygon, entry.holes or [])
    _require_simple(shape, path)
    return shapely.orient_polygons(shape)


def region_of(entry: RegionEntry | FinishEntry, path: str) -> Region:
    """Return the convex region of a goal, station or finish.

    Raises:
        EntryError: if the entry at `path` states none.
    """
    entry.given(path)
    if entry.circle:
        center = np.array(entry.circle.center, dtype=float)
        return _region(center, entry.circle.radius, np.zeros((0, 2)))
    assert entry.polygon is not None
    shape = Polygon(entry.polygon)
    _require_simple(shape, path)
    # The hull drops corners that lie on a straight side.
    hull = shapely.orient_polygons(shape.convex_hull)
    if hull.area - shape.area > _ROUNDING_M2:
        message = (
            f"not convex: it covers {shape.area:.4g} m2 of its hull's "
            f"{hull.area:.4g} m2; expected a convex polygon"
        )
        raise EntryError(Fault(f"{path}.polygon", message))
    corners = np.array(hull.exterior.coords[:-1])
    return _region(np.array(shape.centroid.coords[0]), 0.0, corners)


def _region(center: np.ndarray, radius_m: float, corners: np.ndarray) -> Region:
    center.setflags(write=False)
    corners.setflags(write=False)
    return Region(center=center, radius_m=radius_m, corners=corners)


def _require_simple(shape: Polygon, path: str) -> None:
    if shape.convex_hull.area == 0.0:
        message = "its area is zero; expected corners that are not on one line"
        raise EntryError(Fault(f"{path}.polygon", message))
    if not shape.is_valid:
        message = f"no simple polygon: {shapely.is_valid_reason(shape)}"
        raise EntryError(Fault(f"{path}.polygon", message))
