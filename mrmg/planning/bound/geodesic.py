"""Lower bounds of the cost of ways between regions, round obstacles and over terrain.

A way is that of the reference point. How far it keeps from obstacles (`clearance`) is
all that counts of the robot. The bounds come from certified fields (see
`_eikonal_kernels`), so they hold whatever the cell is; a finer one brings them nearer
to the truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import shapely

from mrmg.planning.bound import _eikonal_kernels
from mrmg.planning.bound._eikonal_kernels import UNREACHED
from mrmg.planning.bound.borders import ARCS, SPACING_M, border, distances_m
from mrmg.planning.bound.prices import least_prices
from mrmg.planning.halting import NEVER, check
from mrmg.scene.region import Region
from mrmg.scene.types import Scene

ROUNDS = 3
"""Solutions of the eikonal equation at most per field."""

BAND_SHARE = 0.25
"""Width of the levels of a field, as a share of a cell."""

ROUND_MARGIN = 1.02
"""Factor on radii of terrain's surroundings, whose arcs are drawn by chords."""

SEED_SHARE = 0.95
"""Steepness of a field next to its source, as a share of the price there."""


class Look(NamedTuple):
    """How values at points follow from those at nodes.

    Attributes:
        nodes: flat indices of the corners of a point's cell, row by row, shape (n, 4);
            each point is looked at from several cells.
        across, along: where in the cell it is, from 0 to 1, shape (n,).
        slack: how much a certified field can differ within reach, shape (n,).
        arc: which of ARCS equal runs of points each belongs to, shape (n,).
    """

    nodes: np.ndarray
    across: np.ndarray
    along: np.ndarray
    slack: np.ndarray
    arc: np.ndarray


@dataclass(frozen=True, slots=True)
class Field:
    """A certified field f(u).

    Attributes:
        values: u at the nodes, flat.
        level: levels of u, rising.
        certified: f there.
    """

    values: np.ndarray
    level: np.ndarray
    certified: np.ndarray

    def at(self, look: Look) -> np.ndarray:
        """Return f(u) at points, shape (n,)."""
        return self._certified(_on_triangles(self.values[look.nodes], look))

    def at_nodes(self) -> np.ndarray:
        """Return f(u) at all nodes, flat."""
        return self._certified(self.values)

    def lowest(self, look: Look) -> np.ndarray:
        """Return bounds of the least value on each arc, UNREACHED if blocked, (K,)."""
        low = np.full(ARCS, UNREACHED)
        np.minimum.at(low, look.arc, self.at(look) - look.slack)
        return low

    def highest(self, look: Look) -> float:
        """Return a bound of the greatest value at points; 0 if all are blocked."""
        value = self.at(look)
        high = (value + look.slack)[value < 0.5 * UNREACHED]
        return float(high.max()) if len(high) else 0.0

    def _certified(self, raw: np.ndarray) -> np.ndarray:
        certified = np.interp(raw, self.level, self.certified)
        return np.where(raw < 0.5 * UNREACHED, certified, UNREACHED)


@dataclass(frozen=True, slots=True)
class Ground:
    """Prices of driving, never above the true ones, on square cells.

    Attributes:
        x_min, y_min: corner of the first cell [m].
        cell_m: side of a cell.
        price: least multiplier within half a planning step of each cell, inf where
            blocked, shape (Y, X).
        blocked: where no way leads.
    """

    x_min: float
    y_min: float
    cell_m: float
    price: np.ndarray
    blocked: shapely.Geometry

    @staticmethod
    def of(
        scene: Scene,
        blocked: shapely.Geometry,
        *,
        cell_m: float,
        step_m: float,
    ) -> Ground:
        """Return the ground of a scene.

        Args:
            scene: the scene.
            blocked: where no way leads.
            cell_m: side of a cell.
            step_m: longest way of one planning step. A step is charged at its middle,
                which is at most half of it away from any point of it.
        """
        x_min, y_min, _, _ = scene.bounds
        reach_m = charged_within_m(step_m)
        price = least_prices(scene, blocked, cell_m=cell_m, reach_m=reach_m)
        return Ground(float(x_min), float(y_min), cell_m, price, blocked)

    def look_at(self, points: np.ndarray, reach_m: float) -> Look:
        """Return how a field's values at points follow from its nodes.

        A point stands for all free points within `reach_m`; it is looked at from every
        free cell that near, at that cell's nearest point.
        """
        rows, columns = self.price.shape
        place = (points - (self.x_min, self.y_min)) / self.cell_m
        reach = reach_m / self.cell_m + 1e-9
        shift = np.array([-reach, 0.0, reach])
        row = np.floor(place[:, 1] + shift[:, None, None]).astype(int)
        column = np.floor(place[:, 0] + shift[:, None]).astype(int)
        fine = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        index = np.arange(len(points))
        cell = np.unique(((index * rows + row) * columns + column)[fine])
        cell = cell[np.isfinite(self.price.reshape(-1)[cell % (rows * columns)])]
        index, row, column = np.unravel_index(cell, (len(points), rows, columns))
        fx = np.clip(place[index, 0] - column, 0.0, 1.0)
        fy = np.clip(place[index, 1] - row, 0.0, 1.0)
        corner = row * (columns + 1) + column
        nodes = np.stack(
            [corner, corner + 1, corner + columns + 1, corner + columns + 2], axis=1
        )
        arc = index * ARCS // max(ARCS, len(points))
        slack = self.price[row, column] * reach_m
        return Look(nodes, fx, fy, slack, arc)

    def field_from(self, region: Region) -> Field:
        """Return a certified field that grows away from a region."""
        rows, columns = self.price.shape
        y, x = np.mgrid[0 : rows + 1, 0 : columns + 1] * self.cell_m
        points = np.stack([x + self.x_min, y + self.y_min], axis=-1)
        away = -region.depth(points.reshape(-1, 2)).reshape(points.shape[:2])
        band = np.sqrt(2.0) * self.cell_m
        near = away <= band
        seed = SEED_SHARE * self._least_price(near) * np.maximum(away, -band)
        values, level, certified = _eikonal_kernels.certified_field(
            self.price,
            self.cell_m,
            np.where(near, seed, UNREACHED),
            ROUNDS,
            BAND_SHARE * self.cell_m,
        )
        return Field(values.reshape(-1), level, certified)

    def _least_price(self, near: np.ndarray) -> float:
        """Return the least price of cells with a corner among the given nodes."""
        touching = near[:-1, :-1] | near[1:, :-1] | near[:-1, 1:] | near[1:, 1:]
        prices = self.price[touching & np.isfinite(self.price)]
        return float(prices.min()) if prices.size else 1.0


