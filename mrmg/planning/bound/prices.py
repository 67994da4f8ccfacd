"""Prices of driving on square cells: never above the true ones, inf where blocked.

Cells are split from large to small, and only those that a line between two prices runs
through; the others have one price all over.
"""

from __future__ import annotations

import numpy as np
import shapely

from mrmg.scene.types import Scene

SPLITS = 4
"""Times that the largest cells are halved."""


def least_prices(
    scene: Scene, blocked: shapely.Geometry, *, cell_m: float, reach_m: float
) -> np.ndarray:
    """Return the least multiplier within reach of each cell.

    Args:
        scene: gives bounds and terrain.
        blocked: where nothing can be; cells wholly in it cost inf.
        cell_m: side of a cell; the first begins at the bounds' lower corner.
        reach_m: how far from a cell terrain counts.

    Returns:
        Shape (Y, X).
    """
    x_min, y_min, x_max, y_max = scene.bounds
    columns = len(np.arange(x_min, x_max, cell_m))
    rows = len(np.arange(y_min, y_max, cell_m))
    areas = surroundings(scene, reach_m)
    lines = shapely.union_all(
        [blocked.boundary, *(one.boundary for area in areas for one in area[:2])]
    )
    for shape in (blocked, lines, *(one for area in areas for one in area[:2])):
        shapely.prepare(shape)
    step = 1 << SPLITS
    price = np.ones((-(-rows // step) * step, -(-columns // step) * step))
    row, column = (part.ravel() for part in np.mgrid[:rows:step, :columns:step])
    while len(row):
        low_x, low_y = x_min + column * cell_m, y_min + row * cell_m
        size = step * cell_m
        boxes = shapely.box(low_x, low_y, low_x + size, low_y + size)
        value = np.ones(len(boxes))
        for near, sure, multiplier in areas:
            touched = shapely.intersects(near, boxes)
            value[touched] = np.minimum(value[touched], multiplier)
            value[shapely.covers(sure, boxes)] = multiplier
        value[shapely.covers(blocked, boxes)] = np.inf
        within = np.arange(step)
        price[
            (row[:, None] + within)[:, :, None], (column[:, None] + within)[:, None]
        ] = value[:, None, None]
        if step == 1:
            break
        mixed = shapely.intersects(lines, boxes)
        step //= 2
        row = np.concatenate([row[mixed] + i * step for i in (0, 0, 1, 1)])
        column = np.concatenate([column[mixed] + j * step for j in (0, 1, 0, 1)])
    return price[:rows, :columns]


def surroundings(
    scene: Scene, reach_m: float
) -> list[tuple[shapely.Geometry, shapely.Geometry, float]]:
    """Return what lies within reach of each area, what does for sure, and its price."""
    return [
        (area.shape.buffer(reach_m), area.shape.buffer(-reach_m), area.multiplier)
        for area in scene.terrain
    ]
