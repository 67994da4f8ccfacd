"""Cutting polygons into convex pieces, as MuJoCo collides convex shapes only."""

from __future__ import annotations

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


def convex_pieces(polygon: Polygon) -> list[np.ndarray]:
    """Return convex polygons that tile `polygon`, each counter-clockwise, shape (k, 2).

    Removes the diagonals of a triangulation, longest first, wherever the union stays
    convex (Hertel and Mehlhorn 1983): at most four times the least number of pieces.
    """
    rings = [
        shapely.get_coordinates(shapely.orient_polygons(part).exterior)[:-1]
        for part in triangles(polygon)
    ]
    points, index = np.unique(np.concatenate(rings), axis=0, return_inverse=True)
    pieces = dict(enumerate(index.reshape(-1, 3).tolist()))
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
