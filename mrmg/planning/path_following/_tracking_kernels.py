"""Driving a fleet along given paths in closed loop, safely."""

from __future__ import annotations

from math import atan, atan2, hypot, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from mrmg.compilation import by_reference, kernel
from mrmg.motion._kernels import UNICYCLE, step
from mrmg.planning.problem._control_kernels import control_towards, wrap
from mrmg.planning.problem._safety_kernels import (
    braking_control,
    follow_braking,
    new_contingency,
    present_state,
    stands,
    try_control,
    write_braking,
)
from mrmg.planning.problem._target_kernels import in_target

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

STRAYED_M = 1.0
"""Distance from the path at which driving is given up."""

STUCK_STEPS = 150
"""Steps without anybody getting on after which driving is given up."""

TURNING_SHARE = 0.5
"""Share of the acceleration of turning with which a turn on the spot is slowed down."""

ATTEMPTS = 3
"""Controls tried before a robot brakes as committed."""


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


@kernel
def track_step(fleet, spaces, contingency, decided, r, v, w, dt):
    """Drive one robot one step as near to (v, w) as is safe; return its control."""
    state = present_state(contingency, r).copy()
    for attempt in range(ATTEMPTS):
        slower = 1.0 - 0.5 * attempt
        u1, u2 = control_towards(fleet, r, state, v * slower, w, dt)
        if try_control(fleet, spaces, contingency, decided, r, u1, u2, dt):
            return u1, u2
    u1, u2 = braking_control(fleet, r, state, dt)
    follow_braking(contingency, r)
    return u1, u2


@kernel
def drive(
    fleet, spaces, zones, courses, given, start, order, dt, control, driven, halt
):
    """Drive the fleet to the ends of its paths.

    Args:
        fleet, spaces: robots and their free spaces.
        zones: where one robot at a time may be.
        courses: their paths.
        given: number of steps for which each robot follows the controls that it finds
            in `control`, before it takes to its path, shape (R,).
        start: state of each robot, shape (R, 5).
        order: robots in order of right of way, shape (R,).
        dt: step [s].
        control: receives the controls, shape (K, R, 2).
        driven: receives the way that each robot has driven along its path [m]: -inf
            before it takes to it, inf behind its end, shape (R,).
        halt: shape (1,); driving ends once it has turned true.

    Returns:
        (steps until all stand at their ends, -1) or, if it fails, (steps, the robot
        that did not get on).
    """
    robots = len(fleet)
    contingency = new_contingency(fleet, zones, dt)
    decided = np.zeros(robots, np.bool_)
    segment = np.zeros(robots, np.int64)
    still = np.zeros(robots, np.int64)
    stood = np.zeros(robots, np.int64)
    done = courses.nodes < 2
    driven[:] = -np.inf
    steps, idle = len(control), 0
    for r in range(robots):
        write_braking(fleet, r, start[r], dt, contingency, 0)
    for n in range(len(control)):
        rest = True
        for r in range(robots):
            state = present_state(contingency, r)
            rest &= done[r] and n >= given[r]
            rest &= stands(fleet, r, state) and turned(courses, r, state)
        if rest:
            return n, -1
        if halt[0] or idle > STUCK_STEPS:
            steps = n
            break
        idle += 1
        decided[:] = False
        for k in range(robots):
            r = order[k]
            state = present_state(contingency, r).copy()
            moves = abs(state[3]) > 1e-3
            if done[r]:
                moves = not stands(fleet, r, state) or turned(courses, r, state)
            still[r] = 0 if moves else still[r] + 1
            if not stands(fleet, r, state):
                idle = 0
            if n < given[r]:
                still[r] = idle = 0
                u1, u2 = control[n, r, 0], control[n, r, 1]
                if not try_control(fleet, spaces, contingency, decided, r, u1, u2, dt):
                    return n, r
            elif done[r] and turned(courses, r, state):
                driven[r] = np.inf
                u1, u2 = braking_control(fleet, r, state, dt)
                follow_braking(contingency, r)
            elif done[r]:
                driven[r] = np.inf
                if still[r] > STUCK_STEPS:
                    return n, r
                w = turning_rate(fleet, r, wrap(courses.heading[r] - state[2]))
                u1, u2 = track_step(fleet, spaces, contingency, decided, r, 0.0, w, dt)
            else:
                i, s, left, off, v, w = follow(fleet, courses, r, segment[r], state)
                segment[r] = i
                driven[r] = s
                if abs(off) > STRAYED_M or still[r] > STUCK_STEPS:
                    return n, r
                if left < ARRIVED_M:
                    v = 0.0
                    if fleet[r].model == UNICYCLE:
                        w = 0.0
                    if stands(fleet, r, state):
                        still[r] = 0
                        last = courses.end[r, i]
                        if stood[r] < courses.pause[r, last]:
                            stood[r] += 1
                            idle = 0
                            still[:] = 0  # others may wait for it to go on
                        else:
                            stood[r] = 0
                            done[r] = last + 1 >= courses.nodes[r]
                            segment[r] = i if done[r] else last
                u1, u2 = track_step(fleet, spaces, contingency, decided, r, v, w, dt)
            control[n, r, 0], control[n, r, 1] = u1, u2
            decided[r] = True
    for k in range(robots - 1):
        if not done[order[k]]:
            return steps, order[k]
    return steps, order[robots - 1]


@kernel
def first_inside(targets, t, state, first):
    """Return the first of the states from `first` on in a target; their number if none.

    Args:
        targets: the targets.
        t: number of the target.
        state: shape (n, 5).
        first: number of a state.
    """
    for k in range(first, len(state)):
        if in_target(targets, t, state[k, 0], state[k, 1]):
            return k
    return len(state)


@kernel
def write_states(fleet, r, dt, control, state):
    """Write the states that controls, shape (n, 2), lead robot r to from state[0]."""
    for k in range(len(control)):
        step(fleet[r], state[k], control[k, 0], control[k, 1], dt, state[k + 1])
