"""Where the names on a map go: one placement for every picture that shows it.

Pictures differ in scale alone, which `em_m`, the size of their letters in metres of
ground, carries. Goals, stations, robots, stops and breakdowns are always named; paths,
terrain, obstacles and heights where there is room.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import Point
from shapely.geometry.base import BaseGeometry

from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz import style
from mrmg.viz.activities import breakdowns, lengths_along, visit_ranks
from mrmg.viz.contours import contour_lines
from mrmg.viz.label_placement import LabelBox, place, spots_around
from mrmg.viz.map_shapes import (
    drawn_region,
    drawn_start,
    end_poses,
    end_ring,
    occupied,
    path_of,
)
from mrmg.viz.tags import text_width_em

_OPTIONAL = ("path", "terrain", "obstacle", "height")
"""Kinds that are named where there is room, in order of importance."""
KINDS = ("goal", "station", "robot", "stop", "breakdown", *_OPTIONAL)
"""What labels name."""

_SIZES = {"stop": 0.85, "path": 0.9, "terrain": 0.9, "obstacle": 0.75, "height": 0.7}
"""Size of the letters of each kind, in em; others 1."""
BOLD = frozenset({"goal", "station", "robot", "stop", "breakdown", "path"})
_LINE_HEIGHT_EM, _RIM_EM = 1.0, 0.12
_UPPER_RIGHT, _DOWN, _LOWER_RIGHT = 0.25 * math.pi, -0.5 * math.pi, -0.25 * math.pi
_SHORTEST_NAMED_EM = 7.0
_SPOTS_ALONG, _SPOTS_ACROSS = 48, 7
_OUTSIDE_COST, _FAR_COST = 8.0, 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MapLabel:
    """A text and its place on the map.

    Attributes:
        kind: one of `KINDS`.
        of: id of what it names; of stops, paths and breakdowns the robot.
        text: to be written, centred.
        x_m, y_m: centre of the text; NaN until it is placed.
    """

    kind: str
    of: str
    text: str
    x_m: float = math.nan
    y_m: float = math.nan

    @property
    def size_em(self) -> float:
        """Size of its letters."""
        return _SIZES.get(self.kind, 1.0)


_Wanted = tuple[MapLabel, LabelBox]
"""A label without a place, and its candidates."""


def map_labels(
    scene: Scene,
    plan: Plan | None = None,
    log: ExecutionLog | None = None,
    *,
    em_m: float,
    kinds: Collection[str] = KINDS,
) -> tuple[MapLabel, ...]:
    """Return what is written on a map, and where.

    Args:
        scene: the map.
        plan: adds the paths' robots and the stops at stations.
        log: moves ends to where they were driven; adds breakdowns.
        em_m: size of the picture's letters on the ground.
        kinds: what to name.
    """
    wanted = [item for item in _wanted(scene, plan, log, em_m) if item[0].kind in kinds]
    shapes, lines = occupied(scene, plan, log, em_m)
    spots = place([box for _, box in wanted], shapes, lines, em_m)
    return tuple(
        replace(label, x_m=float(spot[0]), y_m=float(spot[1]))
        for (label, _), spot in zip(wanted, spots, strict=True)
        if spot is not None
    )


def half_size_m(kind: str, text: str, em_m: float) -> np.ndarray:
    """Return half the width and height of a text with its white rim."""
    width_em = text_width_em(text, bold=kind in BOLD)
    size = np.array([width_em, _LINE_HEIGHT_EM]) * _SIZES.get(kind, 1.0) + 2 * _RIM_EM
    return np.asarray(0.5 * em_m * size)


def _wanted(
    scene: Scene, plan: Plan | None, log: ExecutionLog | None, em_m: float
) -> Iterator[_Wanted]:
    """Yield all labels, those that must be placed first."""
    yield from _targets(scene, plan, em_m)
    for robot in scene.robots:
        start = drawn_start(robot, em_m)
        yield _beside("robot", robot.id, robot.id, start, em_m, _DOWN)
    ends = end_poses(plan, log)
    for robot_id in breakdowns(log):
        middle, radius_m = end_ring(scene.robot(robot_id), ends[robot_id], em_m)
        ring = Point(middle).buffer(radius_m)
        text = f"{robot_id} broke down"
        yield _beside("breakdown", robot_id, text, ring, em_m, _UPPER_RIGHT)
    yield from _paths(scene, plan, em_m)
    yield from _terrain(scene, em_m)
    bounds = shapely.box(*scene.bounds)
    for number, obstacle in enumerate(scene.barriers):
        visible = shapely.intersection(obstacle.shape, bounds)
        # An id of this form is one that the file does not give.
        if visible.area > 0.0 and obstacle.id != f"obstacle_{number}":
            yield _obstacle(obstacle.id, visible, em_m)
    yield from _heights(scene, em_m)


def _targets(scene: Scene, plan: Plan | None, em_m: float) -> Iterator[_Wanted]:
    ranks = visit_ranks(plan) if plan else {}
    names = style.target_labels(scene)
    for target in scene.targets():
        shape, text = drawn_region(target.region, em_m), names[target.id]
        yield _beside(target.kind, target.id, text, shape, em_m, _UPPER_RIGHT)
        stops = ranks.get(target.id, ()) if target.kind == "station" else ()
        for robot, rank in stops:
            yield _beside("stop", robot, str(rank), shape, em_m, _LOWER_RIGHT)


def _beside(
    kind: str, of: str, text: str, shape: BaseGeometry, em_m: float, towards_rad: float
) -> _Wanted:
    """Return a label with candidates around a shape."""
    half_m = half_size_m(kind, text, em_m)
    spots_m, cost = spots_around(shape, half_m, em_m, towards_rad)
    return _at_spots(kind, of, text, em_m, spots_m, cost)


def _at_spots(
    kind: str, of: str, text: str, em_m: float, spots_m: np.ndarray, cost: np.ndarray
) -> _Wanted:
    """Return a label with its candidates; optional ones lie on what they name."""
    optional = kind in _OPTIONAL
    owner = path_of(of) if kind == "path" else of
    box = LabelBox(
        half_m=half_size_m(kind, text, em_m),
        spots_m=spots_m,
        cost=cost,
        owner=owner if optional else "",
        optional=optional,
    )
    return MapLabel(kind=kind, of=of, text=text), box


def _paths(scene: Scene, plan: Plan | None, em_m: float) -> Iterator[_Wanted]:
    """Yield each path's robot, rather far from other names: colours are not enough."""
    names = [target.region.center for target in scene.targets()]
    names += [np.array(robot.pose[:2]) for robot in scene.robots]
    for item in plan.trajectories if plan else ():
        way_m = lengths_along(item.state)
        if way_m[-1] > _SHORTEST_NAMED_EM * em_m:
            marks_m = np.linspace(0.0, way_m[-1], _SPOTS_ALONG)
            points = item.state[np.searchsorted(way_m, marks_m), :2]
            apart_m = np.hypot(*(points[:, None] - np.array(names)).T).min(axis=0)
            cost = _FAR_COST * (1.0 - apart_m / max(apart_m.max(), 1e-9))
            yield _at_spots("path", item.robot, item.robot, em_m, points, cost)


