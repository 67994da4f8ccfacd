"""Cells of a raster as polygons that lose no cell and add little beside them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.prepared import prep

DEFAULT_TOLERANCE_CELLS = 0.5
"""How far polygons reach beyond their cells by default."""

_LOOK_AHEAD = 12
"""Corners after the last possible shortcut that are tried for a longer one."""

_COLLINEAR = 1e-9
"""Cross product up to which three corners count as on one line [cells^2]."""


def polygons_of_cells(mask: np.ndarray) -> np.ndarray:
    """Return the exact outlines of the cells set in `mask`, an array of polygons.

    A cell (row, column) covers column..column + 1 in x and row..row + 1 in y.
    """
    padded = np.pad(mask, 1)
    row, column = np.nonzero(padded[1:, 1:-1] != padded[:-1, 1:-1])
    across = np.stack([column, row, column + 1, row], axis=1)
    row, column = np.nonzero(padded[1:-1, 1:] != padded[1:-1, :-1])
    along = np.stack([column, row, column, row + 1], axis=1)
    sides = np.concatenate([across, along]).astype(float).reshape(-1, 2, 2)
    faces = shapely.get_parts(shapely.polygonize(shapely.linestrings(sides)))
    inside = shapely.point_on_surface(faces)
    x, y = shapely.get_x(inside).astype(int), shapely.get_y(inside).astype(int)
    return np.asarray(shapely.simplify(faces[mask[y, x]], 0.0))


def enclosing_polygons(mask: np.ndarray, tolerance: float) -> list[Polygon]:
    """Return polygons with few corners around the cells set in `mask`.

    They cover every cell, and every point of them is at most `tolerance` [cells] from
    a cell: gaps are filled and corners cut off from outside as far as that allows.
    """
    cells = polygons_of_cells(mask)
    if not len(cells) or tolerance <= 0.0:
        return list(cells)
    solid = shapely.union_all(cells)
    # One part of it at a time: looking into all of a map for each gap takes minutes.
    allowed = shapely.get_parts(solid.buffer(tolerance))
    shapely.prepare(allowed)
    square = {"join_style": "mitre"}
    closed = solid.buffer(tolerance, **square).buffer(-tolerance, **square)
    gaps = shapely.get_parts(closed - solid)
    gap, part = shapely.STRtree(allowed).query(gaps)
    filled = gaps[np.unique(gap[shapely.covers(allowed[part], gaps[gap])])]
    whole = shapely.union_all([solid, *filled]).simplify(0.0)
    tree, parts = shapely.STRtree(cells), []
    for part in shapely.get_parts(whole):
        own = cells[tree.query(part, predicate="intersects")]
        parts.append(_with_fewer_corners(part, own, tolerance))
    return list(shapely.get_parts(shapely.union_all(parts)))


def _with_fewer_corners(part: Polygon, cells: np.ndarray, tolerance: float) -> Polygon:
    part = shapely.orient_polygons(part)
    prepared = prep(shapely.union_all(cells).buffer(tolerance))
    outline, *holes = (
        list(_shortened(shapely.get_coordinates(ring)[:-1], prepared))
        for ring in (part.exterior, *part.interiors)
    )
    shorter = Polygon(outline, [hole for hole in holes if len(hole) > 2])
    # Shortcuts of one ring may cross those of another.
    return shorter if shorter.is_valid else part


def _shortened(ring: np.ndarray, allowed: object) -> Iterator[np.ndarray]:
    """Yield the corners left of a ring that has its polygon on the left.

    A shortcut from corner to corner is taken where all corners between lie on its left
    and the ground between is allowed: the polygon only grows.
    """
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    start = int(np.argmax(before[:, 0] * after[:, 1] > before[:, 1] * after[:, 0]))
    ring = np.roll(ring, -start, axis=0)
    ring, at = np.concatenate([ring, ring[:1]]), 0
    while at < len(ring) - 1:
        yield ring[at]
        end, tried = at + 1, at + 2
        while tried < min(len(ring), end + 1 + _LOOK_AHEAD):
            if _is_shortcut(ring[at : tried + 1], allowed):
                end = tried
            tried += 1
        at = end


def _is_shortcut(chain: np.ndarray, allowed: object) -> bool:
    along, offset = chain[-1] - chain[0], chain[1:-1] - chain[0]
    aside = along[0] * offset[:, 1] - along[1] * offset[:, 0]
    if not along.any() or aside.min() < -_COLLINEAR:
        return False
    return aside.max() <= _COLLINEAR or bool(allowed.covers(Polygon(chain)))  # type: ignore[attr-defined]
