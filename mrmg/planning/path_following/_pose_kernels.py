"""Search over a robot's poses along its tour, among obstacles alone.

An A* whose nodes are poses, of which one counts in each cell of position and heading:
hybrid A*, D. Dolgov et al., Practical search techniques in path planning for autonomous
driving, 2008. A car drives straight or turns as sharply as its paths may, in either
gear; a robot that can turn on the spot does so.

Once a target is reached, ways go on from there alone: else long tours would take more
poses than there is room for. A robot that can turn round, or back out the way it came,
loses no way by that, only some of the cheapest ones.
"""

from __future__ import annotations

from math import cos, floor, hypot, pi, sin
from typing import NamedTuple

import numpy as np

from mrmg.compilation import borrowed, kernel, record_type
from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.path_following._band_kernels import Stops, outside
from mrmg.planning.path_following.coordination._guide_kernels import Guide, guide_at
from mrmg.planning.path_following.coordination._node_kernels import place_of
from mrmg.planning.problem._clearance_kernels import keeps_clear
from mrmg.planning.problem._control_kernels import wrap
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS, Spaces
from mrmg.planning.roadmap._heap_kernels import pop, push

WAYS_ON = 6
"""Arcs that lead on from a pose: to the right, straight, to the left, in either gear.
"""

PIECES = 3
"""Pieces of an arc; the pose at the end of each is looked at."""

STRAIGHTER = 0.1
"""How much nearer to its heading than needed a target is visited [rad]: driving is a
little off its way."""

AWAY, AT_TARGET, AT_START = range(3)
"""Where a pose is: anywhere, near a target, near the start."""

NO_WAY, NO_ROOM = -1, -2
"""Instead of the number of a pose: that none was found, and why."""

POSE = record_type(
    [
        ("before", np.int64),  # number of the pose before it, -1 at the start
        ("gear", np.int64),  # in which it is driven to, 0 at the start
        ("turn", np.int64),  # to the left 1, straight 0, to the right -1
        ("heading", np.int64),  # in steps from that at the start
        ("leg", np.int64),  # number of targets visited
        ("x", np.float64),  # [m]
        ("y", np.float64),
        ("theta", np.float64),  # [rad]
        ("cost", np.float64),  # of the way to it [m of plain ground]
    ]
)
"""A pose of a search."""


class PoseSearch(NamedTuple):
    """What poses are searched for.

    Attributes:
        own: the robot, shape (1,).
        start: its pose, shape (3,).
        spaces: free spaces of the fleet.
        stops: the targets, in order, and how deep they are entered.
        guide: costs-to-go on each leg.
        bend: curvature of a car's turns [1/m].
        length: of an arc [m].
        headings: in a full turn.
        cell: side of a cell of positions where a pose is, shape (3,) [m].
        room: distance kept from obstacles there, shape (3,) [m].
        near: distance from the start, and from a target's edge, that is near [m].
        scrub: plain ground that turning by one radian is worth [m].
        change: plain ground that a change of gear is worth [m].
        weight: of the cost-to-go.
        halt: shape (1,); the search ends soon after it has turned true.
    """

    own: np.ndarray
    start: np.ndarray
    spaces: Spaces
    stops: Stops
    guide: Guide
    bend: float
    length: float
    headings: int
    cell: np.ndarray
    room: np.ndarray
    near: float
    scrub: float
    change: float
    weight: float
    halt: np.ndarray


@kernel
def pivots(search, turn):
    """Return whether a robot takes an arc with such a turn on the spot."""
    return turn != 0 and search.own[0].model == UNICYCLE


@kernel
def may_drive(search, gear, turn):
    """Return whether a robot can drive an arc; to turn on the spot takes no gear."""
    return gear > 0 or (search.own[0].limit[0] < 0.0 and not pivots(search, turn))


@kernel
def arc_cost(search, pose, gear, turn):
    """Return the cost of an arc from a pose on [m of plain ground]."""
    cost = search.scrub * abs(turn) * 2.0 * pi / search.headings
    if not pivots(search, turn):
        cost += search.length + (search.change if gear * pose.gear < 0 else 0.0)
    return cost


@kernel
def write_arc(search, pose, gear, turn, piece):
    """Write the poses at the ends of an arc's pieces, shape (PIECES, 3)."""
    way = 0.0 if pivots(search, turn) else gear * search.length / PIECES
    swing = gear * turn * pi / search.headings / PIECES
    chord = way * (sin(swing) / swing if turn != 0 else 1.0)
    x, y, theta = pose.x, pose.y, pose.theta
    for i in range(PIECES):
        x += chord * cos(theta + swing)
        y += chord * sin(theta + swing)
        theta += 2.0 * swing
        piece[i, 0], piece[i, 1], piece[i, 2] = x, y, theta


@kernel
def where_is(search, leg, x, y):
    """Return AT_START, AT_TARGET for the target before or after, or AWAY."""
    stops = search.stops
    if hypot(x - search.start[0], y - search.start[1]) < search.near:
        return AT_START
    for i in range(max(0, leg - 1), min(leg + 1, len(stops.target))):
        target = stops.targets.target[stops.target[i]]
        far = hypot(x - target.center[0], y - target.center[1])
        if far < target.reach + search.near:
            return AT_TARGET
    return AWAY


