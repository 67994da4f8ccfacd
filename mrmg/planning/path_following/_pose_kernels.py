"""Search over a robot's poses along its tour, among obstacles alone.

An A* whose nodes are poses, of which one counts in each cell of position and heading:
hybrid A*, D. Dolgov et al., Practical search techniques in path planning for autonomous
driving, 2008. A car drives straight or turns as sharply as its paths may, in either
gear; a robot that can turn on the spot does so.

Arcs of a few headings lead into no bay hardly wider than the robot. So to a target that
wants a heading, a shortest curve leads on, too, to a gate: a pose from which the robot
drives straight to the one that it is to have at the target. Gates take turns.

Once a target is reached, ways go on from there alone: else long tours would take more
poses than there is room for. A robot that can turn round, or back out the way it came,
loses no way by that, only some of the cheapest ones.
"""

from __future__ import annotations

from math import floor, hypot, pi
from typing import NamedTuple

import numpy as np

from mrmg.compilation import borrowed, kernel, record_type
from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.path_following._band_kernels import Stops, outside
from mrmg.planning.path_following._curve_kernels import (
    PARTS,
    parts_cost,
    pieces_of,
    write_curve,
    write_parts,
)
from mrmg.planning.path_following.coordination._guide_kernels import Guide, guide_at
from mrmg.planning.path_following.coordination._node_kernels import place_of
from mrmg.planning.problem._clearance_kernels import keeps_clear
from mrmg.planning.problem._control_kernels import wrap
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS, Spaces
from mrmg.planning.roadmap._heap_kernels import pop, push

ARCS = 6
"""Arcs that lead on from a pose: to the right, straight, to the left, in either gear.
"""

STRAIGHTER = 0.1
"""How much nearer to its heading than needed a target is visited [rad]: driving is a
little off its way."""

NO_WAY = -1
"""Instead of the number of a pose: that none was found."""

