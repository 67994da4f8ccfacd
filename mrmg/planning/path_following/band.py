"""Smoothed paths of a plan's robots: from trajectories to chains of nodes.

A path keeps the order of targets and the gears of the trajectory it comes from; its
nodes slip to where driving along them takes the least energy (`_band_kernels`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import atan2, cos, isnan, nan, remainder, sin, tau

import numpy as np

from mrmg.planning.path_following import _relax_kernels, _tracking_kernels
from mrmg.planning.path_following._band_kernels import CostMap, Stops
from mrmg.planning.problem._target_kernels import Targets
from mrmg.plans import Trajectory

SPACINGS_M = (2.4, 0.8)
"""Distance of a path's nodes, at first and in the end.

Few nodes find the way sooner, and a shorter one: many stick where they lie.
"""

NODE_TURN = 1.2
"""Largest turn between two nodes [rad]; nimble robots' nodes are nearer together ..."""

LEAST_SHARE = 0.25
"""... but no nearer than this share of others'."""

UNHINDERED_M = 0.65
"""Room that paths need from which on nodes need not be nearer to each other, either."""

MERGED_M = 0.1
"""Distance within which places that must be nodes become one."""

SHORTEST_M = 0.15
"""Way between two changes of gear below which there is none."""

TRACKING_M = 0.01
"""How much deeper than needed a path enters its targets, to begin with."""

DIRECTION_M = 4.0
"""How far before and after a target a way's direction is read."""

SERIES = 200
"""Steps of L-BFGS after which nodes are spread evenly again."""

MOST_SERIES = 30
"""Series of steps at most ..."""

LEAST_GAIN = 3e-4
"""... and the share of the cost that one must gain to be followed by another."""


_no_numbers = partial(np.zeros, 0, np.int64)
_no_values = partial(np.zeros, 0)


@dataclass(frozen=True)
class Path:
    """The way of one robot, without stops and turns on the spot unless they are given.

    Attributes:
        node: shape (n, 2) [m].
        gear: of each segment, 1 or -1, shape (n - 1,).
        heading: of the robot at the start [rad].
        stop: numbers of the nodes at which a target is visited, shape (S,).
        target: those targets, shape (S,).
        deeper: how much deeper than needed the path enters them [m], shape (S,).
        pivot: numbers of the nodes at which the robot turns on the spot, shape (P,).
        pause_s: how long it stands at each stop, shape (S,).
        aim: headings that it is to have at them [rad], NaN for any, shape (S,).
    """

    node: np.ndarray
    gear: np.ndarray
    heading: float
    stop: np.ndarray = field(default_factory=_no_numbers)
    target: np.ndarray = field(default_factory=_no_numbers)
    deeper: np.ndarray = field(default_factory=_no_values)
    pivot: np.ndarray = field(default_factory=_no_numbers)
    pause_s: np.ndarray = field(default_factory=_no_values)
    aim: np.ndarray = field(default_factory=_no_values)

    @property
    def way(self) -> np.ndarray:
        """Way to each node [m], shape (n,)."""
        size = np.hypot(*np.diff(self.node, axis=0).T)
        return np.concatenate([[0.0], np.cumsum(size)])

    def points(self, at_m: np.ndarray) -> np.ndarray:
        """Return the points at ways along the path [m], shape (n,) -> (n, 2)."""
        own = self.way
        return np.stack([np.interp(at_m, own, one) for one in self.node.T], axis=1)

    @property
    def last_aim(self) -> float:
        """Heading that it is to have at its end [rad], NaN for any."""
        aims = self.aim[self.stop == len(self.node) - 1]
        return float(next(iter(aims[np.isfinite(aims)]), np.nan))

    @property
    def edges(self) -> np.ndarray:
        """Numbers of the nodes between which it is driven without a stop."""
        changes = np.flatnonzero(np.diff(self.gear)) + 1
        pauses = self.stop[self.pause_s > 0.0]
        return np.unique(
            [0, *changes.tolist(), *self.pivot, *pauses, len(self.node) - 1]
        )


def directions_of(path: Path) -> list[tuple[int, float, float]]:
    """Return how a path leads to its start and its stops, and on from them, in order.

    Each as (node, direction before, direction ahead) [rad]; before the start that is
    the robot's heading, after the end there is none (NaN).
    """
    way, found = path.way, []
    for node in dict.fromkeys([0, *path.stop.tolist()]):
        near = path.points(way[node] + DIRECTION_M * np.array([-1.0, 1.0]))
        before, ahead = path.node[node] - near[0], near[1] - path.node[node]
        found.append(
            (
                node,
                atan2(before[1], before[0]) if node > 0 else path.heading,
                atan2(ahead[1], ahead[0]) if node < len(way) - 1 else nan,
            )
        )
    return found


