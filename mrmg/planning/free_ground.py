"""Free ground of a disc, pieces of it and the narrow places between them.

A robot is taken for a disc as wide as itself about its reference point. Ground that is
lost between a small clearance and a large one, and does not come back when the rest is
grown again (a morphological opening), is narrow.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import shapely
from shapely.geometry import Point
from shapely.geometry.base import BaseGeometry

from mrmg.scene.types import Robot, Scene

WIDTH_ACCURACY_M = 0.002
"""How exactly the clearance of the widest way is found [m]."""

JOINED_M = 0.01
"""Distance of two pieces of ground below which they touch."""

LEAST_AREA_M2 = 1e-4
"""Area of narrow ground below which it is rounding."""

KNOWN = 8
"""Grounds that are remembered with their pieces."""


@dataclass(frozen=True)
class FreeGround:
    """Where the middle of a disc may be among some obstacles.

    Attributes:
        bounds: of the map [m].
        obstacles: their union.
    """

    bounds: tuple[float, float, float, float]
    obstacles: BaseGeometry
    _known: dict[tuple[float, ...], list[BaseGeometry]] = field(default_factory=dict)

    @staticmethod
    def of(scene: Scene, robot: Robot) -> FreeGround:
        """Return the ground of the obstacles that stop a robot."""
        shapes = [item.shape for item in scene.barriers if item.stops(robot.id)]
        return _ground(scene.bounds, tuple(shapes))

    def pieces(self, clearance_m: float) -> list[BaseGeometry]:
        """Return the pieces of ground at least so far from obstacles and bounds."""
        key = (clearance_m,)
        if key not in self._known:
            x_min, y_min, x_max, y_max = self.bounds
            inner = shapely.box(
                x_min + clearance_m,
                y_min + clearance_m,
                max(x_max - clearance_m, x_min + clearance_m),
                max(y_max - clearance_m, y_min + clearance_m),
            )
            free = inner.difference(self.obstacles.buffer(clearance_m))
            self._known[key] = [one for one in shapely.get_parts(free) if one.area > 0]
        return self._known[key]

    def reaches(self, start: Point, wanted: BaseGeometry, clearance_m: float) -> bool:
        """Return whether a way of so much clearance leads from a start to a region.

        The start itself may lie closer to an obstacle, but not across one.
        """
        return any(
            piece.distance(start) < clearance_m and piece.intersects(wanted)
            for piece in self.pieces(clearance_m)
        )

    def widest_m(self, start: Point, wanted: BaseGeometry, high_m: float) -> float:
        """Return the clearance of the widest way, at most `high_m`; 0 without a way."""
        low_m = 0.0
        if self.reaches(start, wanted, high_m):
            return high_m
        while high_m - low_m > WIDTH_ACCURACY_M:
            middle_m = 0.5 * (low_m + high_m)
            if self.reaches(start, wanted, middle_m):
                low_m = middle_m
            else:
                high_m = middle_m
        return low_m

    def narrow_pieces(self, narrow_m: float, wide_m: float) -> list[BaseGeometry]:
        """Return the pieces of all narrow ground; see `narrows`."""
        key = (narrow_m, wide_m)
        if key not in self._known:
            wide = [one.buffer(wide_m - narrow_m) for one in self.pieces(wide_m)]
            ground = shapely.union_all(self.pieces(narrow_m))
            left = ground.difference(shapely.union_all(wide)) if wide else ground
            parts = shapely.get_parts(left)
            self._known[key] = [one for one in parts if one.area > LEAST_AREA_M2]
        return self._known[key]

    def narrows(
        self, start: Point, wanted: BaseGeometry, narrow_m: float, wide_m: float
    ) -> list[BaseGeometry]:
        """Return the narrow ground on the way of fewest narrow pieces to a region.

        Where it ends beside wide ground, the line from there into the region is last.

        Args:
            start: where the way begins.
            wanted: region that is reached with a clearance of `narrow_m`.
            narrow_m: clearance from which on ground counts.
            wide_m: clearance from which on it is wide.
        """
        narrow = self.narrow_pieces(narrow_m, wide_m)
        wide = [one.buffer(wide_m - narrow_m) for one in self.pieces(wide_m)]
        nodes = [*narrow, *wide]
        first = [i for i, node in enumerate(nodes) if node.distance(start) < narrow_m]
        last = {i for i, node in enumerate(nodes) if node.intersects(wanted)}
        way = _fewest(nodes, len(narrow), first, last)
        found = [nodes[i] for i in way if i < len(narrow)]
        for i in way[-1:]:
            beside = self.pieces(wide_m)[i - len(narrow)] if i >= len(narrow) else None
            if beside and not beside.intersects(wanted):
                found.append(shapely.shortest_line(beside, wanted))
        return found

    def clearance_m(self, shape: BaseGeometry) -> float:
        """Return how far a point or shape is from obstacles and bounds."""
        edges = [shapely.box(*self.bounds).exterior, self.obstacles]
        return float(shapely.GeometryCollection(edges).distance(shape))


@lru_cache(maxsize=KNOWN)
def _ground(
    bounds: tuple[float, float, float, float], shapes: tuple[BaseGeometry, ...]
) -> FreeGround:
    return FreeGround(bounds, shapely.union_all(shapes))


@dataclass(frozen=True, slots=True)
class Bottleneck:
    """The narrowest place on the widest way from a start to a region.

    Attributes:
        width_m: of the place.
        x_m, y_m: where it is.
    """

    width_m: float
    x_m: float
    y_m: float

    def __str__(self) -> str:
        return f"{self.width_m:.2f} m wide near ({self.x_m:.1f}, {self.y_m:.1f})"


def bottleneck(
    ground: FreeGround, start: Point, wanted: BaseGeometry, high_m: float
) -> Bottleneck | None:
    """Return the narrowest place on the widest way; None if there is no way at all.

    Args:
        ground: with its obstacles.
        start: where the way begins.
        wanted: where it leads.
        high_m: clearance with which there is no way.
    """
    widest_m = ground.widest_m(start, wanted, high_m)
    if widest_m <= WIDTH_ACCURACY_M:
        return None
    wider_m = widest_m + 4.0 * WIDTH_ACCURACY_M
    places = ground.narrows(start, wanted, widest_m, wider_m)
    if places:
        place = places[0].representative_point()
    else:  # what is narrow is the region itself
        place = shapely.Point(shapely.shortest_line(wanted, start).coords[0])
    return Bottleneck(2.0 * widest_m, place.x, place.y)


def _fewest(
    nodes: Sequence[BaseGeometry], narrow: int, first: Sequence[int], last: set[int]
) -> list[int]:
    """Return the nodes on a way with the fewest narrow ones; the first are narrow."""
    tree = shapely.STRtree(nodes)
    before = dict.fromkeys(first, -1)
    waiting = deque(sorted(first, reverse=True))  # wide ones come last: take them first
    while waiting:
        node = waiting.popleft()
        if node in last:
            way = []
            while node >= 0:
                way.append(node)
                node = before[node]
            return way
        near = tree.query(nodes[node], predicate="dwithin", distance=JOINED_M)
        for other in sorted(near.tolist()):
            if other not in before:
                before[other] = node
                (waiting.append if other < narrow else waiting.appendleft)(other)
    return []
