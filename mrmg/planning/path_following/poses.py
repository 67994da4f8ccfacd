"""Ways of robots that have to turn among obstacles, found over their poses.

They are for tours on which a robot finds no room along the roadmap's paths: these know
places but no headings. What is found can be driven as it is, by cars whose steering is
slow for their size with stops where they steer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import cos, pi, sin

import numpy as np

from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.path_following import _pose_kernels, _shortening_kernels
from mrmg.planning.path_following._band_kernels import CostMap, Stops
from mrmg.planning.path_following._curve_kernels import PIECES, SHORTEST_M
from mrmg.planning.path_following._pose_kernels import POSE, PoseSearch
from mrmg.planning.path_following.band import Path, visit_steps
from mrmg.planning.path_following.coordination.fields import Fields
from mrmg.planning.path_following.coordination.tasks import arrival_poses
from mrmg.planning.path_following.pauses import with_pauses
from mrmg.planning.path_following.robot_task import RobotTask
from mrmg.planning.path_following.tracking import drive_alone
from mrmg.planning.problem._clearance_kernels import keeps_clear
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import poses_at
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS
from mrmg.scene.region import Region

HEADINGS = 32
"""Headings in a full turn."""

BEND_SHARE = 0.95
"""Curvature of turns, as a share of the sharpest that paths may have."""

CELL_SHARES = (0.8, 0.27)
"""Side of a cell, as a share of an arc's length: away from the start and targets, and
near them."""

JUMP_SHARE = 0.5
"""Change of curvature that a car may stop for, as a share of that of its turns."""

STRAIGHT_SHARE = 0.5
"""Arc's length of a robot that turns on the spot, as a share of its radius."""

GATES = 10
"""Places of gates before a target in either gear, the robot's radius apart."""

DRAWN_IN = 5
"""Poses looked at from that of most room towards a target's middle: the first one that
is deep enough in the target is driven to."""

DEEPER_M = 0.03
"""How much deeper than needed targets are entered: driving is a little off its way. Of
small targets, and where there is little room, it is half of what there is."""

CHANGE_M = 1.0
"""Plain ground that a change of gear is worth to a car [m]."""

SOON_WEIGHT = 1.3
"""Weight of the cost-to-go where ways are wanted soon: it takes two thirds of the time,
and ways cost more."""

ROOM_SHARE = 0.06
"""Room beyond the margin that ways leave where they can, as a share of the robot's
radius: driving is a little off them."""

TIGHT_SHARE = 8.0
"""What an arc without that room costs more, as a share of its length."""

MOST_POSES = 70_000
"""Poses of a search at most: a third of a second. Of 330 searches that found a way, one
looked at more; those that find none are better spent on other margins and tours."""


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
    gates, gate, deeper = _gates(problem, r, tour)
    search = PoseSearch(
        own=own,
        start=problem.start[r, :3].copy(),
        spaces=problem.mission.spaces,
        stops=Stops(targets, target, target, deeper, problem.aims(r, tour)),
        gates=gates,
        gate=gate,
        guide=Fields(problem).static(r, tour),
        bend=bend,
        length=length,
        headings=HEADINGS,
        cell=length * np.array(CELL_SHARES),
        room=ROOM_SHARE * float(own[0]["radius"]),
        tight=TIGHT_SHARE * length / PIECES,
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


def _gates(
    problem: Problem, r: int, tour: Sequence[int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (gates, gate, deeper) to robot r's targets: see `PoseSearch`, `Stops`."""
    targets, ends = problem.mission.targets, arrival_poses(problem, r, tour)
    gears = (1, -1) if problem.mission.fleet["limit"][r, 0] < 0.0 else (1,)
    gates, gate, deeper = list[tuple[float, ...]](), [0], list[float]()
    for target, end in zip(tour, ends, strict=False):
        region = poses_at(targets, target).region
        if targets.target["tolerance"][target] < pi:
            end = _drawn_in(problem, r, region, end)
            for gear in gears:
                gates += _gates_before(problem, r, end, gear)
        gate.append(len(gates))
        deeper.append(min(DEEPER_M, 0.5 * region.depth(end[:2]).item()))
    return np.array(gates, float).reshape(-1, 4), np.array(gate), np.array(deeper)


def _drawn_in(problem: Problem, r: int, region: Region, end: np.ndarray) -> np.ndarray:
    """Return a pose deep enough in a target, on the line ahead of a given one.

    The nearest of some on the way to the target's middle; where none is deep enough, or
    robot r has no room there, the given one.
    """
    own, spaces = problem.mission.fleet[r : r + 1], problem.mission.spaces
    margin_m, corner = float(own[0]["margin"]), np.empty((MOST_CORNERS, 2))
    ahead = np.array([cos(end[2]), sin(end[2]), 0.0])
    far_m = (region.center - end[:2]) @ ahead[:2]
    poses = end + np.linspace(0.0, far_m, DRAWN_IN)[:, None] * ahead
    pose = poses[(region.depth(poses[:, :2]) >= DEEPER_M).argmax()]
    return pose if keeps_clear(own, spaces, pose, margin_m, corner) else end


def _gates_before(
    problem: Problem, r: int, end: np.ndarray, gear: int
) -> Iterator[tuple[float, ...]]:
    """Yield the gates from which robot r drives to a pose straight in some gear.

    There is room for the robot in all of them, and on the way on from them.
    """
    own, spaces = problem.mission.fleet[r : r + 1], problem.mission.spaces
    margin_m, radius_m = float(own[0]["margin"]), float(own[0]["radius"])
    corner = np.empty((MOST_CORNERS, 2))
    for i in range(GATES):
        way_m = gear * i * radius_m
        gate = end - way_m * np.array([cos(end[2]), sin(end[2]), 0.0])
        if not keeps_clear(own, spaces, gate, margin_m, corner):
            return
        yield (*gate, way_m)


def _ways_of(search: PoseSearch) -> tuple[Path, ...]:
    """Return the way over poses that a search finds, as it is and to stop and steer.

    Nothing if it finds none among MOST_POSES. Cars stop where the way's curvature
    jumps.
    """
    stops, poses = search.stops, np.empty(MOST_POSES, POSE)
    table = np.full(1 << (2 * MOST_POSES).bit_length(), -1, np.int64)
    last = _pose_kernels.find_poses(search, poses, table)
    if last < 1:
        return ()
    pose, stop, kept = _pose_kernels.poses_to(search, poses, last)
    way, stop = _shortening_kernels.shortest_way(search, pose, stop, kept)
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
