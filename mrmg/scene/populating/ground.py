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
from shapely.geometry.base import BaseGeometry

# Half of the 16 directions to neighbours; the graph is symmetric. With knight's moves a
# path over the grid is at most 2.8 % longer than the straight line.
_OFFSETS = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))

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
        step = np.array(
            [
                (self.points_m[:, 0].max() - self.points_m[:, 0].min()) / (columns - 1),
                (self.points_m[:, 1].max() - self.points_m[:, 1].min()) / (rows - 1),
            ]
        )
        heads, tails, costs = [], [], []
        for dx, dy in _OFFSETS:
            tail = _shifted(index, 0, 0, dx, dy)
            head = _shifted(index, dx, dy, dx, dy)
            passable = _shifted(free, 0, 0, dx, dy) & _shifted(free, dx, dy, dx, dy)
            for mx, my in _between(dx, dy):
                passable &= _shifted(free, mx, my, dx, dy)
            tail, head = tail[passable], head[passable]
            mean = 0.5 * (self.multiplier[tail] + self.multiplier[head])
            heads.append(head)
            tails.append(tail)
            costs.append(np.hypot(*(step * (dx, dy))) * mean)
        size = rows * columns
        entries = (
            np.concatenate(costs),
            (np.concatenate(tails), np.concatenate(heads)),
        )
        half = coo_array(entries, shape=(size, size))
        return csr_array(half + half.T)

    @cached_property
    def component(self) -> np.ndarray:
        """Number of the connected free area of each point; -1 where not free."""
        _, label = connected_components(self.roads, directed=False)
        return np.where(self.free, label, -1)

    def nearest(self, point: Sequence[float]) -> int:
        """Return the index of the nearest free grid point."""
        offset = self.points_m - np.asarray(point)
        distance = np.where(self.free, np.hypot(offset[:, 0], offset[:, 1]), np.inf)
        return int(distance.argmin())

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
    outline = shapely.box(*bounds).exterior
    rings: list[BaseGeometry] = [outline, *(shape.boundary for shape in obstacles)]
    sides = np.concatenate([_sides(ring) for ring in rings])
    tree = shapely.STRtree(sides)
    _, distance = tree.query_nearest(
        shapely.points(points), return_distance=True, all_matches=False
    )
    blocked = shapely.contains_xy(shapely.union_all(list(obstacles)), points)
    return np.asarray(np.where(blocked, -distance, distance))


def _sides(lines: BaseGeometry) -> np.ndarray:
    coordinates, ring = shapely.get_coordinates(
        shapely.get_parts(lines), return_index=True
    )
    same = ring[1:] == ring[:-1]
    pairs = np.stack([coordinates[:-1], coordinates[1:]], axis=1)[same]
    return np.asarray(shapely.linestrings(pairs))


def _shifted(grid: np.ndarray, x: int, y: int, dx: int, dy: int) -> np.ndarray:
    """Return the grid moved by (x, y), cut to where a step (dx, dy) stays inside."""
    rows, columns = grid.shape
    low = max(0, -dy)
    return grid[low + y : rows - max(0, dy) + y, x : columns - max(0, dx) + x]


def _between(dx: int, dy: int) -> list[tuple[int, int]]:
    """Return the cells a knight's move passes over."""
    sign = 1 if dy > 0 else -1
    if abs(dx) == 2:
        return [(1, 0), (1, sign)]
    if abs(dy) == 2:
        return [(0, sign), (1, sign)]
    return []
