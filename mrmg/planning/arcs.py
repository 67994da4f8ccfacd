"""Lower bounds of ways between arcs of regions' borders.

Where a robot first touches a region decides how far it is to the next. Borders are cut
into arcs of equal length; between arcs holds

- the straight distance at the least price there is,
- the bound of all ways from one region to the other arc (`geodesic.Ways`),
- for pairs of interest, what a plane wave that leaves one region certifies. It is
  computed on finer cells, in a window that ways of interest do not leave: a way that
  does costs at least what it costs to the window's border and on from there.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.ops import substring

from mrmg.planning._eikonal_kernels import UNREACHED
from mrmg.planning.geodesic import (
    ARCS,
    SPACING_M,
    Field,
    Ground,
    Look,
    Ways,
    border,
    distance_m,
)
from mrmg.scene.types import Region

CHORDS = 4
"""Chords that stand for an arc of a circle in straight distances."""

WINDOW_M = 4.0
"""By how much ways that leave a window are longer than the least way, if they can."""


@dataclass(slots=True)
class ArcWays:
    """Ways between the arcs of T regions [m of plain ground], tightened on demand.

    Attributes:
        ways: between whole regions.
        fine: ground of finer cells: each of the ways' cells in equal parts.
        between: from arc to arc, shape (T, K, T, K), symmetric.
        from_start: from start to arc, shape (R, T, K).
        starts: shape (R, 2).
        done: pairs that are as tight as can be; a start r is -1 - r.
    """

    ways: Ways
    fine: Ground
    between: np.ndarray
    from_start: np.ndarray
    starts: np.ndarray
    done: set[tuple[int, int]] = field(default_factory=set)

    @staticmethod
    def of(ways: Ways, fine: Ground, starts: np.ndarray) -> ArcWays:
        """Bound all ways between arcs, and from starts to arcs."""
        regions, count = ways.regions, len(ways.regions)
        reach = np.zeros((count, count, ARCS))
        for i, source in enumerate(ways.fields):
            for j, look in enumerate(ways.looks):
                reach[i, j] = _lowest_by_arc(source, look) - ways.highest[i]
        lines = np.array([line for region in regions for line in _arc_lines(region)])
        sagitta_m = max((_sagitta_m(region) for region in regions), default=0.0)
        floor = float(np.min(ways.ground.price, initial=1.0))
        flat = np.zeros((len(lines), len(lines)))
        first, second = np.triu_indices(len(lines), 1)
        flat[first, second] = shapely.distance(lines[first], lines[second])
        flat = floor * np.maximum(0.0, flat + flat.T - 2.0 * sagitta_m)
        between = flat.reshape(count, ARCS, count, ARCS)
        between = np.maximum(between, reach[:, None])
        between = np.maximum(between, reach.transpose(1, 2, 0)[..., None])
        points = shapely.points(starts)[:, None]
        away = floor * (shapely.distance(points, lines[None]) - sagitta_m)
        from_start = np.maximum(
            away.reshape(len(starts), count, ARCS), ways.from_start[..., None]
        )
        for i in range(count):
            for j in range(count):
                if distance_m(regions[i], regions[j]) <= 0.0:
                    between[i, :, j] = 0.0
        from_start[ways.from_start == 0.0] = 0.0
        for table in (between, from_start):
            table[table > 0.5 * UNREACHED] = np.inf
        return ArcWays(ways, fine, between, from_start, starts)

    def tighten(self, origin: int, target: int) -> bool:
        """Tighten the ways between two regions, or from a start (-1 - r) to a region.

        Returns:
            Whether it had not been done before.
        """
        pair = (min(origin, target), max(origin, target))
        if pair in self.done or origin == target:
            return False
        self.done.add(pair)
        if origin < 0:
            least = self.ways.from_start[-1 - origin, target]
        else:
            least = self.ways.between[origin, target]
        if least == 0.0 or least == np.inf:
            return True
        window, outside_m = self._window(origin, target, least)
        for source, sink in ((target, origin), (origin, target)):
            if source < 0:
                continue
            wave = self._wave(window, source, sink)
            if wave is None:
                continue
            apart = np.minimum(wave, outside_m)
            if sink < 0:
                old = self.from_start[-1 - sink, source]
                np.maximum(old, apart[:, 0], out=old)
            else:
                old = self.between[source, :, sink]
                np.maximum(old, apart, out=old)
                self.between[sink, :, source] = old.T
        return True

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
        ground = self.ways.ground
        if place < 0:
            offset = ground.nodes() - self.starts[-1 - place]
            floor = float(np.min(ground.price, initial=1.0))
            return np.asarray(floor * np.hypot(offset[..., 0], offset[..., 1]))
        values = self.ways.fields[place].at_nodes() - self.ways.highest[place]
        rows, columns = ground.price.shape
        return np.asarray(values.reshape(rows + 1, columns + 1))

    def _wave(self, window: Ground, source: int, sink: int) -> np.ndarray | None:
        """Return what a wave from a region to a place certifies between their arcs."""
        region = self.ways.regions[source]
        if sink >= 0:
            look = self.ways.looks[source]
            toward = self.ways.fields[sink].at(look)
            leave = border(region)[look.point[int(toward.argmin())]]
            there = border(self.ways.regions[sink])
        else:
            leave = self.starts[-1 - sink]
            there = self.starts[-1 - sink][None]
        heading = leave - region.center
        wave = window.wave_from(region, heading / np.hypot(*heading))
        if wave is None:
            return None
        here = window.look_at(border(region), 0.5 * SPACING_M)
        away = window.look_at(there, 0.5 * SPACING_M if sink >= 0 else 0.0)
        for look in (here, away):
            if wave.at(look).max(initial=-UNREACHED) > 0.5 * UNREACHED:
                return None
        low = _lowest_by_arc(wave, away)
        return np.asarray(low[None] - _highest_by_arc(wave, here)[:, None])


def _lowest_by_arc(wave: Field, look: Look) -> np.ndarray:
    """Return bounds of the least value on each arc, UNREACHED where blocked."""
    low = np.full(ARCS, UNREACHED)
    np.minimum.at(low, look.arc, wave.at(look) - look.slack)
    return low


def _highest_by_arc(wave: Field, look: Look) -> np.ndarray:
    """Return bounds of the greatest value on each arc of a border; -inf if blocked."""
    high = np.full(ARCS, -np.inf)
    np.maximum.at(high, look.arc, wave.at(look) + look.slack)
    return high


def _arc_lines(region: Region) -> list[shapely.LineString]:
    """Return the arcs of a region's border, those of circles as polygonal lines."""
    if len(region.corners):
        ring = region.shape.exterior
        cuts = np.linspace(0.0, ring.length, ARCS + 1)
        return [substring(ring, *ends) for ends in zip(cuts, cuts[1:], strict=False)]
    angle = np.linspace(0.0, 2.0 * np.pi, ARCS * CHORDS + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * region.radius_m
    ring = ring + region.center
    return [
        shapely.LineString(ring[CHORDS * k : CHORDS * (k + 1) + 1]) for k in range(ARCS)
    ]


def _sagitta_m(region: Region) -> float:
    """Return how far an arc departs from its line."""
    return region.radius_m * (1.0 - float(np.cos(np.pi / (ARCS * CHORDS))))
