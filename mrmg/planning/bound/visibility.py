"""Visibility graphs: lower bounds of paths among polygons of different prices.

A shortest path is straight but where it goes round a convex corner of an obstacle and
where it meets the border of terrain, as a ray of light that is refracted (Mitchell and
Papadimitriou, The weighted region problem, Journal of the ACM 38, 1991). Corners, also
those of terrain and those of terrain with obstacles, are nodes. Borders of terrain are
cut into short pieces, whose middles are nodes, too; what that may cost more than the
crossing itself is taken off (`_visibility_kernels.straight_costs`). Whether a straight
piece is free, and through what ground it leads, is read from cells whose price is the
least within reach of them, so that no piece is missed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from mrmg.planning.bound import _visibility_kernels
from mrmg.planning.bound._visibility_kernels import Cells, Places
from mrmg.planning.bound.borders import (
    arc_lines,
    arc_middles,
    chords,
    half_arc_m,
)
from mrmg.planning.bound.geodesic import charged_within_m
from mrmg.planning.bound.prices import least_prices, surroundings
from mrmg.scene.region import Region
from mrmg.scene.types import Scene

BORDER_M = 0.15
"""Longest piece of terrain's border that one node stands for."""

SIMPLER_M = 0.02
"""How far obstacles may shrink for the sake of fewer corners."""


@dataclass(frozen=True, slots=True)
class VisibilityGraph:
    """Nodes at which shortest paths may bend, on the ground of one kind of robot.

    Attributes:
        cells: prices, the least within reach of each cell.
        bends: the nodes.
        edges: of obstacles, terrain and bounds, at which costs of paths have kinks.
        highest: the highest price there is, plain ground's included.
    """

    cells: Cells
    bends: Places
    edges: shapely.Geometry
    highest: float

    @staticmethod
    def of(
        scene: Scene,
        blocked: shapely.Geometry,
        *,
        cell_m: float,
        step_m: float,
        reach_m: float,
    ) -> VisibilityGraph:
        """Return the graph of a scene.

        Args:
            scene: the scene.
            blocked: where no path leads.
            cell_m: side of the cells that prices are read from.
            step_m: longest way of one planning step, as in `Ground.of`.
            reach_m: how far the true end of a piece may be from the place that stands
                for it.
        """
        reach_m = max(reach_m, 0.5 * BORDER_M)
        price = least_prices(
            scene,
            blocked.buffer(-reach_m - 2.0 * SIMPLER_M),
            cell_m=cell_m,
            reach_m=charged_within_m(step_m) + reach_m,
        )
        solid = blocked.buffer(-SIMPLER_M).simplify(SIMPLER_M)
        limits = shapely.union_all(
            [solid.boundary, shapely.box(*scene.bounds).boundary]
        )
        lines = _borders(scene, charged_within_m(step_m))
        borders = shapely.union_all(lines)
        met = shapely.get_coordinates(shapely.intersection(borders, limits))
        bends = _bends(np.concatenate([_convex_corners(solid), met]), borders)
        x_min, y_min, x_max, y_max = scene.bounds
        x, y = bends.end[:, 0].T
        inside = (x_min <= x) & (x <= x_max) & (y_min <= y) & (y <= y_max)
        return VisibilityGraph(
            cells=Cells(price, _even_about(price), float(x_min), float(y_min), cell_m),
            bends=Places(*(column[inside] for column in bends)),
            edges=shapely.union_all([solid, limits, borders]),
            highest=max([1.0, *(area.multiplier for area in scene.terrain)]),
        )

    def smooth_arcs(self, region: Region) -> np.ndarray:
        """Return which arcs are smooth and far from all edges, shape (K,)."""
        lines = arc_lines(region)
        far = ~shapely.dwithin(lines, self.edges, 2.0 * half_arc_m(region) + BORDER_M)
        if len(region.corners):
            far &= ~shapely.dwithin(lines, shapely.multipoints(region.corners), 1e-6)
        return np.asarray(far)

    def least_costs(self, nodes: np.ndarray, first: Places, last: Places) -> np.ndarray:
        """Return the costs of the shortest paths between places, shape (k, m).

        Args:
            nodes: numbers of the nodes at which they bend.
            first: the places that they begin at, k of them.
            last: those that they end at, m of them.
        """
        bends = Places(*(column[nodes] for column in self.bends))
        return np.asarray(
            _visibility_kernels.least_costs(
                _visibility_kernels.costs_between(self.cells, bends),
                self._straight(first, bends),
                self._straight(bends, last),
                self._straight(first, last),
            )
        )

    def _straight(self, first: Places, last: Places) -> np.ndarray:
        return np.asarray(_visibility_kernels.straight_costs(self.cells, first, last))