@kernel
def legs_after(search, leg, piece):
    """Return how many targets are visited after some poses, with their headings."""
    stops = search.stops
    for i in range(len(piece)):
        while leg < len(stops.target):
            target = stops.targets.target[stops.target[leg]]
            # Headings are steps apart: one of them counts as what a target wants.
            most = max(target.tolerance - STRAIGHTER, pi / search.headings)
            off, _, _ = outside(stops, leg, piece[i, 0], piece[i, 1])
            askew = abs(wrap(target.heading - piece[i, 2]))
            if off > 0.0 or (target.tolerance < pi and askew > most):
                break
            leg += 1
    return leg


@kernel
def is_free(search, leg, piece, corner):
    """Return whether a robot has room along an arc on a leg."""
    for i in range(len(piece) - 1, -1, -1):
        room = search.room[where_is(search, leg, piece[i, 0], piece[i, 1])]
        if not keeps_clear(search.own, search.spaces, piece[i], room, corner):
            return False
    return True


@kernel
def rest_m(search, leg, x, y):
    """Return the cost-to-go from a place on a leg [m]; inf if there is none."""
    if leg == len(search.stops.target):
        return 0.0
    return guide_at(search.guide, leg, 0, x, y) * search.own[0].limit[1]


@kernel
def cell_of(search, leg, heading, x, y):
    """Return the number of the cell that a pose lies in."""
    where = where_is(search, leg, x, y)
    cell = search.cell[where]
    key = np.int64(floor(x / cell)) & 0xFFFF
    key = key << 16 | np.int64(floor(y / cell)) & 0xFFFF
    return ((key << 2 | where) << 10 | heading) << 16 | leg


@kernel
def write_start(search, first):
    """Write the pose that a search begins with."""
    first.before, first.gear, first.turn, first.heading, first.cost = -1, 0, 0, 0, 0.0
    first.x, first.y, first.theta = search.start[0], search.start[1], search.start[2]
    first.leg = legs_after(search, 0, search.start.reshape(1, 3))


@kernel
def find_poses(search, poses, table):
    """Find poses from the start through all targets; return the number of the last.

    Args:
        search: what is searched for.
        poses: room for `POSE`, shape (n,).
        table: room for more cells, all -1; its size is a power of 2.

    Returns:
        NO_WAY if there are none, NO_ROOM if there is no more room for poses.
    """
    search, poses, table = borrowed(search), borrowed(poses), borrowed(table)
    legs, most = len(search.stops.target), len(poses)
    key, entry = np.empty(most + 1), np.empty(most + 1, np.int64)
    least = np.full(len(table), np.inf)  # cost of a cell's pose; of a closed one -inf
    piece, corner = np.empty((PIECES, 3)), np.empty((MOST_CORNERS, 2))
    write_start(search, poses[0])
    cell = cell_of(search, poses[0].leg, 0, search.start[0], search.start[1])
    at = place_of(table, cell)
    table[at], least[at] = cell, 0.0
    reached, size, opened = 0, 1, push(key, entry, 0, 0.0, 0)
    while opened > 0 and not search.halt[0]:
        a = entry[0]
        opened = pop(key, entry, opened)
        pose = poses[a]
        if pose.leg == legs:
            return a
        if pose.leg < reached:
            continue
        reached = pose.leg
        at = place_of(table, cell_of(search, pose.leg, pose.heading, pose.x, pose.y))
        if pose.cost > least[at]:
            continue
        least[at] = -np.inf
        for arc in range(WAYS_ON):
            gear, turn = 1 - arc // 3 * 2, arc % 3 - 1
            if not may_drive(search, gear, turn):
                continue
            write_arc(search, pose, gear, turn, piece)
            x, y, theta = piece[-1]
            heading = (pose.heading + gear * turn) % search.headings
            leg = legs_after(search, pose.leg, piece)
            cost = pose.cost + arc_cost(search, pose, gear, turn)
            cell = cell_of(search, leg, heading, x, y)
            at = place_of(table, cell)
            rest = rest_m(search, leg, x, y)
            if not (cost < least[at] and rest < np.inf):
                continue
            if not is_free(search, pose.leg, piece, corner):
                continue
            if size == most:
                return NO_ROOM
            table[at], least[at] = cell, cost
            after = poses[size]
            after.before, after.gear, after.turn = a, gear, turn
            after.heading, after.leg, after.cost = heading, leg, cost
            after.x, after.y, after.theta = x, y, theta
            opened = push(key, entry, opened, cost + search.weight * rest, size)
            size += 1
    return NO_WAY


@kernel
def poses_to(search, poses, last):
    """Return (pose, stop) on the way to a pose: its poses, and those at targets.

    Args:
        search: what was searched for.
        poses: that were found.
        last: number of the one that the way leads to.

    Returns:
        Poses, shape (n, 3), up to the last target; the number of the one at each
        target, shape (S,).
    """
    n, b = 1, last
    while poses[b].before >= 0:
        n, b = n + PIECES, poses[b].before
    pose, stop = np.empty((n, 3)), np.zeros(len(search.stops.target), np.int64)
    pose[0] = search.start
    b = last
    while poses[b].before >= 0:
        arc, leg = poses[b], poses[poses[b].before].leg
        n -= PIECES
        piece = pose[n : n + PIECES]
        write_arc(search, poses[arc.before], arc.gear, arc.turn, piece)
        for i in range(PIECES):
            after = legs_after(search, leg, piece[i : i + 1])
            stop[leg:after] = n + i
            leg = after
        b = arc.before
    return pose[: stop[-1] + 1], stop
