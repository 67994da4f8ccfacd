"""How much harder it is to drive at a place: the terrain's multipliers."""

from __future__ import annotations

import numpy as np
import shapely

from mrmg.scene.types import Scene


def multiplier_at(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return the multiplier of rolling at each point, shape (n, 2) -> (n,).

    Polygons count exactly. Where areas overlap, the later one of the scene counts;
    elsewhere it is 1.
    """
    multiplier = np.array([1.0, *(area.multiplier for area in scene.terrain)])
    return np.asarray(multiplier[area_at(scene, points)])


def turning_multiplier_at(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return the multiplier of turning at each point, shape (n, 2) -> (n,)."""
    multiplier = np.array([1.0, *(area.turning_multiplier for area in scene.terrain)])
    if np.all(multiplier == 1.0):
        return np.ones(len(np.atleast_2d(points)))
    return np.asarray(multiplier[area_at(scene, points)])


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