def _terrain(scene: Scene, em_m: float) -> Iterator[_Wanted]:
    """Yield the multiplier of each area, on what is seen of it."""
    taken = [item.shape for item in scene.barriers]
    taken += [item.region.shape for item in scene.targets()]
    free = shapely.box(*scene.bounds).difference(shapely.unary_union(taken))
    for rank, area in enumerate(scene.terrain):
        later = shapely.unary_union([item.shape for item in scene.terrain[rank + 1 :]])
        visible = area.shape.intersection(free).difference(later)
        if visible.area > 0.0:
            text = f"×{area.multiplier:g}"
            half_m = half_size_m("terrain", text, em_m)
            spots = _spots_within(visible)
            boxes = shapely.box(*(spots - half_m).T, *(spots + half_m).T)
            covered = shapely.area(shapely.intersection(boxes, visible))
            cost = _OUTSIDE_COST * (1.0 - covered / shapely.area(boxes))
            cost += _FAR_COST * np.linspace(0.0, 1.0, len(spots))
            yield _at_spots("terrain", area.id, text, em_m, spots, cost)


def _obstacle(name: str, shape: BaseGeometry, em_m: float) -> _Wanted:
    """Return an obstacle's name, for where it fits on its visible part."""
    half_m = half_size_m("obstacle", name, em_m)
    spots = _spots_within(shape)
    boxes = shapely.box(*(spots - half_m).T, *(spots + half_m).T)
    spots = spots[shapely.covers(shape, boxes)]
    cost = np.linspace(0.0, 1.0, len(spots))
    return _at_spots("obstacle", name, name, em_m, spots, cost)


def _spots_within(shape: BaseGeometry) -> np.ndarray:
    """Return points of a shape, from its middle outwards, shape (n, 2)."""
    widest = max(shapely.get_parts(shape), key=lambda part: float(part.area))
    x_min, y_min, x_max, y_max = widest.bounds
    tolerance_m = 0.02 * math.hypot(x_max - x_min, y_max - y_min)
    middle = widest.centroid
    if not widest.contains(middle):
        middle = shapely.maximum_inscribed_circle(widest, tolerance=tolerance_m)
    middle = np.asarray(middle.coords[0])
    grid = np.meshgrid(
        np.linspace(x_min, x_max, _SPOTS_ACROSS + 2)[1:-1],
        np.linspace(y_min, y_max, _SPOTS_ACROSS + 2)[1:-1],
    )
    points = np.stack([grid[0].ravel(), grid[1].ravel()], axis=1)
    points = points[shapely.contains_xy(widest, *points.T)]
    points = np.concatenate([[middle], points])
    return np.asarray(points[np.argsort(np.hypot(*(points - middle).T), kind="stable")])


def _heights(scene: Scene, em_m: float) -> Iterator[_Wanted]:
    """Yield the height of each contour line that is long enough, rather half way."""
    for level_m, line in contour_lines(scene):
        way_m = lengths_along(line)
        if way_m[-1] > _SHORTEST_NAMED_EM * em_m:
            share = np.linspace(0.1, 0.9, _SPOTS_ALONG)
            spots = line[np.searchsorted(way_m, share * way_m[-1])]
            cost = _FAR_COST * np.abs(share - 0.5)
            yield _at_spots("height", "", f"{level_m:g} m", em_m, spots, cost)
