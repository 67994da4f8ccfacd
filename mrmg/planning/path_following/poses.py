"""Ways of robots that have to turn among obstacles, found over their poses.

They are for tours on which a robot finds no room along the roadmap's paths: these know
places but no headings. What is found can be driven as it is, by cars whose steering is
slow for their size with stops where they steer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import pi

import numpy as np

from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.path_following import _pose_kernels, _shortening_kernels
from mrmg.planning.path_following._band_kernels import CostMap, Stops
from mrmg.planning.path_following._pose_kernels import POSE, PoseSearch
from mrmg.planning.path_following._shortening_kernels import SHORTEST_M
from mrmg.planning.path_following.band import Path, visit_steps
from mrmg.planning.path_following.coordination.fields import Fields
from mrmg.planning.path_following.cost_map import ROOM_SHARE
from mrmg.planning.path_following.pauses import with_pauses
from mrmg.planning.path_following.robot_task import RobotTask
from mrmg.planning.path_following.tracking import drive_alone
from mrmg.planning.problem.problem import Problem

HEADINGS = 32
"""Headings in a full turn."""

BEND_SHARE = 0.95
"""Curvature of turns, as a share of the sharpest that paths may have."""

CELL_SHARES = (0.8, 0.27, 0.27)
"""Side of a cell, as a share of an arc's length: away from targets, near one, and near
the start."""

JUMP_SHARE = 0.5
"""Change of curvature that a car may stop for, as a share of that of its turns."""

STRAIGHT_SHARE = 0.5
"""Arc's length of a robot that turns on the spot, as a share of its radius."""

DEEPER_M = 0.03
"""How much deeper than needed targets are entered: driving is a little off its way."""

CHANGE_M = 1.0
"""Plain ground that a change of gear is worth to a car [m]."""

SOON_WEIGHT = 1.3
"""Weight of the cost-to-go where ways are wanted soon: it takes two thirds of the time,
and ways cost more."""

ROOMS_M = (0.03, 0.0)
"""Room beyond the margin near targets, in successive tries: there are places with no
more room than the margin."""

MOST_POSES = 200_000
"""Poses of a search at most: about half a second, and 25 MB."""


def posed(
    problem: Problem,
    r: int,
    cost_map: CostMap,
    tour: Sequence[int],
    halt: np.ndarray,
    *,
    soon: bool = False,
) -> RobotTask | None:
    """Return a way of robot r over poses, and how it drives it if it can, or None.

    If it cannot, it may once the way is smoothed.

    Args:
        problem: the mission.
        r: robot, whose motion is one of ours.
        cost_map: what its paths are priced on.
        tour: numbers of its targets.
        halt: shape (1,); the search ends soon after it has turned true.
        soon: whether a way soon is worth more than a cheap one.
    """
    own, targets = problem.mission.fleet[r : r + 1], problem.mission.targets
    bend, target = BEND_SHARE * cost_map.curvature, np.array(tour, np.int64)
    length, change_m = 2.0 * pi / HEADINGS / bend, CHANGE_M
    if own[0]["model"] == UNICYCLE:
        length, change_m = STRAIGHT_SHARE * float(own[0]["radius"]), 0.0
    deeper = np.full(len(tour), DEEPER_M)
    search = PoseSearch(
        own=own,
        start=problem.start[r, :3].copy(),
        spaces=problem.mission.spaces,
        stops=Stops(targets, target, target, deeper, problem.aims(r, tour)),
        guide=Fields(problem).static(r, tour),
        bend=bend,
        length=length,
        headings=HEADINGS,
        cell=length * np.array(CELL_SHARES),
        room=np.full(3, own[0]["margin"]),
        near=2.0 * float(own[0]["radius"]),
        scrub=cost_map.scrub,
        change=change_m,
        weight=SOON_WEIGHT if soon else 1.0,
        halt=halt,
    )
    ways = _ways_of(search)
    for way in ways:
        drive = drive_alone(problem, r, with_pauses(problem, r, way))
        visits = visit_steps(targets, tour, drive.motion.state)
        if drive.arrived and len(visits) == len(tour):
            return RobotTask(list(tour), ways[0], cost_map, drive)
    return RobotTask(list(tour), ways[0], cost_map) if ways else None


def _ways_of(search: PoseSearch) -> tuple[Path, ...]:
    """Return the way over poses that a search finds, as it is and to stop and steer.

    Nothing if it finds none. Cars stop where the way's curvature jumps.
    """
    margin_m, stops = float(search.own[0]["margin"]), search.stops
    poses = np.empty(MOST_POSES, POSE)
    for room_m in ROOMS_M:
        room = margin_m + np.array([ROOM_SHARE * margin_m, room_m, 0.0])
        search = search._replace(room=room)
        table = np.full(1 << (2 * MOST_POSES).bit_length(), -1, np.int64)
        last = _pose_kernels.find_poses(search, poses, table)
        if last != _pose_kernels.NO_WAY:
            break
    if last < 1:
        return ()
    pose, stop = _pose_kernels.poses_to(search, poses, last)
    way, stop = _shortening_kernels.shortest_way(search, pose, stop)
    moves = np.append(True, np.hypot(*np.diff(way[:, :2], axis=0).T) > SHORTEST_M)
    number = np.cumsum(moves) - 1
    path = Path(
        node=way[moves, :2].copy(),
        gear=way[moves, 3][1:].astype(np.int64),
        heading=float(search.start[2]),
        stop=number[stop],
        target=stops.target,
        deeper=stops.deeper,
        pivot=np.unique(number[~moves]),
        pause_s=np.zeros(len(stop)),
        aim=stops.aim,
    )
    turn = (np.diff(way[moves, 2]) + pi) % (2.0 * pi) - pi
    change = np.abs(np.diff(turn / np.diff(path.way)))
    jumps = 1 + np.flatnonzero(change > JUMP_SHARE * search.bend)
    return path, replace(path, pivot=np.union1d(path.pivot, jumps))
