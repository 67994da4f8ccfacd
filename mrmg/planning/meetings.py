"""Where robots get in each other's way: the narrowest place that two paths share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import shapely
from shapely.geometry import Point
from shapely.geometry.base import BaseGeometry

from mrmg.planning.frame import Frame
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import whole_tours
from mrmg.scene.margins import Margins

MOST_ROBOTS = 40
"""Robots whose paths are compared at most."""

FAR_M = 1e4
"""Length of lines that surely end beyond a wall [m]."""

BESIDE_SHARE = 0.2
"""Share of the width of ground below which a place lies beside a wall, not in a gap."""

SPACING_M = 0.2
"""Distance of the points of paths that are looked at [m]."""


def narrowest_meeting(
    problem: Problem,
    tours: Sequence[Sequence[int]],
    margins: Margins,
) -> str:
    """Return which robots' ways meet where there is least room, in words.

    Where none meet it is the narrowest place on the way of one, if that is so narrow
    that it cannot turn round there; "" otherwise.

    Args:
        problem: the mission as it lies, with arrays in its frame.
        tours: numbers of each robot's targets, without finishes.
        margins: stated for all robots.
    """
    scene = problem.scene
    frame = Frame.of(scene, margins)
    problem = replace(problem, scene=frame.scene(scene))
    whole = whole_tours(problem.mission.targets, tours)
    paths = [_points(problem.path(r, tour)) for r, tour in enumerate(whole)]
    names = [robot.id for robot in scene.robots]
    found: list[tuple[float, tuple[int, ...], tuple[float, ...]]] = []
    for one, other in combinations(range(min(len(paths), MOST_ROBOTS)), 2):
        lines = [shapely.MultiPoint(paths[r]) for r in (one, other)]
        reach_m = _apart_m(problem, one, other)
        if lines[0].distance(lines[1]) < reach_m:
            far = shapely.distance(shapely.points(paths[one]), lines[1])
            for point in paths[one][far < reach_m]:
                width_m = _width_m(problem, one, point)
                found.append((width_m, (one, other), tuple(point)))
    if found:
        _, pair, at = min(found)
        who = " and ".join(names[r] for r in pair)
        what = f"the ways of {who} meet"
    else:
        models = [robot.model for robot in problem.scene.robots]
        found = [
            (width_m, (r,), tuple(point))
            for r, path in enumerate(paths)
            if len(path) > 1
            for width_m, point in zip(
                _widths_m(problem, r, path).tolist(), path, strict=True
            )
            if width_m < 2.0 * (models[r].turning_radius_m + models[r].radius_m)
        ]
        if not found:
            return ""
        _, pair, at = min(found)
        what = f"the narrowest place on the way of {names[pair[0]]} is"
    x, y = frame.on_the_map((at[0], at[1]))
    stopping = [o.shape for o in scene.barriers if o.stops(names[pair[0]])]
    walls = shapely.union_all([shapely.box(*scene.bounds).boundary, *stopping])
    near_m, width_m = _room_between(walls, Point(x, y))
    wide = f"where it is {width_m:.2f} m wide"
    if near_m < BESIDE_SHARE * width_m:
        wide = f"{near_m:.2f} m from the nearest obstacle or edge of the map"
    return f"{what} near ({x:.1f}, {y:.1f}), {wide}"


def _room_between(walls: BaseGeometry, point: Point) -> tuple[float, float]:
    """Return how far the nearest wall is, and how far apart those on two sides are."""
    nearest = shapely.shortest_line(point, walls)
    if not nearest.length:
        return 0.0, 0.0
    (x, y), (wall_x, wall_y) = nearest.coords
    scale = FAR_M / nearest.length
    beyond = Point(x + (x - wall_x) * scale, y + (y - wall_y) * scale)
    across = shapely.LineString([point, beyond]).intersection(walls)
    return nearest.length, float(nearest.length + point.distance(across))


def _widths_m(problem: Problem, r: int, path: np.ndarray) -> np.ndarray:
    """Return the widths of the ground along a path, inf as it leaves a wall behind."""
    width_m = np.array([_width_m(problem, r, point) for point in path])
    if width_m[0] < 2.0 * problem.scene.robots[r].model.half_width_m:
        width_m[: int(np.argmax(np.diff(width_m) < 0.0)) + 1] = np.inf
    return width_m


def _points(path: np.ndarray) -> np.ndarray:
    if not np.ptp(path, axis=0).any():  # it ends where it begins
        return path[:1]
    line = shapely.segmentize(shapely.LineString(path), SPACING_M)
    return np.asarray(shapely.get_coordinates(line))


def _apart_m(problem: Problem, one: int, other: int) -> float:
    """Return how far apart two robots' paths must be not to matter to each other."""
    fleet, robots = problem.mission.fleet, problem.scene.robots
    spacing_m = float(max(fleet["spacing"][one], fleet["spacing"][other]))
    widths_m = [robots[r].model.half_width_m for r in (one, other)]
    return sum(widths_m) + spacing_m


def _width_m(problem: Problem, r: int, point: np.ndarray) -> float:
    """Return the width of the ground about a point, without allowances."""
    spaces = problem.mission.spaces
    index = problem.mission.fleet[r]["space"]
    distance = spaces.distance[index]
    at = ((point - (spaces.x_min, spaces.y_min)) / spaces.cell).astype(int)
    column, row = np.clip(at, 0, np.array(distance.shape)[::-1] - 1)
    raised_m = 0.0
    if spaces.allowance.size and spaces.allowance[index, row, column] >= 0.0:
        raised_m = spaces.guide + spaces.allowance[index, row, column]
    return 2.0 * max(0.0, float(distance[row, column]) - raised_m)
