"""The elevation as shapes of the simulated world: floor, foundations, draped marks."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from mrmg.mujoco_import import mujoco
from mrmg.scene.region import Region
from mrmg.scene.types import Scene
from mrmg.simulation.convex import upright_solid
from mrmg.world.elevation import height_at

FACET_M = 1.0
"""Side of the floor's facets. Tyres lose a little at every edge between facets: over a
hill of 12 % about 0.7 J/m at 0.5 m, 0.4 J/m at 1 m, where plain ground takes 106."""

FOUNDATION_M = 0.5
"""How deep solids reach into sloping ground."""

_MARK_SPACING_M = 0.4
_MARK_LIFT_M = 0.05
_SLIVER_M2 = 1e-9
_BASE_M = 1.0


def add_height_field(
    spec: mujoco.MjSpec, name: str, scene: Scene, center: np.ndarray, half: np.ndarray
) -> float:
    """Add the elevation as the height field `name`; return the height of its foot [m].

    Args:
        spec: receives it.
        name: of the height field.
        scene: with an elevation.
        center: of the field on the map [m].
        half: its half extent (x, y) [m].
    """
    columns, rows = (max(2, math.ceil(2.0 * side / FACET_M) + 1) for side in half)
    x = np.linspace(center[0] - half[0], center[0] + half[0], columns)
    y = np.linspace(center[1] - half[1], center[1] + half[1], rows)
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    height = _unbiased(height_at(scene, points).reshape(rows, columns))
    low, span = float(height.min()), float(max(np.ptp(height), 1e-3))
    field = spec.add_hfield(
        name=name, nrow=rows, ncol=columns, size=[*half, span, _BASE_M]
    )
    field.userdata = ((height - low) / span).ravel().astype(np.float32)
    return low


def _unbiased(height: np.ndarray) -> np.ndarray:
    """Return heights of nodes whose facets lie as high as the ground on average.

    Facets through points of a hollow lie above it, on a hill below it, by a twelfth of
    the differences of second order.
    """
    edge = np.pad(height, 1, mode="edge")
    around = edge[:-2, 1:-1] + edge[2:, 1:-1] + edge[1:-1, :-2] + edge[1:-1, 2:]
    return np.asarray(height - (around - 4.0 * height) / 12.0)


def height_span(scene: Scene, shape: Polygon | MultiPolygon) -> tuple[float, float]:
    """Return the lowest and highest ground under a shape [m]."""
    if scene.elevation is None:
        return 0.0, 0.0
    border = shapely.get_coordinates(shapely.segmentize(shape, 0.5))
    x_min, y_min, x_max, y_max = shape.bounds
    x, y = np.meshgrid(
        np.arange(x_min, x_max + 0.5, 0.5), np.arange(y_min, y_max + 0.5, 0.5)
    )
    inside = shapely.contains_xy(shape, x, y)
    points = np.concatenate([border, np.stack([x[inside], y[inside]], axis=1)])
    height = height_at(scene, points)
    return float(height.min()), float(height.max())


def on_map(scene: Scene, shape: Polygon) -> Polygon | MultiPolygon:
    """Return the part of a shape that is on the map or close to it; it may be empty.

    A shape may reach so far beyond the map that nothing is left of its precision.
    """
    around = shapely.box(*scene.bounds).buffer(_BASE_M, join_style="mitre")
    return shape if around.covers(shape) else shapely.intersection(shape, around)


def draped_mark(scene: Scene, region: Region) -> tuple[np.ndarray, np.ndarray]:
    """Return a thin mesh over a convex region that lies on the ground.

    Returns:
        Corners [m], shape (n, 3), and faces, shape (m, 3).
    """
    part = on_map(scene, region.shape)
    middle = shapely.get_coordinates(part.centroid)[0]
    outline = shapely.segmentize(part.exterior, _MARK_SPACING_M)
    ring = shapely.get_coordinates(shapely.orient_polygons(Polygon(outline)))[:-1]
    reach = float(np.hypot(*(ring - middle).T).max())
    rings = max(1, math.ceil(reach / _MARK_SPACING_M))
    share = (np.arange(1, rings + 1) / rings)[:, None, None]
    points = np.vstack([middle, (middle + share * (ring - middle)).reshape(-1, 2)])
    parts = shapely.get_parts(shapely.delaunay_triangles(shapely.multipoints(points)))
    # Points of one side may be off its line by their rounding.
    parts = parts[shapely.area(parts) > _SLIVER_M2]
    corners, faces = upright_solid(parts, 2.0 * _MARK_LIFT_M)
    corners[:, 2] += height_at(scene, corners[:, :2]) - _MARK_LIFT_M
    return corners, faces
