"""Lower bounds of ways between arcs of regions' borders.

Where a robot first touches a region decides how far it is to the next. Borders are cut
into arcs of equal length. A smooth arc of a goal stands for its middle: in the cheapest
tour the derivatives of both legs by the place of touching cancel out, as along borders
of terrain (`_visibility_kernels.straight_costs`). That needs all legs of a goal to be
of this kind, or less by what half an arc may cost; and batteries that both legs drain,
which is not so at stations. Any other arc stands for all its points. Between arcs holds

- the straight distance at the least price there is,
- the bound of all ways from one region to the other arc (`geodesic.Ways`),
- for pairs of interest, the shortest path of a visibility graph (`visibility`) whose
  nodes are those near the way: a path by any other node costs at least what the fields
  of both regions say of that node.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely

from mrmg.planning.bound._eikonal_kernels import UNREACHED
from mrmg.planning.bound.borders import ARCS, arc_lines, half_arc_m, sagitta_m
from mrmg.planning.bound.geodesic import Ways
from mrmg.planning.bound.visibility import VisibilityGraph, arcs_of, place_of

NEAR_SHARE, NEAR_M = 0.1, 2.0
"""What paths may cost more than was known of any, as a share of it and besides, if the
nodes that they bend at are to count."""

APART_M = 1.0
"""Least distance of a goal from all other regions and starts for its arcs to stand for
their middles: where legs may cost nothing, their derivatives do not cancel out."""

MOST_NODES = 2000
"""Nodes of a graph at most, by the memory for their distances (32 MB)."""

Pair = tuple[int, int]
"""A region or a start (-1 - r), and a region."""


@dataclass(slots=True)
class ArcWays:
    """Ways between the arcs of T regions [m of plain ground], tightened on demand.

    Attributes:
        ways: between whole regions.
        graph: of the ground.
        between: from arc to arc, shape (T, K, T, K), symmetric.
        from_start: from start to arc, shape (R, T, K).
        starts: shape (R, 2).
        smooth: which arcs stand for their middles, shape (T, K).
        known: pairs whose ways are tightened.
        cost: least cost from regions and starts to each bend, as far as asked for.
    """

    ways: Ways
    graph: VisibilityGraph
    between: np.ndarray
    from_start: np.ndarray
    starts: np.ndarray
    smooth: np.ndarray
    known: set[Pair] = field(default_factory=set)
    cost: dict[int, np.ndarray] = field(default_factory=dict)

    @staticmethod
    def of(
        ways: Ways, graph: VisibilityGraph, starts: np.ndarray, goals: int
    ) -> ArcWays:
        """Bound all ways between arcs, and from starts to arcs.

        Args:
            ways: between whole regions.
            graph: of the ground.
            starts: shape (R, 2).
            goals: number of the regions that are goals, which come first.
        """
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
        free = (ways.between == 0.0) & ~_crossed(ways)
        between.transpose(0, 2, 1, 3)[free] = 0.0
        from_start[ways.from_start == 0.0] = 0.0
        for table in (between, from_start):
            table[table > 0.5 * UNREACHED] = np.inf
        away_m = np.append(between.min(axis=(1, 3)), from_start.min(axis=2), axis=0)
        np.fill_diagonal(away_m, np.inf)
        smooth = np.array([graph.smooth_arcs(region) for region in regions])
        smooth &= ((away_m.min(axis=0) > APART_M) & (np.arange(count) < goals))[:, None]
        known = set(zip(*np.nonzero(free), strict=True))
        found = ArcWays(ways, graph, between, from_start, starts, smooth, known)
        between -= found.slack[:, :, None, None] + found.slack
        from_start -= found.slack
        for table in (between, from_start):
            np.maximum(table, 0.0, out=table)
        return found

    @property
    def slack(self) -> np.ndarray:
        """What half of each smooth arc may cost, shape (T, K)."""
        half_m = np.array([half_arc_m(region) for region in self.ways.regions])
        return np.where(self.smooth, self.graph.highest * half_m[:, None], 0.0)

    def near_pairs(self, r: int, count: int) -> set[Pair]:
        """Return pairs of one of the `count` nearest regions of any, or of start r."""
        apart = self.ways.between.copy()
        np.fill_diagonal(apart, np.inf)
        nearest = np.argsort(apart, axis=1, kind="stable")[:, :count]
        first = np.argsort(self.ways.from_start[r], kind="stable")[:count]
        pairs = {
            (max(i, j), min(i, j))
            for i, others in enumerate(nearest.tolist())
            for j in others
        }
        return pairs | {(-1 - r, j) for j in first.tolist()}

    def is_loose(self, pair: Pair) -> bool:
        """Return whether the ways of a pair can be tightened."""
        origin, target = pair
        if pair in self.known or (target, origin) in self.known:
            return False
        bound = self._known(pair)
        return bool(bound.min() < np.inf and (origin >= 0 or bound.max() > 0.0))

    def certificate(self, pair: Pair) -> tuple[np.ndarray, bool]:
        """Return bounds of the ways from arc to arc, shape (K or 1, K).

        And whether more may be found of them once these are known: all are longer than
        what was looked at.
        """
        origin, target = pair
        known = self._known(pair)
        most = (1.0 + NEAR_SHARE) * float(known[np.isfinite(known)].max()) + NEAR_M
        over = self._cost_to(origin) + self._cost_to(target)
        nodes = np.flatnonzero(over <= most)
        if len(nodes) > MOST_NODES:
            return np.zeros((1, 1)), False
        if origin < 0:
            first = place_of(self.starts[-1 - origin])
        else:
            first = arcs_of(self.ways.regions[origin], self.smooth[origin])
        last = arcs_of(self.ways.regions[target], self.smooth[target])
        slack = self.slack[target] + (
            0.0 if origin < 0 else self.slack[origin][:, None]
        )
        found = self.graph.least_costs(nodes, first, last)
        longer = bool(np.all(found > most - slack))
        return np.asarray(np.minimum(found, most - slack)), longer

    def take(self, pair: Pair, apart: np.ndarray, longer: bool) -> None:
        """Tighten the ways of a pair by a certificate."""
        if not longer:
            self.known.add(pair)
        old = self._known(pair)
        np.maximum(old, apart, out=old)
        origin, target = pair
        if origin >= 0:
            self.between[target, :, origin] = old.T

    def _known(self, pair: Pair) -> np.ndarray:
        """Return a view of what is known of ways from arc to arc, shape (K or 1, K)."""
        origin, target = pair
        if origin < 0:
            return self.from_start[-1 - origin, None, target]
        return self.between[origin, :, target]

    def _cost_to(self, place: int) -> np.ndarray:
        """Return the least cost from a region or start to each bend."""
        if place not in self.cost:
            self.cost[place] = self._spread(place)
        return self.cost[place]

    def _spread(self, place: int) -> np.ndarray:
        """Work out the least cost from a region or start to each bend.

        It is the least of the nodes of the fields about the bend.
        """
        ground, bend = self.ways.ground, self.graph.bends.end[:, 0]
        if place < 0:
            floor = float(np.min(ground.price, initial=1.0))
            offset = bend - self.starts[-1 - place]
            return np.asarray(floor * np.hypot(offset[:, 0], offset[:, 1]))
        from scipy import ndimage  # takes a tenth of a second, and only bounds need it

        rows, columns = ground.price.shape
        values = self.ways.fields[place].at_nodes() - self.ways.highest[place]
        around = ndimage.minimum_filter(values.reshape(rows + 1, columns + 1), 3)
        column, row = np.rint((bend - (ground.x_min, ground.y_min)) / ground.cell_m).T
        row = np.clip(row, 0, rows).astype(int)
        column = np.clip(column, 0, columns).astype(int)
        return np.asarray(around[row, column])


def _crossed(ways: Ways) -> np.ndarray:
    """Return which pairs of regions are touched one after the other, (T, T).

    Who starts in a region has touched it there, and perhaps another one that overlaps
    it; all others cross borders on their way, one after the other.
    """
    entered = np.all(ways.from_start > 0.0, axis=0)
    crossed: np.ndarray = entered[:, None] & entered
    np.fill_diagonal(crossed, False)
    return crossed
