"""The world a planner queries: free space per set of obstacles, and terrain grids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon

from mrmg.scene.types import Scene
from mrmg.world import _raster_kernels
from mrmg.world._kernels import UNIFORM_TURNING, FreeSpace, TerrainGrid

CELL_M = 0.25
"""Side of a cell of the distance field and of the terrain grid."""

BUCKET_M = 2.0
"""Side of a bucket of obstacle edges."""


@dataclass(frozen=True, slots=True)
class World:
    """Scene geometry prepared for fast questions.

    Attributes:
        spaces: one free space per distinct set of obstacles.
        space_of_robot: index into `spaces` for each robot of the scene, shape (R,).
        obstacles: union of the obstacles of each space.
        terrain: multipliers of rolling and turning, and elevation.
    """

    spaces: tuple[FreeSpace, ...]
    space_of_robot: np.ndarray
    obstacles: tuple[shapely.Geometry, ...]
    terrain: TerrainGrid

    @staticmethod
    def from_scene(scene: Scene, *, margin_m: float = 1.0) -> World:
        """Prepare `scene`.

        Args:
            scene: the scene.
            margin_m: largest clearance that footprint tests will use.
        """
        reach = margin_m + max(
            robot.model.circumscribed_radius_m for robot in scene.robots
        )
        keys = [
            tuple(i for i, o in enumerate(scene.barriers) if o.stops(robot.id))
            for robot in scene.robots
        ]
        distinct = list(dict.fromkeys(keys))
        unions = tuple(
            shapely.union_all([scene.barriers[i].shape for i in key])
            for key in distinct
        )
        return World(
            spaces=tuple(free_space(scene.bounds, union, reach) for union in unions),
            space_of_robot=np.array([distinct.index(key) for key in keys]),
            obstacles=unions,
            terrain=_terrain_grid(scene),
        )


def free_space(
    bounds: tuple[float, float, float, float], obstacles: shapely.Geometry, reach: float
) -> FreeSpace:
    """Return the free space inside `bounds` outside `obstacles`.

    Args:
        bounds: (x_min, y_min, x_max, y_max) [m].
        obstacles: a polygon or multipolygon, possibly empty.
        reach: largest radius plus margin a footprint test will use [m].
    """
    x_min, y_min, x_max, y_max = bounds
    ring_start, points = _rings(obstacles)
    frame = np.array([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])
    rings = [frame, *np.split(points, ring_start[1:-1])]
    edge = np.concatenate(
        [np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in rings]
    )
    columns, rows = _cells(bounds, CELL_M)
    distance = _raster_kernels.edge_distance_field(
        edge, x_min, y_min, CELL_M, rows, columns
    )
    inside = _raster_kernels.fill_rings(
        ring_start, points, x_min, y_min, CELL_M, rows, columns
    )
    inside[:, x_min + (np.arange(columns) + 0.5) * CELL_M > x_max] = True
    inside[y_min + (np.arange(rows) + 0.5) * CELL_M > y_max] = True
    bucket_columns, bucket_rows = _cells(bounds, BUCKET_M)
    bucket_start, bucket_edge = _raster_kernels.bucket_edges(
        edge, x_min, y_min, BUCKET_M, bucket_columns, bucket_rows, reach
    )
    return FreeSpace(
        x_min=float(x_min),
        y_min=float(y_min),
        cell=CELL_M,
        distance=np.where(inside, -distance, distance),
        bucket=BUCKET_M,
        bucket_columns=bucket_columns,
        bucket_rows=bucket_rows,
        bucket_start=bucket_start,
        bucket_edge=bucket_edge,
        reach=float(reach),
        edge=edge,
    )


def _cells(bounds: tuple[float, float, float, float], side_m: float) -> tuple[int, int]:
    """Return how many cells cover bounds along x and y."""
    x_min, y_min, x_max, y_max = bounds
    return int(np.ceil((x_max - x_min) / side_m)), int(
        np.ceil((y_max - y_min) / side_m)
    )


def _rings(geometry: shapely.Geometry) -> tuple[np.ndarray, np.ndarray]:
    """Return the first point of each ring of polygons and the end, and all points."""
    rings = [
        np.asarray(ring.coords)[:-1]
        for polygon in shapely.get_parts(geometry)
        if isinstance(polygon, Polygon)
        for ring in (polygon.exterior, *polygon.interiors)
    ]
    points = np.concatenate([np.zeros((0, 2)), *rings])
    return np.cumsum([0, *(len(ring) for ring in rings)]), points


def _terrain_grid(scene: Scene) -> TerrainGrid:
    x_min, y_min, _, _ = scene.bounds
    columns, rows = _cells(scene.bounds, CELL_M)
    multiplier = np.ones((rows, columns))
    turning = np.ones((rows, columns))
    for area in scene.terrain:
        inside = _raster_kernels.fill_rings(
            *_rings(area.shape), float(x_min), float(y_min), CELL_M, rows, columns
        )
        multiplier[inside] = area.multiplier
        turning[inside] = area.turning_multiplier
    flat = TerrainGrid(
        x_min=float(x_min),
        y_min=float(y_min),
        cell=CELL_M,
        multiplier=multiplier,
        turning=UNIFORM_TURNING if np.all(turning == 1.0) else turning,
    )
    if scene.elevation is None:
        return flat
    dx, dy = scene.elevation.cell_m
    return flat._replace(
        # A read-only array would be another type, and compiled for on its own.
        height=scene.elevation.height_m.copy(),
        height_dx=dx,
        height_dy=dy,
    )