def _even_about(price: np.ndarray) -> np.ndarray:
    """Return how many cells about each one, to all sides, have its price, (Y, X)."""
    from scipy import ndimage  # takes a tenth of a second, and only bounds need it

    alike = ndimage.maximum_filter(price, 3) == ndimage.minimum_filter(price, 3)
    if alike.all():
        return np.full(price.shape, sum(price.shape), np.int32)
    return np.asarray(ndimage.distance_transform_cdt(alike, "chessboard"), np.int32)


def _borders(scene: Scene, reach_m: float) -> list[shapely.Geometry]:
    """Return the lines at which least prices may change.

    An area alone costs more than plain ground where it is for sure, or less wherever
    it is near; of areas that meet either may hold.
    """
    shapes = np.array([area.shape for area in scene.terrain], dtype=object)
    meeting, _ = shapely.STRtree(shapes).query(shapes, "dwithin", 2.0 * reach_m)
    met = np.bincount(meeting, minlength=len(shapes)) > 1
    lines: list[shapely.Geometry] = []
    areas = surroundings(scene, reach_m)
    for (near, sure, multiplier), with_others in zip(areas, met, strict=True):
        lines += [near.boundary] if with_others or multiplier < 1.0 else []
        lines += [sure.boundary] if with_others or multiplier > 1.0 else []
    return lines


def arcs_of(region: Region, smooth: np.ndarray) -> Places:
    """Return the arcs of a region's border; smooth ones are pieces of a border."""
    ends, off_m = chords(region)
    arcs = _places(ends)._replace(sagitta=off_m)
    slack = half_arc_m(region)
    arcs.end[smooth] = arc_middles(region)[smooth, None]
    arcs.slack[smooth] = slack
    # The border itself is bent: by s^2 / 2 times its curvature.
    bent = 0.0 if len(region.corners) else 0.5 * slack**2 / region.radius_m
    arcs.sagitta[smooth] = bent
    return arcs


def place_of(point: np.ndarray) -> Places:
    """Return a point as a place."""
    return _places(np.tile(point, (1, 2, 1)))


def _places(end: np.ndarray) -> Places:
    """Return places that are on no border."""
    size = len(end)
    return Places(
        end=np.ascontiguousarray(end, dtype=float),
        sagitta=np.zeros(size),
        slack=np.zeros(size),
        border=np.full(size, -1),
        along=np.zeros(size),
        turned=np.zeros((size, 2)),
    )


def _bends(points: np.ndarray, borders: shapely.Geometry) -> Places:
    """Return points, shape (n, 2), and the nodes along the borders of terrain."""
    found = [_places(np.stack([points, points], axis=1))]
    for number, line in enumerate(shapely.get_parts(borders)):
        found.append(_along(number, shapely.get_coordinates(line)))
    return Places(*map(np.concatenate, zip(*found, strict=True)))


def _along(number: int, corner: np.ndarray) -> Places:
    """Return the corners of a border, and the middles of its pieces."""
    side = np.diff(corner, axis=0)
    size = np.hypot(side[:, 0], side[:, 1])
    ahead = np.append(side[1:], side[-1:], axis=0)
    turn = np.arctan2(
        side[:, 0] * ahead[:, 1] - side[:, 1] * ahead[:, 0], (side * ahead).sum(axis=1)
    )
    along = np.append(0.0, np.cumsum(size))
    turned = np.append(0.0, np.cumsum(np.abs(turn)))
    count = np.maximum(1, np.ceil(size / BORDER_M)).astype(int)
    of = np.repeat(np.arange(len(side)), count)  # the side of each piece
    share = (np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / (
        count[of]
    )
    middle = corner[of] + share[:, None] * side[of]
    at = np.concatenate([corner, middle])
    return Places(
        end=np.stack([at, at], axis=1),
        sagitta=np.zeros(len(at)),
        slack=np.append(np.zeros(len(corner)), 0.5 * (size / count)[of]),
        border=np.full(len(at), number),
        along=np.append(along, along[of] + share * size[of]),
        turned=np.stack(
            [
                np.concatenate([[0.0], turned[:-1], turned[of]]),
                np.concatenate([turned, turned[of]]),
            ],
            axis=1,
        ),
    )


def _convex_corners(solid: shapely.Geometry) -> np.ndarray:
    """Return the corners at which a path may go round what is solid, shape (n, 2)."""
    found = [np.zeros((0, 2))]
    for part in shapely.get_parts(solid):
        whole = orient(part)  # what is solid lies on the left of all its rings
        for ring in (whole.exterior, *whole.interiors):
            corner = np.array(ring.coords)[:-1]
            before = corner - np.roll(corner, 1, axis=0)
            after = np.roll(corner, -1, axis=0) - corner
            turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
            found.append(corner[turn > 0.0])
    return np.concatenate(found)
