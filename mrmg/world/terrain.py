"""How much harder it is to drive at a place: the terrain's multipliers."""

from __future__ import annotations

import numpy as np
import shapely

from mrmg.scene.types import Scene


def multiplier_at(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return the multiplier of rolling at each point, shape (n, 2) -> (n,)."""
    return np.asarray(multipliers_at(scene, points)[0])


def multipliers_at(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return the multipliers of rolling and of turning at each point, shape (2, n).

    Polygons count exactly. Where areas overlap, the later one of the scene counts;
    elsewhere both are 1.
    """
    of_areas = [(area.multiplier, area.turning_multiplier) for area in scene.terrain]
    multipliers = np.array([(1.0, 1.0), *of_areas])
    return np.asarray(multipliers.T[:, area_at(scene, points)])


def area_at(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return the number of the area at each point, from 1; 0 for plain ground."""
    points = np.atleast_2d(points)
    number = np.zeros(len(points), dtype=int)
    for index, area in enumerate(scene.terrain, start=1):
        x_min, y_min, x_max, y_max = area.shape.bounds
        x, y = points.T
        near = (x >= x_min) & (x <= x_max) & (y >= y_min) & (y <= y_max)
        (near,) = near.nonzero()
        inside = shapely.contains_xy(area.shape, x[near], y[near])
        number[near[inside]] = index
    return number