def charged_within_m(step_m: float) -> float:
    """Return how far from a point of a planning step it may be charged [m]."""
    return ROUND_MARGIN * 0.5 * step_m


@dataclass(frozen=True, slots=True)
class Ways:
    """Lower bounds of the weighted length of ways between regions [m of plain ground].

    A way between regions that do not overlap leads from the border of one to the border
    of the other.

    Attributes:
        ground: prices of driving.
        regions: T convex sets.
        fields: one from each region.
        highest: bound of each region's own field on its border, shape (T,).
        lowest: bounds of each region's field on the arcs of borders, shape (T, T, K).
        between: from region to region, shape (T, T); 0 where they overlap.
        from_start: from start to region, shape (R, T); inf where there is no way.
    """

    ground: Ground
    regions: Sequence[Region]
    fields: list[Field]
    highest: np.ndarray
    lowest: np.ndarray
    between: np.ndarray
    from_start: np.ndarray

    @staticmethod
    def of(
        ground: Ground,
        regions: Sequence[Region],
        starts: np.ndarray,
        halt: np.ndarray = NEVER,
    ) -> Ways:
        """Bound all ways between regions, and from starts (R, 2) to regions.

        Raises:
            Halted: once `halt[0]` has turned true.
        """

        def field_from(region: Region) -> Field:
            check(halt)
            return ground.field_from(region)

        with ThreadPoolExecutor() as threads:
            fields = list(threads.map(field_from, regions))
        looks = [ground.look_at(border(one), 0.5 * SPACING_M) for one in regions]
        pairs = zip(fields, looks, strict=True)
        highest = np.array([field.highest(look) for field, look in pairs])
        check(halt)
        lowest = np.array([[field.lowest(look) for look in looks] for field in fields])
        check(halt)
        floor = float(np.min(ground.price, initial=1.0))
        apart_m = distances_m(regions)
        certified = lowest.min(axis=2, initial=UNREACHED) - highest[:, None]
        way = np.maximum(np.maximum(certified, floor * apart_m), 0.0)
        way = np.where(apart_m > 0.0, np.maximum(way, way.T), 0.0)
        start_way = np.zeros((len(starts), len(regions)))
        for r, start in enumerate(starts):
            check(halt)
            look = ground.look_at(start[None], 0.0)
            for i, field in enumerate(fields):
                apart = float(-regions[i].depth(start)[0])
                if apart > 0.0:
                    certified = field.lowest(look).min() - highest[i]
                    start_way[r, i] = max(certified, floor * apart, 0.0)
        for table in (way, start_way):
            table[table > 0.5 * UNREACHED] = np.inf
        return Ways(
            ground=ground,
            regions=regions,
            fields=fields,
            highest=highest,
            lowest=lowest,
            between=way,
            from_start=start_way,
        )

    def among(self, count: int) -> Ways:
        """Return the ways of the first regions alone."""
        return replace(
            self,
            regions=self.regions[:count],
            fields=self.fields[:count],
            highest=self.highest[:count],
            lowest=self.lowest[:count, :count],
            between=self.between[:count, :count],
            from_start=self.from_start[:, :count],
        )


def _on_triangles(corner: np.ndarray, look: Look) -> np.ndarray:
    """Return a field's values, shape (n, 4) -> (n,), as it is certified.

    Cells are cut along the diagonal that leaves their two triangles the flatter
    (`_eikonal_kernels.steepness`).
    """
    a, b, c, d = corner.T
    x, y = look.across, look.along
    low, high = (b - a) ** 2, (d - c) ** 2
    left, right = (c - a) ** 2, (d - b) ** 2
    cut_from_a = np.maximum(low + right, high + left)
    cut_from_b = np.maximum(low + left, high + right)
    of_a = a + np.where(x >= y, x * (b - a) + y * (d - b), x * (d - c) + y * (c - a))
    near = a + x * (b - a) + y * (c - a)
    of_b = np.where(x + y <= 1.0, near, d + (1 - x) * (c - d) + (1 - y) * (b - d))
    return np.asarray(np.where(cut_from_a < cut_from_b, of_a, of_b))
