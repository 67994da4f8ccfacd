"""How robots that turn on the spot get into places too narrow for that, and out.

Before such a target they turn, back in, and leave it forwards; from such a start they
drive straight on, or back, until there is room to turn.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sin

import numpy as np

from mrmg.planning.path_following._following_kernels import ASKEW
from mrmg.planning.path_following.band import Path, turns_of
from mrmg.planning.path_following.cost_map import ROOM_SHARE
from mrmg.planning.problem._clearance_kernels import has_room_to_turn
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.problem.problem import Problem
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS
from mrmg.planning.roadmap.vertices import FARTHEST_M, STEP_M

BEARINGS = 8
"""Places around a target's middle where a robot may turn round, ..."""

INNER_SHARE = 0.5
"""... and how far from it they lie, as a share of the target's reach."""


def turned_outside(problem: Problem, r: int, path: Path, passing: float) -> Path:
    """Return robot r's path with its turns on the spot where there is room for them.

    Args:
        problem: the mission.
        r: robot.
        path: along its tour.
        passing: turn up to which it passes through narrow targets [rad].
    """
    if problem.mission.fleet[r]["limit"][0] >= 0.0:  # it cannot drive backwards
        return path
    turns = dict(turns_of(path))
    for i, stop in reversed([*enumerate(path.stop.tolist())]):
        if stop > 0 and _is_narrow(problem, r, int(path.target[i])):
            path = replace(path, pivot=path.pivot[path.pivot != stop])
            if turns.get(stop, pi) > passing:
                path = _backed_in(problem, r, path, stop)
    if turns.get(0, 0.0) > ASKEW and not _turns_at(problem, r, *path.node[0]):
        path = _driven_out(problem, r, path)
    return path


def _is_narrow(problem: Problem, r: int, target: int) -> bool:
    """Return whether a robot has no room to turn round in a target."""
    aim = problem.mission.targets.target[target]
    angle = np.linspace(0.0, 2.0 * pi, BEARINGS, endpoint=False)
    ring = INNER_SHARE * float(aim["reach"]) * np.stack([np.cos(angle), np.sin(angle)])
    places = aim["center"] + np.concatenate([np.zeros((1, 2)), ring.T])
    return not any(
        _turns_at(problem, r, x, y)
        for x, y in places.tolist()
        if in_target(problem.mission.targets, target, x, y)
    )


def _turns_at(problem: Problem, r: int, x: float, y: float) -> bool:
    """Return whether a robot has room to turn round somewhere."""
    mission, corner = problem.mission, np.empty((MOST_CORNERS, 2))
    own = mission.fleet[r : r + 1]
    margin_m = (1.0 + ROOM_SHARE) * float(own[0]["margin"])
    return bool(has_room_to_turn(own, mission.spaces, x, y, margin_m, corner))


def _backed_in(problem: Problem, r: int, path: Path, stop: int) -> Path:
    """Return the path on which robot r turns before a stop, and drives back to it."""
    way = path.way
    edge = int(path.edges[path.edges < stop].max())
    least = max(way[edge], way[stop] - FARTHEST_M)
    for at in np.arange(way[stop] - STEP_M, least, -STEP_M):
        place = path.points(np.array([at]))[0]
        if _turns_at(problem, r, *place):
            number = int(np.searchsorted(way, at))
            path = _with_node(path, number, place)
            path.gear[number : stop + 1] *= -1
            return replace(path, pivot=np.unique([*path.pivot, number]))
    return path


def _driven_out(problem: Problem, r: int, path: Path) -> Path:
    """Return the path on which robot r drives straight on, or back, before it turns."""
    ahead = np.array([cos(path.heading), sin(path.heading)])
    for way in np.arange(STEP_M, FARTHEST_M, STEP_M):
        for gear in (1, -1):
            place = path.node[0] + gear * way * ahead
            if _turns_at(problem, r, *place):
                path = _with_node(path, 1, place)
                path.gear[0] = gear
                return replace(path, pivot=np.unique([*path.pivot[path.pivot > 0], 1]))
    return path


def _with_node(path: Path, number: int, place: np.ndarray) -> Path:
    """Return a path with one more node, in the gear of the segment that it divides."""
    return replace(
        path,
        node=np.insert(path.node, number, place, axis=0),
        gear=np.insert(path.gear, number, path.gear[number - 1]),
        stop=path.stop + (path.stop >= number),
        pivot=path.pivot + (path.pivot >= number),
    )
