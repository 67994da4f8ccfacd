"""Motions that a search over states of one robot is made of, and what they meet.

Every motion is a closed-loop control law held for some steps of the robot's own motion
model, so that what is found can be driven exactly.
"""

from __future__ import annotations

from math import atan, cos, hypot, sin
from typing import NamedTuple

import numpy as np

from mrmg.compilation import inlined, kernel, record_type
from mrmg.motion._kernels import USER, steer_user, step
from mrmg.planning.path_following._following_kernels import advance, track_control
from mrmg.planning.path_following._tracking_kernels import drive
from mrmg.planning.path_following.coordination._reeds_shepp_kernels import (
    MOST_PIECES,
    reeds_shepp,
)
from mrmg.planning.problem._clearance_kernels import moves_clear
from mrmg.planning.problem._control_kernels import (
    braking_control,
    control_towards,
    keeps_limits,
)
from mrmg.planning.problem._region_kernels import in_region

BRAKE, HOME, VISIT, STAY, TRACK, HOLD, MOVE = range(-4, 3)
"""Brake, or drive home, and be through; drive to a target's pose; stand in a target;
follow the path; brake, and stand; hold a speed and a steering, numbered from MOVE on.
"""

WAYPOINTS = 8
"""Motions of a custom motion model that steer to points; the others hold controls."""

SETTLING_SHARE = 0.45
"""Share of a turn's radius that a car may drive while it steers into the turn."""

SPACING_M = 0.3
"""Distance of the nodes of a curve that is driven along."""

LONG = 1 << 40
"""Steps after which no stay keeps a robot: motions end stays themselves."""

REACH_STEPS = 80
"""Steps that driving along a curve may take beyond its length at full speed."""


OTHER = record_type(
    [
        ("last", np.int64),  # number of its last state
        ("closing", np.float64),  # what it and own robot near in a step, at most [m]
        ("hard", np.bool_),  # no conflict with it may be
        ("soft", np.bool_),  # conflicts with it cost
    ]
)
"""Another robot, as the one that plans sees it."""


class Traffic(NamedTuple):
    """The other robots' motions; after its last state a robot stays.

    Attributes:
        fleet: all robots, shape (R,).
        pose: x, y, heading, and its cosine and sine, at each step, shape (R, K, 5).
        middle: middles of the footprints, shape (R, K, 2).
        robot: `OTHER`, shape (R,).
        busy: whether a robot that must not be met is in a mutual-exclusion zone, shape
            (G, K).
        end: step from which on all of them stand.
    """

    fleet: np.ndarray
    pose: np.ndarray
    middle: np.ndarray
    robot: np.ndarray
    busy: np.ndarray
    end: int


@inlined
def clear(own, spaces, zones, traffic, state, count, first, corner):
    """Return whether states 1 to `count` keep clear of obstacles and occupied zones.

    It takes parts of a search, as handing on a whole one costs 3 % of the time.

    Args:
        own: the robot, shape (1,).
        spaces, zones: its surroundings.
        traffic: gives when zones are occupied.
        state: shape (n, 5).
        count: number of the last one that is looked at.
        first: step of state 0.
        corner: room for a footprint, shape (2, M, 2).
    """
    busy = traffic.busy
    for k in range(count, 0, -1):  # where a motion ends most is in the way
        if own[0].model == USER and not keeps_limits(own[0], state[k]):
            return False
        if not moves_clear(own, spaces, state[k - 1], state[k], corner[0]):
            return False
        for zone in range(len(zones.zone)):
            j = min(first + k, busy.shape[1] - 1)
            if busy[zone, j] and in_region(
                zones.zone[zone], zones.corner[zone], state[k, 0], state[k, 1]
            ):
                return False
    return True


@kernel
def steer_along(own, course, segment, preview, state, dt):
    """Return (u1, u2, segment) of a custom motion model that follows a path.

    It is steered to the point of the path that lies `preview` metres ahead.
    """
    last = course.size[0] - 1
    if segment > last:
        u1, u2 = braking_control(own, 0, state, dt)
        return u1, u2, segment
    i, s = advance(course, segment, state[0], state[1])
    ahead = i
    while ahead + 2 <= last and course.node[ahead + 1].way < s + preview:
        ahead += 1
    size = max(course.node[ahead + 1].way - course.node[ahead].way, 1e-9)
    t = min(1.0, max(0.0, (s + preview - course.node[ahead].way) / size))
    x = (1.0 - t) * course.node[ahead].x + t * course.node[ahead + 1].x
    y = (1.0 - t) * course.node[ahead].y + t * course.node[ahead + 1].y
    u1, u2 = steer_user(own[0], state, x, y, 1.0, dt)
    return u1, u2, last + 1 if s > course.node[last].way - 0.5 * preview else i


