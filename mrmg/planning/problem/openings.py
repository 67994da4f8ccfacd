"""Openings: passages that only a smaller margin opens, and where that margin counts.

A robot is taken for a disc as wide as itself about its reference point, and its free
ground for what is left of the map without obstacles grown by some clearance. Ground
that is lost between a small clearance and a large one, and does not come back when the
rest is grown again (a morphological opening), is narrow. Of its pieces those count that
lie on the way to a target that there is no wide way to.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import Point
from shapely.geometry.base import BaseGeometry

from mrmg.planning.problem.targets import TARGET_MARGIN_M
from mrmg.planning.roadmap.fleet import PASSAGE_SLACK_M, margins_of
from mrmg.scene.margins import Margins, certified_minimum_m
from mrmg.scene.types import Region, Robot, Scene
from mrmg.world.world import CELL_M, Opening

LEVELS = 8
"""Margins that are tried, from the wanted one down to the certified minimum."""

STEERING_M = 0.04
"""Room on each side of an opening, beyond half the robot and the margin, within which
planned motions stray from its middle."""

RASTER_SHARE = 0.6
"""Share of a cell by which distances between cells are read too small, at most."""

WIDTH_ACCURACY_M = 0.002
"""How exactly the clearance of the widest way is found [m]."""

JOINED_M = 0.01
"""Distance of two pieces of ground below which they touch."""

LEAST_CELL_M = 0.05
"""Side of the cells of the distance field of a map with openings [m]."""

MOST_CELLS = 4_000_000
"""Cells of a distance field at most."""

LEAST_AREA_M2 = 1e-4
"""Area of narrow ground below which it is rounding."""


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
        return FreeGround(scene.bounds, shapely.union_all(shapes))

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

    def narrows(
        self, start: Point, wanted: BaseGeometry, narrow_m: float, wide_m: float
    ) -> list[BaseGeometry]:
        """Return the narrow ground on the way of fewest narrow pieces to a region.

        Args:
            start: where the way begins.
            wanted: region that is reached with a clearance of `narrow_m`.
            narrow_m: clearance from which on ground counts.
            wide_m: clearance from which on it is wide.
        """
        key = (narrow_m, wide_m)
        wide = [one.buffer(wide_m - narrow_m) for one in self.pieces(wide_m)]
        if key not in self._known:
            ground = shapely.union_all(self.pieces(narrow_m))
            left = ground.difference(shapely.union_all(wide)) if wide else ground
            parts = shapely.get_parts(left)
            self._known[key] = [one for one in parts if one.area > LEAST_AREA_M2]
        narrow = self._known[key]
        nodes = [*narrow, *wide]
        first = [i for i, node in enumerate(nodes) if node.distance(start) < narrow_m]
        last = {i for i, node in enumerate(nodes) if node.intersects(wanted)}
        way = _fewest(nodes, len(narrow), first, last)
        return [nodes[i] for i in way if i < len(narrow)]


def entered(region: Region) -> BaseGeometry:
    """Return where a region counts as entered for planning."""
    inner = region.shape.buffer(-TARGET_MARGIN_M, join_style="mitre")
    return region.shape.centroid if inner.is_empty else inner


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


def openings_to(
    scene: Scene, margins: Margins, wanted: Sequence[tuple[int, Region]]
) -> tuple[Opening, ...]:
    """Return the openings on the ways to regions that no wide way leads to.

    Args:
        scene: the mission.
        margins: stated for all robots.
        wanted: numbers of robots, and regions that they may have to get to.
    """
    grounds: dict[tuple[int, ...], FreeGround] = {}
    found: list[Opening] = []
    for number, region in wanted:
        robot = scene.robots[number]
        key = tuple(i for i, o in enumerate(scene.barriers) if o.stops(robot.id))
        ground = grounds.setdefault(key, FreeGround.of(scene, robot))
        margin_m = margins_of(robot, margins)[0]
        found += _openings(ground, robot, number, margin_m, entered(region))
    return tuple(found)


def cell_m(scene: Scene, margins: Margins, wanted_m: float = CELL_M) -> float:
    """Return the side of the cells of a scene's distance field.

    Half a robot's width with its margin exceeds a cell, as far as memory allows.
    """
    reaches_m = [
        robot.model.half_width_m + margins_of(robot, margins)[0]
        for robot in scene.robots
    ]
    x_min, y_min, x_max, y_max = scene.bounds
    least_m = ((x_max - x_min) * (y_max - y_min) / MOST_CELLS) ** 0.5
    return max(min(wanted_m, *reaches_m, CELL_M), least_m if wanted_m < CELL_M else 0.0)


def guide_m(cell_m: float) -> float:
    """Return what distances in openings count for besides their allowances.

    Robots stray as much from an opening's middle as from that of a wide way, but it is
    known how far; and distances between cells are read too small.
    """
    return max(0.0, PASSAGE_SLACK_M - STEERING_M) + RASTER_SHARE * cell_m


def clearance_needed_m(robot: Robot, margin_m: float) -> float:
    """Return the clearance of the middle of an opening that a robot drives through."""
    return robot.model.half_width_m + margin_m + STEERING_M


def wide_clearance_m(robot: Robot, margin_m: float) -> float:
    """Return the clearance from which on ground is wide for the roadmap's raster."""
    passage_m = robot.model.half_width_m + margin_m + PASSAGE_SLACK_M
    return passage_m + RASTER_SHARE * CELL_M


def least_margin_m(robot: Robot, margin_m: float) -> float:
    """Return the least margin that a robot's openings are driven with."""
    return min(margin_m, certified_minimum_m(robot.model))


def _openings(
    ground: FreeGround,
    robot: Robot,
    number: int,
    margin_m: float,
    wanted: BaseGeometry,
) -> Iterator[Opening]:
    start = Point(*robot.pose[:2])
    wide_m = wide_clearance_m(robot, margin_m)
    if ground.reaches(start, wanted, wide_m):
        return
    for level_m in np.linspace(margin_m, least_margin_m(robot, margin_m), LEVELS):
        needed_m = clearance_needed_m(robot, float(level_m))
        if ground.reaches(start, wanted, needed_m):
            reach_m = robot.model.circumscribed_radius_m + wide_m - needed_m
            for narrow in ground.narrows(start, wanted, needed_m, wide_m):
                yield Opening(
                    shape=narrow.buffer(reach_m),
                    margin_m=float(level_m),
                    allowance_m=float(margin_m - level_m),
                    robot=number,
                )
            return
