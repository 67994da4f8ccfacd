"""Triangles and convex pieces of polygons, and upright solids over them.

MuJoCo collides convex shapes only.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import Polygon

_MIN_AREA_M2 = 1e-9
_COLLINEAR_M = 1e-6
_REFLEX_TOLERANCE = 1e-12


def triangles(polygon: Polygon) -> list[Polygon]:
    """Return a constrained Delaunay triangulation of a polygon with holes.

    Vertices within 1 um of the line through their neighbours are dropped first;
    triangles too thin for a solid are left out.
    """
    clean = shapely.simplify(polygon, _COLLINEAR_M)
    parts = shapely.get_parts(shapely.constrained_delaunay_triangles(clean))
    return [part for part in parts if part.area > _MIN_AREA_M2]


def numbered(parts: Sequence[Polygon]) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of triangles, shape (n, 2), and which each has, shape (m, 3).

    Each triangle has them counter-clockwise.
    """
    rings = shapely.get_rings(shapely.orient_polygons(parts))
    corners = shapely.get_coordinates(rings).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    points, index = np.unique(corners, axis=0, return_inverse=True)
    return points, index.reshape(-1, 3)


def prism_corners(points: np.ndarray, height_m: float) -> np.ndarray:
    """Return points at height 0 and again at another, shape (n, 2) -> (2 n, 3)."""
    return np.concatenate(
        [np.insert(points, 2, level, axis=1) for level in (0.0, height_m)]
    )


def upright_solid(
    parts: Sequence[Polygon], height_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the solid over triangles that lie whole side to whole side.

    Returns:
        Corners [m], shape (n, 3), and the outward triangles round it, shape (m, 3).
    """
    points, faces = numbered(parts)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, place, uses = np.unique(
        np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
    )
    # An edge of a single triangle is one of the outline.
    start, end = edges[place[uses == 1]].T
    above = len(points)
    rising = np.stack([start, end, end + above], axis=1)
    falling = np.stack([start, end + above, start + above], axis=1)
    sides = [faces[:, ::-1], faces + above, rising, falling]
    return prism_corners(points, height_m), np.concatenate(sides)


def convex_pieces(polygon: Polygon) -> list[np.ndarray]:
    """Return convex polygons that tile `polygon`, each counter-clockwise, shape (k, 2).

    Removes the diagonals of a triangulation, longest first, wherever the union stays
    convex (Hertel and Mehlhorn 1983): at most four times the least number of pieces.
    """
    points, faces = numbered(triangles(polygon))
    pieces = dict(enumerate(faces.tolist()))
    sides = {
        (ring[i - 1], ring[i]): name for name, ring in pieces.items() for i in range(3)
    }
    diagonals = sorted(
        (side for side in sides if side[0] < side[1] and side[::-1] in sides),
        key=lambda side: -float(np.hypot(*(points[side[0]] - points[side[1]]))),
    )
    for start, end in diagonals:
        left, right = sides[start, end], sides[end, start]
        joined = _join(pieces[left], pieces[right], start, end)
        if left != right and _is_convex(points[joined]):
            pieces[left] = joined
            del pieces[right]
            sides.update((side, left) for side in pairwise([joined[-1], *joined]))
    return [points[ring] for ring in pieces.values()]


def _join(left: list[int], right: list[int], start: int, end: int) -> list[int]:
    """Return the ring of two pieces without their common side from start to end."""
    at, far = left.index(end), right.index(start)
    return [*left[at:], *left[:at], *(right[far:] + right[:far])[1:-1]]


def _is_convex(ring: np.ndarray) -> bool:
    before = ring - np.roll(ring, 1, axis=0)
    after = np.roll(ring, -1, axis=0) - ring
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return bool((turn > -_REFLEX_TOLERANCE).all())