POSE = record_type(
    [
        ("before", np.int64),  # number of the pose before it, -1 at the start
        ("way_on", np.int64),  # number of the way to it
        ("pieces", np.int64),  # of that way
        ("gear", np.int64),  # in which that ends, 0 at the start
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
        gates: to all targets: (x, y, heading, straight way on), this negative
            backwards, shape (G, 4) [m, rad].
        gate: number of the first one to each target, and of all, shape (S + 1,).
        guide: costs-to-go on each leg.
        bend: curvature of a car's turns [1/m].
        length: of an arc [m].
        headings: in a full turn.
        cell: side of a cell of positions, away from the start and targets, and near
            them, shape (2,) [m].
        room: beyond the margin, which ways leave where they can [m].
        tight: plain ground that a piece without this room is worth [m].
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
    gates: np.ndarray
    gate: np.ndarray
    guide: Guide
    bend: float
    length: float
    headings: int
    cell: np.ndarray
    room: float
    tight: float
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
def write_way_on(search, way_on, a, way, turn):
    """Write the parts of a way on from a pose; return whether there is one.

    Args:
        search: what is searched for.
        way_on: number of an arc, or ARCS plus that of a gate.
        a: pose, shape (3,).
        way, turn: receive what `write_parts` writes.
    """
    if way_on < ARCS:
        gear, side = 1 - way_on // 3 * 2, way_on % 3 - 1
        way[:], turn[:] = 0.0, 0.0
        way[0] = 0.0 if pivots(search, side) else gear * search.length
        turn[0] = gear * side * 2.0 * pi / search.headings
        return may_drive(search, gear, side)
    found = write_parts(search, a, search.gates[way_on - ARCS], way, turn)
    way[-1] = search.gates[way_on - ARCS, 3]
    return found


@kernel
def drive_on(search, pose, way_on, curve):
    """Write the pieces of a way on from a pose.

    Args:
        search: what is searched for.
        pose: `POSE`.
        way_on: its number.
        curve: receives what `write_curve` writes.

    Returns:
        (pieces, straight, cost, gear): the number of pieces, not positive if there is
        no such way, and of those straight on from a gate; the gear that it ends in.
    """
    way, turn = np.empty(PARTS), np.empty(PARTS)
    begin = np.array([pose.x, pose.y, pose.theta])
    if not write_way_on(search, way_on, begin, way, turn):
        return 0, 0, np.inf, 0
    cost, gear = parts_cost(search, pose.gear, way, turn)
    pieces = write_curve(search, begin, way, turn, curve)
    return pieces, pieces_of(search, way[-1], turn[-1]), cost, gear


@kernel
def is_near(search, leg, x, y):
    """Return whether a place is near the start, or the target before or after."""
    stops = search.stops
    near = hypot(x - search.start[0], y - search.start[1]) < search.near
    for i in range(max(0, leg - 1), min(leg + 1, len(stops.target))):
        target = stops.targets.target[stops.target[i]]
        far = hypot(x - target.center[0], y - target.center[1])
        near = near or far < target.reach + search.near
    return near


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
def tight_cost(search, piece, straight, corner):
    """Return what a way costs for the room it leaves; inf if that is none.

    Its last pieces, some number of them straight on from a gate, cost nothing.
    """
    own, spaces, margin, cost = search.own, search.spaces, search.own[0].margin, 0.0
    for i in range(len(piece) - 1, -1, -1):
        priced = i < len(piece) - straight
        room = margin + search.room
        if not (priced and keeps_clear(own, spaces, piece[i], room, corner)):
            if not keeps_clear(own, spaces, piece[i], margin, corner):
                return np.inf
            cost += search.tight if priced else 0.0
    return cost


@kernel
def rest_m(search, leg, x, y):
    """Return the cost-to-go from a place on a leg [m]; inf if there is none."""
    if leg == len(search.stops.target):
        return 0.0
    return guide_at(search.guide, leg, 0, x, y) * search.own[0].limit[1]


@kernel
def cell_of(search, leg, x, y, theta):
    """Return the number of the cell that a pose lies in."""
    near, step = int(is_near(search, leg, x, y)), 2.0 * pi / search.headings
    heading = int(round((theta - search.start[2]) / step)) % search.headings
    key = int(floor(x / search.cell[near])) & 0xFFFF
    key = key << 16 | int(floor(y / search.cell[near])) & 0xFFFF
    return ((key << 1 | near) << 10 | heading) << 16 | leg


@kernel
def write_start(search, first):
    """Write the pose that a search begins with."""
    first.before, first.way_on, first.pieces, first.gear, first.cost = -1, -1, 0, 0, 0.0
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
        NO_WAY if there are none, or more than there is room for.
    """
    search, poses, table = borrowed(search), borrowed(poses), borrowed(table)
    legs, most = len(search.stops.target), len(poses)
    key, entry = np.empty(most + 1), np.empty(most + 1, np.int64)
    least = np.full(len(table), np.inf)  # cost of a cell's pose; of a closed one -inf
    curve, corner = np.empty((most, 4)), np.empty((MOST_CORNERS, 2))
    write_start(search, poses[0])
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
        cell = cell_of(search, pose.leg, pose.x, pose.y, pose.theta)
        at = place_of(table, cell)
        if pose.cost > least[at]:
            continue
        table[at], least[at] = cell, -np.inf
        gates = search.gate[pose.leg + 1] - search.gate[pose.leg]
        for i in range(ARCS + min(gates, 1)):
            way_on = i if i < ARCS else ARCS + search.gate[pose.leg] + a % gates
            pieces, straight, more, gear = drive_on(search, pose, way_on, curve)
            if pieces < 1:
                continue
            cost, (x, y, theta, _) = pose.cost + more, curve[pieces - 1]
            leg = legs_after(search, pose.leg, curve[:pieces])
            leg = leg if i < ARCS else max(leg, pose.leg + 1)
            cell = cell_of(search, leg, x, y, theta)
            at = place_of(table, cell)
            rest = rest_m(search, leg, x, y)
            if not (cost < least[at] and rest < np.inf):
                continue
            cost += tight_cost(search, curve[:pieces], straight, corner)
            if not cost < least[at]:
                continue
            if size == most:
                return NO_WAY
            table[at], least[at] = cell, cost
            after = poses[size]
            after.before, after.way_on, after.pieces = a, way_on, pieces
            after.gear, after.leg, after.cost = gear, leg, cost
            after.x, after.y, after.theta = x, y, theta
            opened = push(key, entry, opened, cost + search.weight * rest, size)
            size += 1
    return NO_WAY


@kernel
def poses_to(search, poses, last):
    """Return (pose, stop, kept) on the way to a pose: its poses, and some of them.

    Args:
        search: what was searched for.
        poses: that were found.
        last: number of the one that the way leads to.

    Returns:
        Poses, shape (n, 3), up to the last target; the number of the one at each
        target, shape (S,); whether a pose is at a target or a gate, shape (n,).
    """
    n, b = 1, last
    while poses[b].before >= 0:
        n, b = n + poses[b].pieces, poses[b].before
    pose, stop = np.empty((n, 3)), np.zeros(len(search.stops.target), np.int64)
    kept, curve = np.zeros(n, np.bool_), np.empty((n, 4))
    pose[0], b = search.start, last
    while poses[b].before >= 0:
        after, before = poses[b], poses[poses[b].before]
        pieces, straight, _, _ = drive_on(search, before, after.way_on, curve)
        n, leg = n - pieces, before.leg
        pose[n : n + pieces] = curve[:pieces, :3]
        for i in range(pieces):
            visited = legs_after(search, leg, curve[i : i + 1])
            visited = visited if i < pieces - 1 else after.leg
            stop[leg:visited] = n + i
            leg = visited
        kept[n + pieces - 1 - straight] = after.way_on >= ARCS
        b = after.before
    kept[stop] = True
    size = stop[-1] + 1
    return pose[:size], stop, kept[:size]
