"""A grid over a map: where a robot may stand, and how far apart places are by road."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra, shortest_path
from shapely.geometry import Polygon

_STEPS = {
    (1, 0): (),
    (0, 1): (),
    (1, 1): (),
    (1, -1): (),
    (2, 1): ((1, 0), (1, 1)),
    (1, 2): ((0, 1), (1, 1)),
    (2, -1): ((1, 0), (1, -1)),
    (1, -2): ((0, -1), (1, -1)),
}
"""Half of the 16 steps to neighbours, and the cells that each passes over; the graph is
symmetric. With knight's moves a path over the grid is at most 2.8 % longer than the
straight line."""

_FEW_PLACES = 300
"""Places between which all costs are found on the grid itself."""

_REACH = 6.0
"""How far places are joined to others, as a multiple of their mean spacing."""

_AT_ONCE = 16
"""Places from which costs are found in one call, which is soon interrupted."""


@dataclass(frozen=True, kw_only=True)
class Ground:
    """A regular grid of points over a map.

    Attributes:
        points_m: all grid points, row by row, shape (rows * columns, 2).
        shape: (rows, columns).
        cell_m: spacing.
        clearance_m: distance of each point to the nearest obstacle or bound; negative
            where blocked. Shape (rows * columns,).
        multiplier: terrain at each point.
        margin_m: clearance from which on a robot may be at a point.
    """

    points_m: np.ndarray
    shape: tuple[int, int]
    cell_m: float
    clearance_m: np.ndarray
    multiplier: np.ndarray
    margin_m: float

    @staticmethod
    def over(
        bounds: Sequence[float],
        obstacles: Sequence[Polygon],
        terrain: Sequence[tuple[Polygon, float]],
        *,
        margin_m: float,
        cell_m: float = 0.5,
    ) -> Ground:
        """Lay a grid over a map.

        Args:
            bounds: (x_min, y_min, x_max, y_max) [m].
            obstacles: what no robot may touch.
            terrain: areas and their multipliers; the later one counts.
            margin_m: clearance a robot's reference point needs to pass.
            cell_m: spacing of the grid.
        """
        x_min, y_min, x_max, y_max = bounds
        columns = max(2, round((x_max - x_min) / cell_m))
        rows = max(2, round((y_max - y_min) / cell_m))
        x = x_min + (np.arange(columns) + 0.5) * (x_max - x_min) / columns
        y = y_min + (np.arange(rows) + 0.5) * (y_max - y_min) / rows
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        multiplier = np.ones(len(points))
        for area, value in terrain:
            multiplier[shapely.contains_xy(area, points)] = value
        return Ground(
            points_m=points,
            shape=(rows, columns),
            cell_m=cell_m,
            clearance_m=_clearance(points, bounds, obstacles),
            multiplier=multiplier,
            margin_m=margin_m,
        )

    @cached_property
    def free(self) -> np.ndarray:
        """Where a robot may be, shape (rows * columns,), boolean."""
        return self.clearance_m >= self.margin_m

    @cached_property
    def roads(self) -> csr_array:
        """Costs between neighbouring free points [m of plain ground], symmetric."""
        rows, columns = self.shape
        index = np.arange(rows * columns).reshape(rows, columns)
        free = self.free.reshape(rows, columns)
        spacing_m = np.ptp(self.points_m, axis=0) / (columns - 1, rows - 1)
        links = []
        for (dx, dy), passed in _STEPS.items():
            passable = np.logical_and.reduce(
                [_shifted(free, x, y, dx, dy) for x, y in ((0, 0), (dx, dy), *passed)]
            )
            tail = _shifted(index, 0, 0, dx, dy)[passable]
            head = _shifted(index, dx, dy, dx, dy)[passable]
            mean = 0.5 * (self.multiplier[tail] + self.multiplier[head])
            links.append((np.hypot(*(spacing_m * (dx, dy))) * mean, tail, head))
        cost, tail, head = map(np.concatenate, zip(*links, strict=True))
        half = coo_array((cost, (tail, head)), shape=(index.size, index.size))
        return csr_array(half + half.T)

    @cached_property
    def largest(self) -> np.ndarray:
        """Mask of the largest connected free area, shape (rows * columns,)."""
        _, label = connected_components(self.roads, directed=False)
        sizes = np.bincount(label, weights=self.free)
        return np.asarray(self.free & (label == sizes.argmax()))

    def distances(self, sources: Sequence[int]) -> np.ndarray:
        """Return costs from `sources` to all points [m], shape (n, rows * columns)."""
        # One source at a time: SciPy holds the interpreter's lock, and Ctrl-C waits.
        return np.array([dijkstra(self.roads, indices=source) for source in sources])

    def between(self, places: Sequence[int]) -> np.ndarray:
        """Return costs from place to place [m], shape (n, n).

        Many places are joined to those about them only, and costs between others lead
        over places: they are a percent or two more than on the grid.
        """
        if len(places) <= _FEW_PLACES:
            return np.array([self.distances([one])[0, places] for one in places])
        spacing_m = math.sqrt(self.free.sum() / len(places)) * self.cell_m
        reach_m = _REACH * spacing_m * float(np.median(self.multiplier[self.free]))
        while True:
            near = np.concatenate(
                [
                    dijkstra(self.roads, indices=some, limit=reach_m)[:, places]
                    for some in np.array_split(places, len(places) // _AT_ONCE)
                ]
            )
            costs = shortest_path(np.where(np.isfinite(near), near, 0.0), method="D")
            if np.isfinite(costs).all():
                return np.asarray(costs)
            reach_m *= 2.0

    def road_to_nearest(self, targets: np.ndarray) -> np.ndarray:
        """Return the cost from every point to the nearest of `targets` [m]."""
        if not len(targets):
            return np.full(len(self.points_m), np.inf)
        cost = dijkstra(self.roads, indices=targets, min_only=True)
        return np.asarray(cost)

    def clearance_at(self, points: np.ndarray) -> np.ndarray:
        """Return the clearance at the grid points nearest to `points` [m]."""
        rows, columns = self.shape
        low, high = self.points_m[0], self.points_m[-1]
        share = (points - low) / (high - low)
        cell = np.rint(share * [columns - 1, rows - 1]).astype(int)
        inside = ((cell >= 0) & (cell < [columns, rows])).all(axis=1)
        cell = np.clip(cell, 0, [columns - 1, rows - 1])
        clearance = self.clearance_m[cell[:, 1] * columns + cell[:, 0]]
        return np.where(inside, clearance, -np.inf)


def _clearance(
    points: np.ndarray, bounds: Sequence[float], obstacles: Sequence[Polygon]
) -> np.ndarray:
    boundaries = [shape.boundary for shape in (shapely.box(*bounds), *obstacles)]
    corners, ring = shapely.get_coordinates(
        shapely.get_parts(boundaries), return_index=True
    )
    sides = np.stack([corners[:-1], corners[1:]], axis=1)[ring[1:] == ring[:-1]]
    tree = shapely.STRtree(shapely.linestrings(sides))
    _, distance = tree.query_nearest(
        shapely.points(points), return_distance=True, all_matches=False
    )
    blocked = shapely.contains_xy(shapely.union_all(list(obstacles)), points)
    return np.asarray(np.where(blocked, -distance, distance))


def _shifted(grid: np.ndarray, x: int, y: int, dx: int, dy: int) -> np.ndarray:
    """Return the grid moved by (x, y), cut to where a step (dx, dy) stays inside."""
    rows, columns = grid.shape
    low = max(0, -dy)
    return grid[low + y : rows - max(0, dy) + y, x : columns - max(0, dx) + x]
