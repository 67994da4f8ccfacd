"""The law by which a robot follows its path: its place, speed, steering, control."""

from __future__ import annotations

from math import atan, atan2, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from mrmg.compilation import inlined, kernel, record_type
from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.problem._control_kernels import (
    REST,
    braking_control,
    control_towards,
    stands,
    wrap,
)

PREVIEW_S = 0.2
"""How far ahead the path's curvature is read."""

ARRIVED_M = 0.015
"""Way left at which a robot stops."""

ALIGNED = 0.15
"""Steering error up to which a standing robot sets out [rad]."""

ASKEW = 0.1
"""Heading error up to which a standing robot that can turn on the spot sets out ..."""

FAR_ASKEW = 1.0
"""... and beyond which it stops to do so [rad]."""

CREEPING, STANDING, PREVIEWED = 0.02, 0.05, 0.2
"""Speeds with which a robot arrives at least, below which it counts as standing, and
with which the path is looked at ahead at least: in units of its `pace`."""

TURNING_SHARE = 0.9
"""Share of the acceleration of turning with which a turn on the spot is slowed down."""


START = -1
"""Segment of a robot that stays, or turns, where its path begins."""

COURSE_NODE = record_type(
    [
        ("x", np.float64),  # [m]
        ("y", np.float64),  # [m]
        ("gear", np.int64),  # of the segment that begins there
        ("bend", np.float64),  # curvature, left positive in the direction of travel
        ("way", np.float64),  # to it [m]
        ("end", np.int64),  # node at which the segment's stretch ends: see Course
        ("fastest", np.float64),  # speed at which it is passed at most [m/s]
        ("pause", np.int64),  # steps for which the robot stands there: see Course
        ("rest_s", np.float64),  # what is left, as time on plain ground [s]
        ("heading", np.float64),  # that the robot turns to where it stands there ...
        ("tolerance", np.float64),  # ... and the deviation allowed, inf for any [rad]
    ]
)
"""A node of a path."""


class Course(NamedTuple):
    """A path, and what its robot must know of it.

    A stretch ends where the gear changes or the robot turns on the spot; robots pause
    at the start and the ends of stretches only, and there alone turn on the spot to a
    heading.

    Attributes:
        node: `COURSE_NODE`, shape (N,).
        size: number of nodes that count, shape (1,).
        ease: deceleration that costs nothing [m/s^2].
        stiffness: how fast it returns to its path: errors decay over about its inverse
            [1/m].
    """

    node: np.ndarray
    size: np.ndarray
    ease: float
    stiffness: float


@inlined
def advance(course, i, x, y):
    """Return (segment, way along the path) nearest to a point, from segment i on."""
    while True:
        ax, ay = course.node[i].x, course.node[i].y
        bx, by = course.node[i + 1].x - ax, course.node[i + 1].y - ay
        size = sqrt(bx * bx + by * by)
        along = ((x - ax) * bx + (y - ay) * by) / max(size, 1e-9)
        if along < size or i + 1 >= course.node[i].end:
            return i, course.node[i].way + along
        i += 1


@kernel
def bend_at(course, i, s):
    """Return the curvature of the path at a way, within the stretch of segment i."""
    last = course.node[i].end
    while i + 1 < last and course.node[i + 1].way < s:
        i += 1
    size = course.node[i + 1].way - course.node[i].way
    t = min(1.0, max(0.0, (s - course.node[i].way) / max(size, 1e-9)))
    return course.node[i].bend + t * (course.node[i + 1].bend - course.node[i].bend)


@kernel
def lacking(course, i, state):
    """Return the angle by which a robot has to turn where it stands at a node [rad]."""
    off = wrap(course.node[i].heading - state[2])
    return off if abs(off) >= 0.5 * course.node[i].tolerance else 0.0


@kernel
def first_segment(course, state):
    """Return the segment that a robot begins on."""
    if course.node[0].pause > 0 or lacking(course, 0, state) != 0.0:
        return START
    return 0 if course.size[0] > 1 else course.size[0]


@kernel
def at_rest(course, segment, state):
    """Return whether a robot stands at its path's end as it is to end there."""
    if segment < course.size[0]:
        return False
    return lacking(course, max(course.size[0] - 1, 0), state) == 0.0


@kernel
def slowing(speed, last, way, ease, dt):
    """Return the speed v after a step from which a robot just slows down in time.

    The step leaves what it takes to do so: way - (speed + v) dt / 2 is to be
    (v^2 - last^2) / (2 ease).

    Args:
        speed: at the beginning of the step [m/s, or rad/s].
        last: speed at the end of the way.
        way: from the beginning of the step [m, or rad].
        ease: deceleration [m/s^2, or rad/s^2].
        dt: step [s].
    """
    lost = 0.5 * ease * dt
    square = last * last + 2.0 * ease * (way - 0.5 * speed * dt) + lost * lost
    return max(sqrt(max(square, 0.0)) - lost, 0.0)


