"""Lower bounds of the cost of ways between regions, round obstacles and over terrain.

A way is that of the reference point. It keeps as far from obstacles as the largest disc
about that point inside the footprint reaches, and nothing else about the robot counts.
The bounds come from certified fields (see `_bound_kernels`), so they hold whatever the
cell is; a finer one brings them nearer to the truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Point

from mrmg.planning import _bound_kernels
from mrmg.planning._bound_kernels import UNREACHED
from mrmg.scene.types import Region, Robot, Scene

ROUNDS = 4
"""Solutions of the eikonal equation at most per field."""

BAND_SHARE = 0.25
"""Width of the levels of a field, as a share of a cell."""

CLEARANCE_TOLERANCE_M = 0.02
"""How much nearer to an obstacle than its disc allows a robot is taken to come."""

ROUND_MARGIN = 1.02
"""Factor on radii of terrain's surroundings, whose arcs are drawn by chords."""

SPACING_M = 0.04
"""Distance of the points that stand for a region's border."""

SEED_SHARE = 0.95
"""Steepness of a field next to its source, as a share of the price there."""


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

    def at(self, nodes: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Return f(u) where u has the given nodes and weights, shape (n, 4) -> (n,)."""
        raw = (self.values[nodes] * weights).sum(axis=1)
        certified = np.interp(raw, self.level, self.certified)
        return np.where(raw < 0.5 * UNREACHED, certified, UNREACHED)


@dataclass(frozen=True, slots=True)
class Ground:
    """Prices of driving, never above the true ones, on square cells.

    Attributes:
        x_min, y_min: corner of the first cell [m].
        cell_m: side of a cell.
        price: least multiplier within half a planning step of each cell, inf where the
            reference point cannot be, shape (Y, X).
        blocked: where the reference point cannot be.
    """

    x_min: float
    y_min: float
    cell_m: float
    price: np.ndarray
    blocked: shapely.Geometry

    @staticmethod
    def of(scene: Scene, robot: Robot, *, cell_m: float, step_m: float) -> Ground:
        """Return the ground of a robot.

        Args:
            scene: the scene.
            robot: gives obstacles and disc.
            cell_m: side of a cell.
            step_m: longest way of one planning step. A step is charged at its middle,
                which is at most half of it away from any point of it.
        """
        radius = max(0.0, robot.model.inscribed_radius_m - CLEARANCE_TOLERANCE_M)
        shapes = [o.shape for o in scene.obstacles if o.stops(robot.id)]
        blocked = shapely.union_all(shapes).buffer(radius)
        x_min, y_min, x_max, y_max = scene.bounds
        x = np.arange(x_min, x_max, cell_m)
        y = np.arange(y_min, y_max, cell_m)
        low_x, low_y = np.meshgrid(x, y)
        boxes = shapely.box(low_x, low_y, low_x + cell_m, low_y + cell_m)
        price = _least_multiplier(scene, boxes, ROUND_MARGIN * 0.5 * step_m)
        price[_covered(blocked, boxes)] = np.inf
        return Ground(float(x_min), float(y_min), cell_m, price, blocked)

    def weights_at(
        self, points: np.ndarray, reach_m: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return how a field's values at points follow from its nodes.

        A point stands for all free points within `reach_m`; it is looked at from every
        free cell that near, at that cell's nearest point.

        Returns:
            (nodes, weights, slack): flat indices and bilinear weights, shape (n, 4),
            and how much a certified field can differ within reach, shape (n,).
        """
        rows, columns = self.price.shape
        place = (points - (self.x_min, self.y_min)) / self.cell_m
        reach = reach_m / self.cell_m + 1e-9
        found = []
        for shift_y in (-reach, 0.0, reach):
            for shift_x in (-reach, 0.0, reach):
                column = np.floor(place[:, 0] + shift_x).astype(int)
                row = np.floor(place[:, 1] + shift_y).astype(int)
                found.append(np.stack([np.arange(len(points)), row, column], axis=1))
        index, row, column = np.unique(np.concatenate(found), axis=0).T
        fine = (row >= 0) & (column >= 0) & (row < rows) & (column < columns)
        index, row, column = index[fine], row[fine], column[fine]
        free = np.isfinite(self.price[row, column])
        index, row, column = index[free], row[free], column[free]
        fx = np.clip(place[index, 0] - column, 0.0, 1.0)
        fy = np.clip(place[index, 1] - row, 0.0, 1.0)
        corner = row * (columns + 1) + column
        nodes = np.stack(
            [corner, corner + 1, corner + columns + 1, corner + columns + 2], axis=1
        )
        weights = np.stack(
            [(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy], axis=1
        )
        return nodes, weights, self.price[row, column] * reach_m

    def field_from(self, region: Region) -> Field:
        """Return a certified field that grows away from a region."""
        rows, columns = self.price.shape
        y, x = np.mgrid[0 : rows + 1, 0 : columns + 1] * self.cell_m
        points = np.stack([x + self.x_min, y + self.y_min], axis=-1).reshape(-1, 2)
        away = -region.depth(points).reshape(y.shape)
        band = np.sqrt(2.0) * self.cell_m
        near = away <= band
        touching = near[:-1, :-1] | near[1:, :-1] | near[:-1, 1:] | near[1:, 1:]
        prices = self.price[touching & np.isfinite(self.price)]
        share = SEED_SHARE * prices.min() if prices.size else 1.0
        seed = np.where(near, share * np.maximum(away, -band), UNREACHED)
        values, level, certified = _bound_kernels.certified_field(
            self.price, self.cell_m, seed, ROUNDS, BAND_SHARE * self.cell_m
        )
        return Field(values.reshape(-1), level, certified)


def _least_multiplier(scene: Scene, boxes: np.ndarray, reach_m: float) -> np.ndarray:
    """Return the least multiplier within reach of each cell."""
    price = np.ones(boxes.shape)
    for area in scene.terrain:
        near, sure = area.shape.buffer(reach_m), area.shape.buffer(-reach_m)
        shapely.prepare(near)
        touched = shapely.intersects(near, boxes)
        inside = _covered(sure, boxes)
        price[touched] = np.minimum(price[touched], area.multiplier)
        price[inside] = area.multiplier
    return price


def _covered(shape: shapely.Geometry, boxes: np.ndarray) -> np.ndarray:
    """Return which cells lie wholly in a shape."""
    shapely.prepare(shape)
    covered = np.zeros(boxes.shape, bool)
    centre = shapely.centroid(boxes)
    likely = shapely.contains_xy(shape, shapely.get_x(centre), shapely.get_y(centre))
    covered[likely] = shapely.covers(shape, boxes[likely])
    return covered


def least_ways_m(
    ground: Ground, regions: Sequence[Region], starts: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return lower bounds of the weighted length of ways between regions.

    A way between regions that do not overlap leads from the border of one to the border
    of the other.

    Args:
        ground: prices of driving.
        regions: T convex sets.
        starts: positions [m], shape (R, 2).

    Returns:
        From region to region [m of plain ground], shape (T, T), and from start to
        region, shape (R, T); inf where obstacles leave no way.
    """
    fields = [ground.field_from(region) for region in regions]
    borders = [_border(region) for region in regions]
    looks = [ground.weights_at(points, 0.5 * SPACING_M) for points in borders]
    floor = float(np.min(ground.price, initial=1.0))
    way = np.zeros((len(regions), len(regions)))
    for i, field in enumerate(fields):
        highest = _extreme(field, looks[i], np.max)
        for j in range(len(regions)):
            apart = _distance_m(regions[i], regions[j])
            if apart > 0.0:
                certified = _extreme(field, looks[j], np.min) - highest
                way[i, j] = max(certified, floor * apart, 0.0)
    way = np.maximum(way, way.T)
    start_way = np.zeros((len(starts), len(regions)))
    for r, start in enumerate(starts):
        look = ground.weights_at(start[None], 0.0)
        for i, field in enumerate(fields):
            apart = float(-regions[i].depth(start)[0])
            if apart > 0.0:
                highest = _extreme(field, looks[i], np.max)
                certified = _extreme(field, look, np.min) - highest
                start_way[r, i] = max(certified, floor * apart, 0.0)
    for table in (way, start_way):
        table[table > 0.5 * UNREACHED] = np.inf
    return way, start_way


def _extreme(field: Field, look: tuple[np.ndarray, ...], of: Any) -> float:
    """Return a bound of the least or greatest value of a field over a border."""
    nodes, weights, slack = look
    if not len(nodes):  # no free point: nothing gets there
        return UNREACHED if of is np.min else 0.0
    value = field.at(nodes, weights)
    if of is np.max:
        value = value[value < 0.5 * UNREACHED] + slack[value < 0.5 * UNREACHED]
        return float(value.max(initial=-UNREACHED)) if len(value) else 0.0
    return float((value - slack).min())


def _border(region: Region) -> np.ndarray:
    """Return points on a region's border, SPACING_M apart at most."""
    if len(region.corners):
        ring = shapely.segmentize(region.shape.exterior, SPACING_M)
        return np.asarray(shapely.get_coordinates(ring))
    count = max(8, int(np.ceil(2.0 * np.pi * region.radius_m / SPACING_M)))
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.asarray(region.center + region.radius_m * ring)


def _distance_m(first: Region, second: Region) -> float:
    """Return the distance of two regions; not positive if they overlap."""
    cores = [
        region.shape if len(region.corners) else Point(*region.center)
        for region in (first, second)
    ]
    return float(cores[0].distance(cores[1])) - first.radius_m - second.radius_m
