"""Paths of a plan's robots, drawn tight: from trajectories to chains of nodes.

A path keeps the order of targets and the gears of the trajectory it comes from; its
nodes slip to where driving along them takes the least energy (`_band_kernels`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np

from mrmg.mission import Trajectory
from mrmg.motion._kernels import UNICYCLE
from mrmg.planning import _relax_kernels
from mrmg.planning._band_kernels import Stops, Surface
from mrmg.planning._mission_kernels import Targets, in_target
from mrmg.planning.motion_tree import Problem

SPACING_M = 0.8
"""Distance of a path's nodes."""

MERGED_M = 0.1
"""Distance within which places that must be nodes become one."""

SHORTEST_M = 0.15
"""Way between two changes of gear below which there is none."""

DISCS_M = 0.4
"""Distance of the discs that cover a footprint."""

TRACKING_M = 0.02
"""How much deeper than needed a path enters its targets, to begin with."""

WARY_M = 4.0
"""How far around a place a path is led farther from obstacles ..."""

WARINESS_M = 0.06
"""... and how much farther, at the place."""

CURVATURE_SHARE = 0.92
"""Share of the steering that a path uses."""

SERIES = 200
"""Steps of L-BFGS after which nodes are spread evenly again."""

MOST_SERIES = 30
"""Series of steps at most ..."""

LEAST_GAIN = 1e-4
"""... and the share of the cost that one must gain to be followed by another."""


@dataclass(frozen=True)
class Path:
    """The way of one robot.

    Attributes:
        node: shape (n, 2) [m].
        gear: of each segment, 1 or -1, shape (n - 1,).
        stop: numbers of the nodes at which a target is visited, shape (S,).
        target: those targets, shape (S,).
        deeper: how much deeper than needed the path enters them [m], shape (S,).
        heading: of the robot at the start [rad].
    """

    node: np.ndarray
    gear: np.ndarray
    stop: np.ndarray
    target: np.ndarray
    deeper: np.ndarray
    heading: float


def visit_steps(
    targets: Targets, tour: Sequence[int], trajectory: Trajectory
) -> list[int]:
    """Return the steps at which a trajectory enters its targets as deep as planned.

    The list ends before the first target that it does not.
    """
    state = trajectory.state
    visits: list[int] = []
    step = 0
    for t in tour:
        while step < len(state) and not in_target(targets, t, *state[step, :2]):
            step += 1
        if step == len(state):
            break
        visits.append(step)
    return visits


def path_of(
    tour: Sequence[int], visits: Sequence[int], trajectory: Trajectory, first: int = 0
) -> Path:
    """Return the way a trajectory goes from step `first` up to its last target.

    Args:
        tour: numbers of its targets.
        visits: steps at which they are visited.
        trajectory: of one robot.
        first: where the path begins.
    """
    left = [(t, v - first) for t, v in zip(tour, visits, strict=True) if v >= first]
    last = left[-1][1] if left else 0
    state = trajectory.state[first : first + last + 1]
    speed = 0.5 * (state[:-1, 3] + state[1:, 3])
    gear = _gears(speed * trajectory.dt_s)
    changes = np.flatnonzero(np.diff(gear)) + 1
    steps = [v for _, v in left]
    keys = np.unique([0, *changes.tolist(), *steps])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(state[:, :2], axis=0).T))])
    path = Path(
        node=state[:, :2],
        gear=gear,
        stop=np.array(steps, np.int64),
        target=np.array([t for t, _ in left], np.int64),
        deeper=np.full(len(left), TRACKING_M),
        heading=float(state[0, 2]),
    )
    return _spread(path, way, keys)


def _gears(advance: np.ndarray) -> np.ndarray:
    """Return the gear of each step; short ways to and fro belong to what is before."""
    gear = np.where(advance < 0.0, -1, 1)
    edges = [0, *(np.flatnonzero(np.diff(gear)) + 1).tolist(), len(gear)]
    ways = [abs(advance[a:b].sum()) for a, b in zip(edges, edges[1:], strict=False)]
    present = next(
        (int(gear[a]) for a, way in zip(edges, ways, strict=False) if way > SHORTEST_M),
        1,
    )
    for a, b, way in zip(edges, edges[1:], ways, strict=False):
        present = int(gear[a]) if way > SHORTEST_M else present
        gear[a:b] = present
    return gear


