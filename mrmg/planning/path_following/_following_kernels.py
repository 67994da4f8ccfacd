"""What a robot wants that follows its path: its place on it, speed and steering."""

from __future__ import annotations

from math import atan, atan2, hypot, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from mrmg.compilation import by_reference, kernel
from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.problem._control_kernels import wrap

PREVIEW_S = 0.2
"""How far ahead the path's curvature is read."""

ARRIVED_M = 0.03
"""Way left at which a robot stops."""

ALIGNED = 0.15
"""Steering error up to which a standing robot sets out [rad]."""

ASKEW = 0.1
"""Heading error up to which a standing robot that can turn on the spot sets out ..."""

FAR_ASKEW = 1.0
"""... and beyond which it stops to do so [rad]."""

TURNING_SHARE = 0.5
"""Share of the acceleration of turning with which a turn on the spot is slowed down."""


@by_reference
class Courses(NamedTuple):
    """The fleet's paths, padded to one length.

    Attributes:
        node: shape (R, N, 2).
        gear: of each segment, shape (R, N).
        bend: curvature at each node, left positive in the direction of travel (R, N).
        way: way to each node [m], shape (R, N).
        end: number of the node at which the segment's stretch ends, where the gear
            changes or the robot turns on the spot, shape (R, N).
        fastest: speed at which each node is passed at most [m/s], shape (R, N).
        pause: steps that a robot stands at each node where a stretch ends (R, N).
        nodes: number of nodes of each path, shape (R,).
        ease: deceleration that costs nothing [m/s^2], shape (R,).
        stiffness: how fast each robot returns to its path: errors decay over about
            its inverse [1/m], shape (R,).
        heading: in which robots that turn on the spot end [rad], shape (R,).
        tolerance: allowed deviation from that [rad]; inf for any, shape (R,).
    """

    node: np.ndarray
    gear: np.ndarray
    bend: np.ndarray
    way: np.ndarray
    end: np.ndarray
    fastest: np.ndarray
    pause: np.ndarray
    nodes: np.ndarray
    ease: np.ndarray
    stiffness: np.ndarray
    heading: np.ndarray
    tolerance: np.ndarray


@kernel
def advance(courses, r, i, x, y):
    """Return (segment, way along the path) nearest to a point, from segment i on."""
    while True:
        ax, ay = courses.node[r, i, 0], courses.node[r, i, 1]
        bx, by = courses.node[r, i + 1, 0] - ax, courses.node[r, i + 1, 1] - ay
        size = hypot(bx, by)
        along = ((x - ax) * bx + (y - ay) * by) / max(size, 1e-9)
        if along < size or i + 1 >= courses.end[r, i]:
            return i, courses.way[r, i] + along
        i += 1


@kernel
def bend_at(courses, r, i, s):
    """Return the curvature of the path at a way, within the stretch of segment i."""
    last = courses.end[r, i]
    while i + 1 < last and courses.way[r, i + 1] < s:
        i += 1
    size = courses.way[r, i + 1] - courses.way[r, i]
    t = min(1.0, max(0.0, (s - courses.way[r, i]) / max(size, 1e-9)))
    return courses.bend[r, i] + t * (courses.bend[r, i + 1] - courses.bend[r, i])


@kernel
def turned(courses, r, state):
    """Return whether a robot has the heading that it must end with."""
    return abs(wrap(courses.heading[r] - state[2])) < 0.5 * courses.tolerance[r]


@kernel
def turning_rate(fleet, r, lacking):
    """Return the rate at which a robot turns on the spot by an angle [rad/s]."""
    w = sqrt(2.0 * TURNING_SHARE * fleet[r].limit[4] * abs(lacking))
    return w if lacking > 0.0 else -w


@kernel
def follow(fleet, courses, r, i, state):
    """Return (segment, way, way left in this gear, off the path, wanted v and w)."""
    i, s = advance(courses, r, i, state[0], state[1])
    ax, ay = courses.node[r, i, 0], courses.node[r, i, 1]
    bx, by = courses.node[r, i + 1, 0] - ax, courses.node[r, i + 1, 1] - ay
    size = max(hypot(bx, by), 1e-9)
    tx, ty = bx / size, by / size
    gear = courses.gear[r, i]
    off = tx * (state[1] - ay) - ty * (state[0] - ax)
    heading = state[2] if gear > 0 else state[2] + pi
    # The chord's direction, turned to the tangent's at this place.
    t = min(1.0, max(0.0, (s - courses.way[r, i]) / size))
    first, second = courses.bend[r, i], courses.bend[r, i + 1]
    swing = 0.5 * size * (t * t * second - (1.0 - t) ** 2 * first)
    tangent = atan2(ty, tx) + swing
    askew = wrap(heading - tangent)
    left = courses.way[r, courses.end[r, i]] - s
    top = fleet[r].limit[1] if gear > 0 else -fleet[r].limit[0]
    ease = courses.ease[r]
    v = min(top, sqrt(2.0 * ease * max(left - 0.5 * ARRIVED_M, 0.0)) + 0.02)
    near = max(courses.way[r, i + 1] - s, 0.0)
    v = min(v, sqrt(courses.fastest[r, i + 1] ** 2 + 2.0 * ease * near))
    ahead = s + max(abs(state[3]), 0.2) * PREVIEW_S
    bend = bend_at(courses, r, i, ahead)
    standing = abs(state[3]) < 0.05
    stiffness = courses.stiffness[r]
    bend -= stiffness * stiffness * off + 2.0 * stiffness * sin(askew)
    if fleet[r].model == UNICYCLE:
        v = min(v, fleet[r].limit[2] / max(abs(bend), 1e-9))
        # w is the rate of turning, which grows with v and not with the gear.
        w = bend * v
        if abs(askew) > (ASKEW if standing else FAR_ASKEW):
            v = 0.0
            w = turning_rate(fleet, r, -askew)
    else:
        w = atan(gear * fleet[r].wheelbase * bend)
    w = max(-fleet[r].limit[2], min(fleet[r].limit[2], w))
    if standing and fleet[r].model != UNICYCLE and abs(w - state[4]) > ALIGNED:
        v = 0.0
    return i, s, left, off, gear * v, w