def turns_of(path: Path) -> list[tuple[int, float]]:
    """Return how much a path turns at its start and at its stops, in order [rad]."""
    return [
        (node, abs(remainder(ahead - before, tau)))
        for node, before, ahead in directions_of(path)
        if not isnan(ahead)
    ]


def visit_steps(targets: Targets, tour: Sequence[int], state: np.ndarray) -> list[int]:
    """Return the steps at which states, shape (n, 5), enter targets as deep as planned.

    The list ends before the first target that they do not.
    """
    state = np.array(state)  # the kernel is compiled for arrays that can be written
    visits: list[int] = []
    step = 0
    for t in tour:
        step = _tracking_kernels.first_inside(targets, t, state, step)
        if step == len(state):
            break
        visits.append(step)
    return visits


def path_of(
    tour: Sequence[int],
    visits: Sequence[int],
    aim: np.ndarray,
    trajectory: Trajectory,
) -> Path:
    """Return the way a trajectory goes up to its last target.

    Args:
        tour: numbers of its targets.
        visits: steps at which they are visited.
        aim: headings that the way is to have there (`Path`).
        trajectory: of one robot.
    """
    last = visits[-1] if visits else 0
    state = trajectory.state[: last + 1]
    speed = 0.5 * (state[:-1, 3] + state[1:, 3])
    gear = _gears(speed * trajectory.dt_s)
    path = Path(
        node=state[:, :2],
        gear=gear,
        stop=np.array(visits, np.int64),
        target=np.array(tour, np.int64),
        deeper=np.full(len(visits), TRACKING_M),
        heading=float(state[0, 2]),
        pause_s=np.zeros(len(visits)),
        aim=aim,
    )
    return respaced(path)


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


def respaced(path: Path, spacing_m: float = SPACINGS_M[-1]) -> Path:
    """Return the path with evenly spaced nodes; stops and stretches' ends stay nodes.

    Places that must be nodes become one where they nearly coincide.
    """
    way = path.way
    keys = np.unique([*path.edges, *path.stop])
    ways: list[np.ndarray] = []
    gear: list[int] = []
    number = {int(keys[0]): 0}
    kept = int(keys[0])
    for key in keys[1:].tolist():
        length = way[key] - way[kept]
        if length >= MERGED_M:
            pieces = max(1, round(length / spacing_m))
            ways.append(np.linspace(way[kept], way[key], pieces, endpoint=False))
            gear += [int(path.gear[key - 1])] * pieces
            kept = key
        number[key] = len(gear)
    at = np.concatenate([*ways, way[[kept]]])
    return replace(
        path,
        node=path.points(at),
        gear=np.array(gear, np.int64),
        stop=np.array([number[int(v)] for v in path.stop], np.int64),
        pivot=np.unique([number[int(v)] for v in path.pivot]).astype(np.int64),
    )


def smooth_path(
    targets: Targets,
    cost_map: CostMap,
    path: Path,
    spacings_m: Sequence[float] = SPACINGS_M,
) -> tuple[Path, float]:
    """Return a smoothed path, and its cost [m of plain ground].

    Args:
        targets: the targets.
        cost_map: what the path is priced on.
        path: the path to begin with.
        spacings_m: distances of nodes, one after the other.
    """
    cost = 0.0
    for spacing_m in spacings_m:
        spacing_m *= min(nimble_share(cost_map.curvature), cost_map.room / UNHINDERED_M)
        path, cost = _relaxed(targets, cost_map, path, spacing_m)
    return path, cost


def nimble_share(curvature: float) -> float:
    """Return how much shorter lengths are for a robot that turns in little room.

    Args:
        curvature: of the sharpest turn that its paths may have [1/m].
    """
    return min(1.0, max(LEAST_SHARE, NODE_TURN / (SPACINGS_M[-1] * curvature)))


def _noses(path: Path) -> np.ndarray:
    """Return the unit vectors of the headings at a path's ends, shape (2, 2)."""
    noses = np.zeros((2, 2))
    noses[0] = cos(path.heading), sin(path.heading)
    if np.isfinite(path.last_aim):
        noses[1] = cos(path.last_aim), sin(path.last_aim)
    return noses


def _relaxed(
    targets: Targets, cost_map: CostMap, path: Path, spacing_m: float
) -> tuple[Path, float]:
    cost = np.inf
    for _ in range(MOST_SERIES):
        path = respaced(path, spacing_m)
        if len(path.node) < 2:
            return path, 0.0
        node, before = path.node.copy(), cost
        pivot = np.zeros(len(path.gear), np.bool_)
        pivot[path.pivot[path.pivot < len(pivot)]] = True
        cost = _relax_kernels.relax(
            cost_map,
            Stops(targets, path.stop, path.target, path.deeper, path.aim),
            node,
            path.gear,
            pivot,
            _noses(path),
            SERIES,
        )
        path = replace(path, node=node)
        if cost > (1.0 - LEAST_GAIN) * before:
            break
    return respaced(path, spacing_m), float(cost)
