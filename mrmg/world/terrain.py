"""How much harder it is to drive at a place: the terrain's energy multiplier."""

from __future__ import annotations

import numpy as np
import shapely

from mrmg.scene.types import Scene


def multiplier_at(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return the multiplier at each point, shape (n, 2) -> (n,); exact polygons.

    Where areas overlap, the later one of the scene counts; elsewhere it is 1.
    """
    points = np.atleast_2d(points)
    multiplier = np.ones(len(points))
    for area in scene.terrain:
        x_min, y_min, x_max, y_max = area.shape.bounds
        x, y = points.T
        near = (x >= x_min) & (x <= x_max) & (y >= y_min) & (y <= y_max)
        (near,) = near.nonzero()
        inside = shapely.contains_xy(area.shape, x[near], y[near])
        multiplier[near[inside]] = area.multiplier
    return multiplier
