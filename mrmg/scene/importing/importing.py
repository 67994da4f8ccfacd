"""Foreign maps as scene documents: cleaned, scaled, without a mission yet."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import shapely
from shapely import affinity
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from mrmg.errors import Fault, SceneError, UsageError
from mrmg.scene.importing.map_text import RawMap, read_map

GRID_M = 0.001
"""Coordinates are rounded to this; smaller gaps between obstacles are closed."""

THIN_M = 0.05
"""Half the thickness that segments and points are given, to become obstacles."""

SLIVER_M2 = 1e-3
"""Obstacles of less area are left out: rounding leaves such behind."""


def import_map(
    path: str | Path, longest_side_m: float | None = 100.0
) -> dict[str, Any]:
    """Read a foreign polygon map as a scene document without robots or goals.

    Args:
        path: a map in one of the formats of `map_text`.
        longest_side_m: what the map's longer side is scaled to; None keeps the size
            the file states.

    Raises:
        SceneError: if the file cannot be read; names every bad line.
        UsageError: if `longest_side_m` is not positive.
    """
    path = Path(path)
    if longest_side_m is not None and not 0.0 < longest_side_m < float("inf"):
        message = f"the longest side is {longest_side_m} m; it must be positive"
        raise UsageError(message)
    raw = read_map(path)
    border, solid = _in_metres(raw, longest_side_m, str(path))
    x_min, y_min, x_max, y_max = border.bounds
    obstacles = [_entry(part) for part in _polygons(solid)]
    return {
        "format": 1,
        "name": re.sub(r"[^A-Za-z0-9_.\-]+", "_", path.stem),
        "bounds": [_rounded(value) for value in (x_min, y_min, x_max, y_max)],
        "obstacles": obstacles,
    }


def _in_metres(
    raw: RawMap, longest_side_m: float | None, source: str
) -> tuple[Polygon, BaseGeometry]:
    """Return the border and the blocked ground inside its box, lower left at (0, 0)."""
    extent = (
        shapely.box(*raw.border.bounds)
        if raw.border is not None
        else shapely.box(*shapely.total_bounds(list(raw.obstacles)))
    )
    x_min, y_min, x_max, y_max = extent.bounds
    longest = max(x_max - x_min, y_max - y_min)
    if min(x_max - x_min, y_max - y_min) <= 0.0:
        raise SceneError(source, [Fault("", "the map has no area")])
    scale = raw.unit_m if longest_side_m is None else longest_side_m / longest

    def placed(shape: BaseGeometry) -> BaseGeometry:
        moved = affinity.translate(shape, -x_min, -y_min)
        return affinity.scale(moved, scale, scale, origin=(0.0, 0.0))

    box = placed(extent)
    blocked = [_solid(placed(shape)) for shape in raw.obstacles]
    if raw.border is not None:
        blocked.append(box.difference(_solid(placed(raw.border))))
    solid = shapely.set_precision(shapely.union_all(blocked), GRID_M)
    return box, solid.intersection(shapely.set_precision(box, GRID_M))


def _solid(shape: BaseGeometry) -> BaseGeometry:
    """Return a valid shape with area: thin things get a thickness."""
    # A polygon that crosses itself may count zero until it is repaired.
    valid = shapely.make_valid(shape, method="structure", keep_collapsed=True)
    if valid.area == 0.0:
        return valid.buffer(THIN_M, cap_style="square", join_style="mitre")
    return valid


def _polygons(shape: BaseGeometry) -> Iterator[Polygon]:
    """Yield the polygons of a shape from lower left to upper right, without slivers."""
    parts = [
        part
        for part in shapely.get_parts(shape)
        if isinstance(part, Polygon) and part.area > SLIVER_M2
    ]
    yield from sorted(parts, key=lambda part: (part.bounds[1], part.bounds[0]))


def _entry(shape: Polygon) -> dict[str, Any]:
    # Corners on a straight side come from unions of touching shapes.
    shape = shapely.orient_polygons(shape.simplify(0.1 * GRID_M))
    entry: dict[str, Any] = {"polygon": _corners(shape.exterior)}
    if shape.interiors:
        entry["holes"] = [_corners(ring) for ring in shape.interiors]
    return entry


def _corners(ring: Any) -> list[list[float]]:
    return [[_rounded(x), _rounded(y)] for x, y in ring.coords[:-1]]


def _rounded(value: float) -> float:
    return round(float(value), 3) + 0.0
