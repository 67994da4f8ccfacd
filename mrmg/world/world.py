"""The world a planner queries: free space per set of obstacles, and terrain grids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from mrmg.scene.types import Scene
from mrmg.world import _raster_kernels
from mrmg.world._kernels import UNIFORM_TURNING, FreeSpace, TerrainGrid

CELL_M = 0.25
"""Side of a cell of the distance field and of the terrain grid."""

BUCKET_M = 2.0
"""Side of a bucket of obstacle edges."""

MARGIN_M = 1.0
"""Largest clearance that footprint tests use."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """A place where robots keep less than their margin from obstacles.

    Attributes:
        shape: where their bodies' middles are meanwhile.
        allowance_m: by how much what they keep there is less than their margin.
        robots: their numbers.
    """

    shape: BaseGeometry
    allowance_m: float
    robots: tuple[int, ...]


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
    def from_scene(
        scene: Scene,
        *,
        cell_m: float = CELL_M,
        openings: Sequence[Opening] = (),
        guide_m: float = 0.0,
    ) -> World:
        """Prepare `scene`.

        Args:
            scene: the scene.
            cell_m: side of a cell of the grids.
            openings: places where robots keep less than their margins.
            guide_m: what distances in openings count for besides their allowances.
        """
        reach = MARGIN_M + max(
            robot.model.circumscribed_radius_m for robot in scene.robots
        )
        keys = [
            (
                tuple(i for i, o in enumerate(scene.barriers) if o.stops(robot.id)),
                tuple(i for i, o in enumerate(openings) if number in o.robots),
            )
            for number, robot in enumerate(scene.robots)
        ]
        distinct = list(dict.fromkeys(keys))
        unions = tuple(
            shapely.union_all([scene.barriers[i].shape for i in key])
            for key, _ in distinct
        )
        spaces = [free_space(scene.bounds, union, reach, cell_m) for union in unions]
        if openings:
            spaces = [
                with_openings(space, [openings[i] for i in own], guide_m)
                for space, (_, own) in zip(spaces, distinct, strict=True)
            ]
        return World(
            spaces=tuple(spaces),
            space_of_robot=np.array([distinct.index(key) for key in keys]),
            obstacles=unions,
            terrain=_terrain_grid(scene, cell_m),
        )


def free_space(
    bounds: tuple[float, float, float, float],
    obstacles: shapely.Geometry,
    reach: float,
    cell_m: float = CELL_M,
) -> FreeSpace:
    """Return the free space inside `bounds` outside `obstacles`.

    Args:
        bounds: (x_min, y_min, x_max, y_max) [m].
        obstacles: a polygon or multipolygon, possibly empty.
        reach: largest radius plus margin a footprint test will use [m].
        cell_m: side of a cell of the distance field.
    """
    x_min, y_min, x_max, y_max = bounds
    solid = _edges(obstacles)
    edge = np.concatenate([_edges(shapely.box(*bounds)), solid])
    columns, rows = _cells(bounds, cell_m)
    grid = float(x_min), float(y_min), cell_m, rows, columns
    distance = _raster_kernels.edge_distance_field(edge, *grid)
    inside = _raster_kernels.cells_inside(solid, *grid)
    inside[:, x_min + (np.arange(columns) + 0.5) * cell_m > x_max] = True
    inside[y_min + (np.arange(rows) + 0.5) * cell_m > y_max] = True
    bucket_columns, bucket_rows = _cells(bounds, BUCKET_M)
    near, bucket = _raster_kernels.buckets_near(
        edge, x_min, y_min, BUCKET_M, bucket_rows, bucket_columns,
        reach + BUCKET_M / np.sqrt(2.0),
    ).T  # fmt: skip
    buckets = bucket_rows * bucket_columns
    return FreeSpace(
        x_min=float(x_min),
        y_min=float(y_min),
        cell=cell_m,
        distance=np.where(inside, -distance, distance),
        bucket=BUCKET_M,
        bucket_columns=bucket_columns,
        bucket_rows=bucket_rows,
        bucket_start=np.cumsum([0, *np.bincount(bucket, minlength=buckets)]),
        bucket_edge=near[np.argsort(bucket, kind="stable")],
        reach=float(reach),
        edge=edge,
        allowance=np.zeros((0, 0)),
        guide=0.0,
    )


def with_openings(
    space: FreeSpace, openings: Sequence[Opening], guide_m: float
) -> FreeSpace:
    """Return a free space whose distances count allowances in openings as clearance.

    Args:
        space: without openings.
        openings: of the robots that it is for; of two at a place the larger allowance
            counts.
        guide_m: what distances in them count for besides.
    """
    rows, columns = space.distance.shape
    x = space.x_min + (np.arange(columns) + 0.5) * space.cell
    y = space.y_min + (np.arange(rows) + 0.5) * space.cell
    allowance = np.full((rows, columns), -1.0)
    for opening in openings:
        x_low, y_low, x_high, y_high = opening.shape.bounds
        across = slice(*np.searchsorted(x, (x_low, x_high)))
        up = slice(*np.searchsorted(y, (y_low, y_high)))
        inside = shapely.contains_xy(opening.shape, x[None, across], y[up, None])
        own = np.where(inside, opening.allowance_m, -1.0)
        allowance[up, across] = np.maximum(allowance[up, across], own)
    raised = np.where(allowance >= 0.0, allowance + guide_m, 0.0)
    return space._replace(
        distance=space.distance + raised, allowance=allowance, guide=float(guide_m)
    )


def _cells(bounds: tuple[float, float, float, float], side_m: float) -> tuple[int, int]:
    """Return how many cells cover bounds along x and y."""
    x_min, y_min, x_max, y_max = bounds
    return int(np.ceil((x_max - x_min) / side_m)), int(
        np.ceil((y_max - y_min) / side_m)
    )


def _edges(geometry: shapely.Geometry) -> np.ndarray:
    """Return the edges of polygons, (x0, y0, x1, y1) in m, shape (n, 4)."""
    rings = shapely.get_rings(shapely.get_parts(geometry))
    corners = [shapely.get_coordinates(ring) for ring in rings]
    edges = [np.hstack([ring[:-1], ring[1:]]) for ring in corners]
    return np.concatenate([np.zeros((0, 4)), *edges])


def _terrain_grid(scene: Scene, cell_m: float) -> TerrainGrid:
    x_min, y_min, _, _ = scene.bounds
    columns, rows = _cells(scene.bounds, cell_m)
    grid = float(x_min), float(y_min), cell_m, rows, columns
    multiplier = np.ones((rows, columns))
    turning = np.ones((rows, columns))
    for area in scene.terrain:
        inside = _raster_kernels.cells_inside(_edges(area.shape), *grid)
        multiplier[inside] = area.multiplier
        turning[inside] = area.turning_multiplier
    flat = TerrainGrid(
        x_min=float(x_min),
        y_min=float(y_min),
        cell=cell_m,
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