def _spread(path: Path, way: np.ndarray, keys: np.ndarray) -> Path:
    """Return a path with evenly spaced nodes.

    Args:
        path: the path; its gears may be those of any chain of points.
        way: way to each of its nodes, shape (n,).
        keys: nodes that remain: both ends, changes of gear and stops.
    """
    ways: list[np.ndarray] = []
    gear: list[int] = []
    number = {int(keys[0]): 0}
    kept = int(keys[0])
    for key in keys[1:].tolist():
        length = way[key] - way[kept]
        if length >= MERGED_M:
            pieces = max(1, round(length / SPACING_M))
            ways.append(np.linspace(way[kept], way[key], pieces, endpoint=False))
            gear += [int(path.gear[key - 1])] * pieces
            kept = key
        number[key] = len(gear)
    at = np.concatenate([*ways, way[[kept]]])
    return replace(
        path,
        node=np.stack([np.interp(at, way, path.node[:, j]) for j in range(2)], axis=1),
        gear=np.array(gear, np.int64),
        stop=np.array([number[int(v)] for v in path.stop], np.int64),
    )


def respaced(path: Path) -> Path:
    """Return the path with evenly spaced nodes; stops and gear changes stay nodes."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path.node, axis=0).T))])
    changes = np.flatnonzero(np.diff(path.gear)) + 1
    keys = np.unique([0, *changes.tolist(), *path.stop.tolist(), len(path.node) - 1])
    return _spread(path, way, keys)


def tightened(targets: Targets, surface: Surface, path: Path) -> tuple[Path, float]:
    """Return a path drawn tight, and its cost [m of plain ground]."""
    cost = np.inf
    for _ in range(MOST_SERIES):
        path = respaced(path)
        if len(path.node) < 2:
            return path, 0.0
        node, before = path.node.copy(), cost
        cost = _relax_kernels.relax(
            surface,
            stops_of(targets, path),
            node,
            path.gear,
            cos(path.heading),
            sin(path.heading),
            SERIES,
        )
        path = replace(path, node=node)
        if cost > (1.0 - LEAST_GAIN) * before:
            break
    return respaced(path), float(cost)


def stops_of(targets: Targets, path: Path) -> Stops:
    """Return a path's targets, drawn in by what tracking may be off."""
    return Stops(
        node=path.stop,
        center=targets.center[path.target],
        reach=targets.reach[path.target],
        corner=targets.corner[path.target],
        corners=targets.corners[path.target],
        deeper=path.deeper,
    )


def surface_of(problem: Problem, r: int, smooth: np.ndarray) -> Surface:
    """Return what robot r's paths are priced on; `smooth` is `smooth_terrain`."""
    robot = problem.mission.fleet[r]
    spaces = problem.mission.spaces
    model = problem.scene.robots[r].model
    outline = robot["corner"][: robot["corners"]]
    low, high = outline.min(axis=0), outline.max(axis=0)
    half = max(-low[1], high[1])
    pieces = max(1, int(np.ceil((high[0] - low[0]) / DISCS_M)))
    length = (high[0] - low[0]) / pieces
    limit = robot["limit"]
    if robot["model"] == UNICYCLE:
        # Sharper than it can turn at full speed: it slows down there.
        arm, curvature = float(robot["track"]), 2.0 * limit[2] / limit[1]
        rate = 4.0 * limit[4] / limit[1] ** 2
    else:
        arm, curvature = float(robot["wheelbase"]), 1.0 / robot["turning_radius"]
        rate = limit[4] / (arm * limit[1])
    energy = model.energy_model
    return Surface(
        x_min=spaces.x_min,
        y_min=spaces.y_min,
        cell=spaces.cell,
        distance=spaces.distance[robot["space"]],
        multiplier=smooth,
        disc=low[0] + length * (np.arange(pieces) + 0.5),
        room=float(np.hypot(0.5 * length, half) + robot["margin"]),
        curvature=float(CURVATURE_SHARE * curvature),
        curvature_rate=float(CURVATURE_SHARE * rate),
        scrub=arm * energy.turning_force_N / max(energy.rolling_force_N, 1e-9),
    )


def wary(surface: Surface, place: np.ndarray) -> Surface:
    """Return the surface with obstacles counted as nearer around a place."""
    rows, columns = surface.distance.shape
    x = surface.x_min + (np.arange(columns) + 0.5) * surface.cell - place[0]
    y = surface.y_min + (np.arange(rows) + 0.5) * surface.cell - place[1]
    near = np.maximum(0.0, 1.0 - np.hypot(x[None, :], y[:, None]) / WARY_M)
    return surface._replace(distance=surface.distance - WARINESS_M * near)


def smooth_terrain(multiplier: np.ndarray) -> np.ndarray:
    """Return the terrain with its borders blurred over about a metre."""
    weights = np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 16.0
    for axis in (0, 1):
        width = [(2, 2) if a == axis else (0, 0) for a in (0, 1)]
        padded = np.pad(multiplier, width, "edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, 5, axis=axis)
        multiplier = windows @ weights
    return np.ascontiguousarray(multiplier)