@kernel
def turning_rate(own, angle, state, dt):
    """Return the rate after a step of turning on the spot by an angle [rad/s]."""
    side = 1.0 if angle >= 0.0 else -1.0
    ease = TURNING_SHARE * own[0].limit[4]
    return side * slowing(side * state[4], 0.0, abs(angle), ease, dt)


@kernel
def pace(robot):
    """Return the unit of low speeds: 1 m/s, or the robot's top speed if it is less."""
    return min(1.0, robot.limit[1])


@kernel
def follow(own, course, i, state, dt):
    """Return (segment, way, way left in this gear, off the path, wanted v and w)."""
    i, s = advance(course, i, state[0], state[1])
    ax, ay = course.node[i].x, course.node[i].y
    bx, by = course.node[i + 1].x - ax, course.node[i + 1].y - ay
    size = max(sqrt(bx * bx + by * by), 1e-9)
    tx, ty = bx / size, by / size
    gear = course.node[i].gear
    off = tx * (state[1] - ay) - ty * (state[0] - ax)
    heading = state[2] if gear > 0 else state[2] + pi
    # The chord's direction, turned to the tangent's at this place.
    t = min(1.0, max(0.0, (s - course.node[i].way) / size))
    first, second = course.node[i].bend, course.node[i + 1].bend
    swing = 0.5 * size * (t * t * second - (1.0 - t) ** 2 * first)
    tangent = atan2(ty, tx) + swing
    askew = wrap(heading - tangent)
    left = course.node[course.node[i].end].way - s
    top = own[0].limit[1] if gear > 0 else -own[0].limit[0]
    speed, slow = abs(state[3]), pace(own[0])
    v = slowing(speed, 0.0, left, course.ease, dt) + CREEPING * slow
    near = max(course.node[i + 1].way - s, 0.0)
    fastest = course.node[i + 1].fastest
    v = min(top, v, slowing(speed, fastest, near, course.ease, dt))
    ahead = s + max(speed, PREVIEWED * slow) * PREVIEW_S
    bend = bend_at(course, i, ahead)
    standing = speed < STANDING * slow
    stiffness = course.stiffness
    bend -= stiffness * stiffness * off + 2.0 * stiffness * sin(askew)
    if own[0].model == UNICYCLE:
        v = min(v, own[0].limit[2] / max(abs(bend), 1e-9))
        # w is the rate of turning, which grows with v and not with the gear.
        w = bend * v
        if abs(askew) > (ASKEW if standing else FAR_ASKEW):
            v = 0.0
            w = turning_rate(own, -askew, state, dt)
    else:
        w = atan(gear * own[0].wheelbase * bend)
    w = max(-own[0].limit[2], min(own[0].limit[2], w))
    # No farther than errors take to decay until the steering, or the turning, is there.
    late_s = abs(w - state[4]) / own[0].limit[4]
    v = min(v, 1.0 / max(stiffness * late_s, 1e-9))
    if standing and own[0].model != UNICYCLE and abs(w - state[4]) > ALIGNED:
        v = 0.0
    return i, s, left, off, gear * v, w


@kernel
def track_control(own, course, segment, stood, state, dt):
    """Return (u1, u2, segment, stood, off the path) of a robot that follows its path.

    Args:
        own: the robot, shape (1,).
        course: its path.
        segment: that it is on; START as long as it stays where it begins, and the
            number of nodes once it stands at the path's end.
        stood: steps for which it has stood at the end of its stretch.
        state: its state.
        dt: step [s].
    """
    size = course.size[0]
    if segment >= size:
        angle = lacking(course, max(size - 1, 0), state)
        if angle == 0.0:
            u1, u2 = braking_control(own, 0, state, dt)
            return u1, u2, segment, stood, 0.0
        w = turning_rate(own, angle, state, dt)
        u1, u2 = control_towards(own, 0, state, 0.0, w, dt)
        return u1, u2, segment, stood, 0.0
    i, last, left, off, v, w = segment, 0, 0.0, 0.0, 0.0, 0.0
    if segment != START:
        i, _, left, off, v, w = follow(own, course, segment, state, dt)
        last = course.node[i].end
    if left < ARRIVED_M:
        angle = lacking(course, last, state)
        v = 0.0
        if own[0].model == UNICYCLE:
            w = turning_rate(own, angle, state, dt) if abs(state[3]) < REST else 0.0
        if angle == 0.0 and stands(own, 0, state):
            stood += 1
            if stood > course.node[last].pause:
                stood = 0
                i = size if last + 1 >= size else last
    u1, u2 = control_towards(own, 0, state, v, w, dt)
    return u1, u2, i, stood, off
