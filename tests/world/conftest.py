"""Random maps, and what shapely says about them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import shapely

from mrmg.world._kernels import FreeSpace
from mrmg.world.world import free_space


@dataclass(frozen=True)
class Map:
    """A free space and the same thing in exact geometry."""

    bounds: tuple[float, float, float, float]
    obstacles: shapely.Geometry
    space: FreeSpace

    def signed_distance_m(self, points: np.ndarray) -> np.ndarray:
        """Return the exact distance from obstacles and bounds, shape (n, 2) -> (n,)."""
        frame = shapely.box(*self.bounds)
        lines = shapely.union_all([frame.exterior, shapely.boundary(self.obstacles)])
        shapely.prepare(lines)
        at = shapely.points(points)
        free = shapely.contains(frame, at) & ~shapely.intersects(self.obstacles, at)
        return np.where(free, 1.0, -1.0) * shapely.distance(lines, at)

    def random_points(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """Return points within the bounds, shape (n, 2)."""
        x_min, y_min, x_max, y_max = self.bounds
        return rng.uniform((x_min, y_min), (x_max, y_max), (n, 2))


def random_polygon(rng: np.random.Generator, centre: np.ndarray) -> shapely.Polygon:
    """Return a star-shaped outline of 3 to 9 corners, every other one with a hole."""
    n = int(rng.integers(3, 10))
    angle = 2.0 * np.pi * (np.arange(n) + rng.uniform(0.0, 0.6, n)) / n
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outline = ring * rng.uniform(0.8, 5.0, (n, 1)) + centre
    shape = shapely.Polygon(outline)
    if rng.random() < 0.5:
        shape = shape.difference(shapely.Point(centre).buffer(0.5, quad_segs=2))
        shape = max(shapely.get_parts(shape), key=shapely.area)
    return shape


def random_map(seed: int) -> Map:
    """Return a map of odd size with obstacles that overlap, some with holes."""
    rng = np.random.default_rng(seed)
    low = rng.uniform(-20.0, 20.0, 2)
    high = low + rng.uniform(15.0, 35.0, 2)
    bounds = (*low.tolist(), *high.tolist())
    count = int(rng.integers(0, 8))
    obstacles = shapely.union_all(
        [random_polygon(rng, rng.uniform(low, high)) for _ in range(count)]
    )
    return Map(bounds, obstacles, free_space(bounds, obstacles, 2.0))


@pytest.fixture(scope="session")
def maps() -> list[Map]:
    """Twelve random maps; the first draws include one without obstacles."""
    return [
        Map((0.0, 0.0, 11.0, 9.0), empty, free_space((0.0, 0.0, 11.0, 9.0), empty, 2.0))
        for empty in [shapely.MultiPolygon()]
    ] + [random_map(seed) for seed in range(11)]


@pytest.fixture
def make_map() -> Callable[..., Map]:
    """Return a maker of maps from bounds, obstacles and reach."""

    def make(
        bounds: tuple[float, float, float, float],
        obstacles: shapely.Geometry,
        reach_m: float = 2.0,
    ) -> Map:
        return Map(bounds, obstacles, free_space(bounds, obstacles, reach_m))

    return make
