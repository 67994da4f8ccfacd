"""The world a planner asks: free space per set of obstacles, and terrain, on grids."""

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
        terrain: multipliers of rolling and turning, and relief.
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
            margin_m: largest clearance that footprint tests will ask for.
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
        reach: largest radius plus margin a footprint test will ask for [m].
    """
    x_min, y_min, x_max, y_max = bounds
    rings = [
        np.asarray(ring.coords)[:-1]
        for polygon in _polygons(obstacles)
        for ring in (polygon.exterior, *polygon.interiors)
    ]
    frame = np.array([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])
    edge = np.concatenate(
        [np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in (frame, *rings)]
    )
    columns, rows = (
        int(np.ceil((high - low) / CELL_M))
        for low, high in ((x_min, x_max), (y_min, y_max))
    )
    distance = _raster_kernels.edge_distance_field(
        edge, x_min, y_min, CELL_M, rows, columns
    )
    ring_start = np.cumsum([0, *(len(ring) for ring in rings)])
    points = np.concatenate(rings) if rings else np.zeros((0, 2))
    inside = _raster_kernels.fill_rings(
        ring_start, points, x_min, y_min, CELL_M, rows, columns
    )
    center_x = x_min + (np.arange(columns) + 0.5) * CELL_M
    center_y = y_min + (np.arange(rows) + 0.5) * CELL_M
    inside |= (center_x > x_max)[None, :] | (center_y > y_max)[:, None]
    bucket_columns, bucket_rows = (
        int(np.ceil((high - low) / BUCKET_M))
        for low, high in ((x_min, x_max), (y_min, y_max))
    )
    bucket_start, bucket_edge = _raster_kernels.bucket_edges(
        edge, x_min, y_min, BUCKET_M, bucket_columns, bucket_rows, reach
    )
    _raster_kernels.correct_near(
        distance,
        edge,
        bucket_start,
        bucket_edge,
        x_min,
        y_min,
        CELL_M,
        BUCKET_M,
        bucket_columns,
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


def _polygons(geometry: shapely.Geometry) -> list[Polygon]:
    return [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon)]


def _terrain_grid(scene: Scene) -> TerrainGrid:
    x_min, y_min, x_max, y_max = scene.bounds
    columns = max(1, int(np.ceil((x_max - x_min) / CELL_M)))
    rows = max(1, int(np.ceil((y_max - y_min) / CELL_M)))
    multiplier = np.ones((rows, columns))
    turning = np.ones((rows, columns))
    for area in scene.terrain:
        points = np.asarray(area.shape.exterior.coords)[:-1]
        rings = [points, *(np.asarray(r.coords)[:-1] for r in area.shape.interiors)]
        inside = _raster_kernels.fill_rings(
            np.cumsum([0, *(len(ring) for ring in rings)]),
            np.concatenate(rings),
            float(x_min),
            float(y_min),
            CELL_M,
            rows,
            columns,
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