@kernel
def move(search, motion, segment, steps, state, control):
    """Write the states and controls of a motion from state[0]; return the segment.

    Args:
        search: gives robot, path, motions and step.
        motion: TRACK, HOLD, or from MOVE on a wanted speed and steering; of a custom
            motion model a waypoint in the robot's frame, then a control.
        segment: of its path that it is on.
        steps: number of steps.
        state: shape (n, 5), n > steps.
        control: shape (n, 2).
    """
    own, dt = search.own, search.dt
    v = w = x = y = 0.0
    if motion >= MOVE:
        v, w = (
            search.task.motion[motion - MOVE, 0],
            search.task.motion[motion - MOVE, 1],
        )
        c, s = cos(state[0, 2]), sin(state[0, 2])
        x, y = state[0, 0] + c * v - s * w, state[0, 1] + s * v + c * w
    for k in range(steps):
        if motion == TRACK and own[0].model == USER:
            u1, u2, segment = steer_along(
                own, search.course, segment, search.task.preview, state[k], dt
            )
        elif motion == TRACK:
            u1, u2, segment, _, _ = track_control(
                own, search.course, segment, LONG, state[k], dt
            )
        elif motion == HOLD:
            u1, u2 = braking_control(own, 0, state[k], dt)
        elif own[0].model == USER and motion < MOVE + WAYPOINTS:
            u1, u2 = steer_user(own[0], state[k], x, y, 1.0, dt)
        elif own[0].model == USER:
            u1, u2 = v, w
        else:
            u1, u2 = control_towards(own, 0, state[k], v, w, dt)
        control[k, 0], control[k, 1] = u1, u2
        step(own[0], state[k], u1, u2, dt, state[k + 1])
    return segment


@kernel
def drivable_radius(robot):
    """Return the radius of turns that a car hardly leaves as it steers [m]."""
    radius = 1.08 * robot.turning_radius
    for _ in range(20):
        steering_s = atan(robot.wheelbase / radius) / robot.limit[4]
        if robot.limit[1] * steering_s <= SETTLING_SHARE * radius:
            break
        radius *= 1.1
    return radius


@kernel
def write_curve(own, state, x, y, theta, tolerance, course, radius):
    """Write a path to a pose: the shortest curve of a radius, or a line.

    Args:
        own: the robot, shape (1,).
        state: where it begins.
        x, y, theta: where it ends.
        tolerance: deviation from that heading up to which it does not turn there [rad].
        course: receives the path.
        radius: of turns [m]; 0 for a line, which ends with any heading.

    Returns:
        Its length [m]; inf if there is none, or no room for it.
    """
    dx, dy = x - state[0], y - state[1]
    turn, length = np.zeros(MOST_PIECES), np.zeros(MOST_PIECES)
    if radius > 0.0:
        reverses = own[0].limit[0] < 0.0
        total = reeds_shepp(dx, dy, state[2], theta, radius, reverses, turn, length)
        heading = state[2]
    else:
        total = length[0] = hypot(dx, dy)
        heading, radius = np.arctan2(dy, dx), 1.0
    if not total < SPACING_M * (len(course.node) - 2 * MOST_PIECES):
        return np.inf
    px, py = state[0], state[1]
    course.node[0].x, course.node[0].y = px, py
    n = stretch = 0
    for p in range(MOST_PIECES):
        if abs(length[p]) < 1e-6:
            continue
        gear = 1 if length[p] > 0.0 else -1
        bend = gear * turn[p] / radius
        if n > 0 and course.node[n - 1].gear != gear:
            course.node.end[stretch:n] = n
            stretch = n
            course.node[n].bend = bend
        if n == 0:
            course.node[0].bend = bend
        pieces = int(abs(length[p]) / SPACING_M) + 1
        way = length[p] / pieces
        for _ in range(pieces):
            # The chord of the arc.
            swing = 0.5 * way * turn[p] / radius
            chord = way * (sin(swing) / swing if abs(swing) > 1e-9 else 1.0)
            px += chord * cos(heading + swing)
            py += chord * sin(heading + swing)
            heading += 2.0 * swing
            course.node[n].gear = gear
            n += 1
            course.node[n].x, course.node[n].y = px, py
            course.node[n].way = course.node[n - 1].way + abs(chord)
            course.node[n].bend = bend
    course.node.end[stretch : n + 1] = n
    course.node.tolerance[:n] = np.inf
    course.node[n].heading, course.node[n].tolerance = theta, tolerance
    course.size[0] = n + 1 if n > 0 else 0
    return total


@kernel
def drive_curve(search, course, state, control):
    """Drive along a path until the robot rests at its end; return the steps, or -1.

    It is given up where an obstacle is in the way.

    Args:
        search: gives robot, surroundings and step.
        course: the path.
        state: from state[0] on, shape (n, 5).
        control: shape (n, 2).
    """
    own, dt = search.own, search.dt
    way = course.node[max(course.size[0] - 1, 0)].way
    most = int(way / (own[0].limit[1] * dt)) + REACH_STEPS
    control = control[: min(most, len(control) - 1)]
    count, arrived = drive(
        own, search.spaces, search.terrain, course, dt, np.empty(0), state, control
    )
    return count if arrived else -1
