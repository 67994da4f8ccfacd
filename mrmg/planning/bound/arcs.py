"""Lower bounds of ways between arcs of regions' borders.

Where a robot first touches a region decides how far it is to the next. Borders are cut
into arcs of equal length; between arcs holds

- the straight distance at the least price there is,
- the bound of all ways from one region to the other arc (`geodesic.Ways`),
- for pairs of interest, what a wave from a start certifies, or a plane wave that leaves
  a region in the direction that the way from a given arc takes. It is computed on finer
  cells, in a window that ways of interest do not leave: a way that does costs at least
  what it costs to the window's border and on from there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import shapely

from mrmg.planning.bound._eikonal_kernels import UNREACHED
from mrmg.planning.bound.borders import (
    ARCS,
    SPACING_M,
    arc_lines,
    border,
    sagitta_m,
)
from mrmg.planning.bound.geodesic import Field, Ground, Look, Ways
from mrmg.scene.region import Region

SECTORS = 64
"""Directions that waves leave regions in."""

WINDOW_M = 8.0
"""By how much ways that leave a window are longer than the least way, if they can."""


class Wave(NamedTuple):
    """A wave that spreads from a region or a start, and certifies ways from there.

    Attributes:
        source: a region, or a start (-1 - r).
        sink: the region that the ways lead to.
        sector: of the direction in which it leaves a region.
    """

    source: int
    sink: int
    sector: int


@dataclass(slots=True)
class ArcWays:
    """Ways between the arcs of T regions [m of plain ground], tightened on demand.

    Attributes:
        ways: between whole regions.
        fine: ground of finer cells: each of the ways' cells in equal parts.
        between: from arc to arc, shape (T, K, T, K), symmetric.
        from_start: from start to arc, shape (R, T, K).
        starts: shape (R, 2).
        known: waves that were taken.
        cost: least cost from regions and starts to each node, as far as asked for.
    """

    ways: Ways
    fine: Ground
    between: np.ndarray
    from_start: np.ndarray
    starts: np.ndarray
    known: set[Wave] = field(default_factory=set)
    cost: dict[int, np.ndarray] = field(default_factory=dict)

    @staticmethod
    def of(ways: Ways, fine: Ground, starts: np.ndarray) -> ArcWays:
        """Bound all ways between arcs, and from starts to arcs."""
        regions, count = ways.regions, len(ways.regions)
        reach = ways.lowest - ways.highest[:, None, None]
        lines = np.array([line for region in regions for line in arc_lines(region)])
        depth_m = max((sagitta_m(region) for region in regions), default=0.0)
        floor = float(np.min(ways.ground.price, initial=1.0))
        between = np.maximum(0.0, reach[:, None])
        between = np.maximum(between, reach.transpose(1, 2, 0)[..., None])
        between = between.reshape(len(lines), len(lines))
        # How far arcs are apart takes its time: it is asked where it may tell more.
        middle = shapely.get_coordinates(
            shapely.line_interpolate_point(lines, 0.5, normalized=True)
        )
        most = floor * np.hypot(*(middle[:, None] - middle).T)
        first, second = np.nonzero(np.triu(most > between, 1))
        apart = shapely.distance(lines[first], lines[second]) - 2.0 * depth_m
        apart = np.maximum(between[first, second], floor * apart)
        between[first, second] = between[second, first] = apart
        between = between.reshape(count, ARCS, count, ARCS)
        points = shapely.points(starts)[:, None]
        away = floor * (shapely.distance(points, lines[None]) - depth_m)
        from_start = np.maximum(
            away.reshape(len(starts), count, ARCS), ways.from_start[..., None]
        )
        between.transpose(0, 2, 1, 3)[ways.overlap] = 0.0
        from_start[ways.from_start == 0.0] = 0.0
        for table in (between, from_start):
            table[table > 0.5 * UNREACHED] = np.inf
        return ArcWays(ways, fine, between, from_start, starts)

    def waves(self, origin: int, from_arc: int, target: int, to_arc: int) -> list[Wave]:
        """Return the waves that tell most of ways between arcs, but for those known.

        Args:
            origin: a region, or a start (-1 - r).
            from_arc: of the origin's border; 0 for a start.
            target: a region.
            to_arc: of its border.
        """
        if origin == target or not 0.0 < self._least(origin, target) < np.inf:
            return []
        if origin < 0:
            found = [Wave(origin, target, 0)]
        else:
            found = [
                Wave(origin, target, self._sector(origin, from_arc, target)),
                Wave(target, origin, self._sector(target, to_arc, origin)),
            ]
        return [wave for wave in found if wave not in self.known]

    def certificate(self, wave: Wave) -> np.ndarray:
        """Return what a wave certifies of ways from arc to arc, shape (K, K).

        From a start the first axis has length 1.
        """
        source, sink, sector = wave
        window, outside_m = self._window(source, sink, self._least(source, sink))
        away = window.look_at(border(self.ways.regions[sink]), 0.5 * SPACING_M)
        field: Field | None
        if source < 0:
            point = self.starts[-1 - source]
            region = Region(center=point, radius_m=0.0, corners=np.zeros((0, 2)))
            field, here = window.field_from(region), window.look_at(point[None], 0.0)
        else:
            region = self.ways.regions[source]
            angle = 2.0 * np.pi * sector / SECTORS
            heading = np.array([np.cos(angle), np.sin(angle)])
            field = window.wave_from(region, heading)
            here = window.look_at(border(region), 0.5 * SPACING_M)
        if field is None or not _all_reached(field, here, away):
            return np.zeros((1, 1))
        highest = field.highest(here)[: ARCS if source >= 0 else 1]
        apart = field.lowest(away) - highest[:, None]
        return np.asarray(np.minimum(apart, outside_m))

    def take(self, wave: Wave, apart: np.ndarray) -> None:
        """Tighten ways by a wave's certificate."""
        self.known.add(wave)
        if wave.source < 0:
            old = self.from_start[-1 - wave.source, wave.sink]
            np.maximum(old, apart[0], out=old)
        else:
            old = self.between[wave.source, :, wave.sink]
            np.maximum(old, apart, out=old)
            self.between[wave.sink, :, wave.source] = old.T

    def _least(self, origin: int, target: int) -> float:
        """Return the bound of all ways to a region from another one or a start."""
        ways = self.ways
        if origin < 0:
            return float(ways.from_start[-1 - origin, target])
        return float(ways.between[origin, target])

    def _sector(self, source: int, arc: int, sink: int) -> int:
        """Return the sector in which the way from an arc to a region sets out."""
        points = border(self.ways.regions[source])
        middle = points[(2 * arc + 1) * len(points) // (2 * ARCS)]
        x, y = -self._slope(sink, middle)
        return round(SECTORS * float(np.arctan2(y, x)) / (2.0 * np.pi)) % SECTORS

    def _slope(self, source: int, point: np.ndarray) -> np.ndarray:
        """Return the gradient of a region's field about a point, shape (2,)."""
        ground = self.ways.ground
        rows, columns = ground.price.shape
        field = self._cost_to(source)
        column, row = ((point - (ground.x_min, ground.y_min)) / ground.cell_m).astype(
            int
        )
        row, column = min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)
        a, b, c, d = field[row : row + 2, column : column + 2].ravel()
        return np.array([b - a + d - c, c - a + d - b])

    def _window(self, origin: int, target: int, least: float) -> tuple[Ground, float]:
        """Return a part of the fine ground, and the least cost of ways out of it."""
        ground = self.ways.ground
        rows, columns = ground.price.shape
        total = self._cost_to(origin) + self._cost_to(target)
        near = total <= least + WINDOW_M
        row, column = (np.flatnonzero(near.any(axis=axis)) for axis in (1, 0))
        low_i, high_i = max(0, row[0] - 1), min(rows, row[-1] + 1)
        low_j, high_j = max(0, column[0] - 1), min(columns, column[-1] + 1)
        sides = []
        if low_i > 0:
            sides.append((low_i, slice(low_j, high_j + 1)))
        if high_i < rows:
            sides.append((high_i, slice(low_j, high_j + 1)))
        if low_j > 0:
            sides.append((slice(low_i, high_i + 1), low_j))
        if high_j < columns:
            sides.append((slice(low_i, high_i + 1), high_j))
        outside_m = np.inf
        for side in sides:
            ends = [self._cost_to(one)[side] for one in (origin, target)]
            least_m = sum(np.minimum(end[:-1], end[1:]) for end in ends)
            outside_m = min(outside_m, float(np.min(least_m)))
        parts = round(ground.cell_m / self.fine.cell_m)
        window = self.fine.part(
            slice(parts * low_i, parts * high_i), slice(parts * low_j, parts * high_j)
        )
        return window, outside_m

    def _cost_to(self, place: int) -> np.ndarray:
        """Return the least cost from a region or start to each node."""
        if place not in self.cost:
            self.cost[place] = self._spread(place)
        return self.cost[place]

    def _spread(self, place: int) -> np.ndarray:
        """Work out the least cost from a region or start to each node."""
        ground = self.ways.ground
        if place < 0:
            offset = ground.nodes() - self.starts[-1 - place]
            floor = float(np.min(ground.price, initial=1.0))
            return np.asarray(floor * np.hypot(offset[..., 0], offset[..., 1]))
        values = self.ways.fields[place].at_nodes() - self.ways.highest[place]
        rows, columns = ground.price.shape
        return np.asarray(values.reshape(rows + 1, columns + 1))


def _all_reached(wave: Field, *looks: Look) -> bool:
    """Return whether a field knows all points of looks."""
    return all(
        wave.at(look).max(initial=-UNREACHED) <= 0.5 * UNREACHED for look in looks
    )
