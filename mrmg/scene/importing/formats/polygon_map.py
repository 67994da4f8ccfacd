"""Polygon and triangle maps of path-planning papers: cleaned and scaled."""

from __future__ import annotations

from pathlib import Path

import shapely
from shapely import affinity
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError
from mrmg.scene.importing.layers import Area, ImportOptions, Layer, solid
from mrmg.scene.importing.map_text import RawMap, read_map
from mrmg.scene.importing.registry import Format, Head

GRID_M = 0.001
"""Coordinates are rounded to this; smaller gaps between obstacles are closed."""

THIN_M = 0.05
"""Half the thickness that segments and points are given, to become obstacles."""

SLIVER_M2 = 1e-3
"""Obstacles of less area are left out: rounding leaves such behind."""


def read_polygon_map(path: Path, options: ImportOptions) -> Layer:
    """Read a polygon map: scaled, its shapes joined, its lower left corner at (0, 0).

    Raises:
        SceneError: if the file cannot be read; names every bad line.
    """
    raw, longest_m = read_map(path), options.longest_side_m
    border, blocked = _in_metres(raw, longest_m, str(path))
    shapes = _polygons(blocked)
    x_min, y_min, x_max, y_max = (round(value, 3) for value in border.bounds)
    became = counted(len(shapes), "polygon")
    notes = [
        f"{counted(len(raw.obstacles), 'shape')} became {became}",
        f"scaled to a longest side of {longest_m:g} m (--longest-side)",
    ]
    return Layer(
        bounds=(x_min, y_min, x_max, y_max),
        # Corners on a straight side come from unions of touching shapes.
        obstacles=[Area(shape.simplify(0.1 * GRID_M)) for shape in shapes],
        notes=notes,
    )


def _in_metres(
    raw: RawMap, longest_side_m: float, source: str
) -> tuple[Polygon, BaseGeometry]:
    """Return the border and the blocked ground inside its box, lower left at (0, 0)."""
    drawn = list(raw.obstacles) if raw.border is None else [raw.border]
    extent = shapely.box(*shapely.total_bounds(drawn))
    x_min, y_min, x_max, y_max = extent.bounds
    if min(x_max - x_min, y_max - y_min) <= 0.0:
        raise SceneError(source, [Fault("", "the map has no area")])
    scale = longest_side_m / max(x_max - x_min, y_max - y_min)

    def placed(shape: BaseGeometry) -> BaseGeometry:
        moved = affinity.translate(shape, -x_min, -y_min)
        return affinity.scale(moved, scale, scale, origin=(0.0, 0.0))

    box = placed(extent)
    blocked = [_solid(placed(shape)) for shape in raw.obstacles]
    if raw.border is not None:
        blocked.append(box.difference(_solid(placed(raw.border))))
    whole = shapely.set_precision(shapely.union_all(blocked), GRID_M)
    return box, whole.intersection(shapely.set_precision(box, GRID_M))


def _solid(shape: BaseGeometry) -> BaseGeometry:
    return solid(shape, THIN_M, cap_style="square", join_style="mitre")


def _polygons(shape: BaseGeometry) -> list[Polygon]:
    """Return the polygons of a shape from lower left to upper right, no slivers."""
    parts = [
        part
        for part in shapely.get_parts(shape)
        if isinstance(part, Polygon) and part.area > SLIVER_M2
    ]
    return sorted(parts, key=lambda part: (part.bounds[1], part.bounds[0]))


def _recognises(head: Head) -> bool:
    lines = (line.strip() for line in head.start.splitlines())
    first = next((line for line in lines if line[:1] not in (b"", b"#")), b"x")
    return head.kind == "text" and first[:1] in b"[-+.0123456789"


FORMAT = Format(
    kind="polygon-map",
    title="polygon or triangle map (text)",
    recognises=_recognises,
    read=read_polygon_map,
)
