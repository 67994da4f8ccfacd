"""Driving a fleet along given paths in closed loop, safely."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import by_reference, kernel
from mrmg.motion._kernels import UNICYCLE, step
from mrmg.planning.path_following._following_kernels import (
    ARRIVED_M,
    Courses,
    follow,
    turned,
    turning_rate,
)
from mrmg.planning.problem._control_kernels import control_towards, wrap
from mrmg.planning.problem._safety_kernels import (
    Zones,
    braking_control,
    follow_braking,
    new_contingency,
    present_state,
    stands,
    try_control,
    write_braking,
)
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.roadmap._fleet_kernels import Spaces

STRAYED_M = 1.0
"""Distance from the path at which driving is given up."""

STUCK_STEPS = 150
"""Steps without anybody getting on after which driving is given up."""

ATTEMPTS = 3
"""Controls tried before a robot brakes as committed."""


@by_reference
class Driving(NamedTuple):
    """What a fleet drives, and where.

    Attributes:
        fleet, spaces, zones: robots, their free spaces, mutual-exclusion zones.
        courses: their paths.
        given: number of steps for which each robot follows the controls that are there
            already, before it takes to its path, shape (R,).
        start: state of each robot, shape (R, 5).
        dt: step [s].
        halt: shape (1,); driving ends once it has turned true.
    """

    fleet: np.ndarray
    spaces: Spaces
    zones: Zones
    courses: Courses
    given: np.ndarray
    start: np.ndarray
    dt: float
    halt: np.ndarray


@by_reference
class Progress(NamedTuple):
    """How far robots have got.

    Attributes:
        segment: of its path that each robot is on, shape (R,).
        still: steps since it last moved, shape (R,).
        stood: steps for which it has stood at its present stop, shape (R,).
        done: whether it is at its path's end, shape (R,).
        driven: way that it has driven along its path [m]: -inf before it takes to it,
            inf behind its end, shape (R,).
        idle: steps since any robot last moved, shape (1,).
    """

    segment: np.ndarray
    still: np.ndarray
    stood: np.ndarray
    done: np.ndarray
    driven: np.ndarray
    idle: np.ndarray


@kernel
def track_step(driving, contingency, decided, r, v, w):
    """Drive one robot one step as near to (v, w) as is safe; return its control."""
    fleet, dt = driving.fleet, driving.dt
    state = present_state(contingency, r).copy()
    for attempt in range(ATTEMPTS):
        slower = 1.0 - 0.5 * attempt
        u1, u2 = control_towards(fleet, r, state, v * slower, w, dt)
        if try_control(fleet, driving.spaces, contingency, decided, r, u1, u2, dt):
            return u1, u2
    u1, u2 = braking_control(fleet, r, state, dt)
    follow_braking(contingency, r)
    return u1, u2


@kernel
def all_rest(driving, progress, contingency, n):
    """Return whether all robots stand at their ends, as they must, in step n."""
    for r in range(len(driving.fleet)):
        state = present_state(contingency, r)
        if not progress.done[r] or n < driving.given[r]:
            return False
        if not (stands(driving.fleet, r, state) and turned(driving.courses, r, state)):
            return False
    return True


@kernel
def note_standing(driving, progress, n, r, state):
    """Count for how many steps a robot, and all of them, have stood."""
    standing = stands(driving.fleet, r, state)
    moves = abs(state[3]) > 1e-3
    if progress.done[r]:
        moves = not standing or turned(driving.courses, r, state)
    progress.still[r] = 0 if moves else progress.still[r] + 1
    if not standing:
        progress.idle[0] = 0
    if n < driving.given[r]:
        progress.still[r] = progress.idle[0] = 0


@kernel
def stand_at_stop(courses, progress, r):
    """Count a step at a stop of robot r's path; go on when it has stood long enough."""
    progress.still[r] = 0
    last = courses.end[r, progress.segment[r]]
    if progress.stood[r] < courses.pause[r, last]:
        progress.stood[r] += 1
        progress.idle[0] = 0
        progress.still[:] = 0  # others may wait for it to go on
        return
    progress.stood[r] = 0
    progress.done[r] = last + 1 >= courses.nodes[r]
    if not progress.done[r]:
        progress.segment[r] = last


@kernel
def track_path(driving, progress, contingency, decided, r):
    """Drive robot r a step along its path; return (its control, whether it strays)."""
    fleet, courses = driving.fleet, driving.courses
    state = present_state(contingency, r).copy()
    i, s, left, off, v, w = follow(fleet, courses, r, progress.segment[r], state)
    progress.segment[r], progress.driven[r] = i, s
    if left < ARRIVED_M:
        v = 0.0
        if fleet[r].model == UNICYCLE:
            w = 0.0
        if stands(fleet, r, state):
            stand_at_stop(courses, progress, r)
    u1, u2 = track_step(driving, contingency, decided, r, v, w)
    return u1, u2, abs(off) > STRAYED_M


@kernel
def end_path(driving, progress, contingency, decided, r):
    """Have robot r, at its path's end, turn and stand; return its control."""
    progress.driven[r] = np.inf
    state = present_state(contingency, r).copy()
    if turned(driving.courses, r, state):
        u1, u2 = braking_control(driving.fleet, r, state, driving.dt)
        follow_braking(contingency, r)
        return u1, u2
    missing = wrap(driving.courses.heading[r] - state[2])
    w = turning_rate(driving.fleet, r, missing)
    return track_step(driving, contingency, decided, r, 0.0, w)


@kernel
def drive_robot(driving, progress, contingency, decided, n, r, control):
    """Drive robot r in step n; return whether it makes progress."""
    state = present_state(contingency, r).copy()
    note_standing(driving, progress, n, r, state)
    if n < driving.given[r]:
        u1, u2 = control[n, r, 0], control[n, r, 1]
        return try_control(
            driving.fleet, driving.spaces, contingency, decided, r, u1, u2, driving.dt
        )
    strays = False
    if progress.done[r]:
        u1, u2 = end_path(driving, progress, contingency, decided, r)
    else:
        u1, u2, strays = track_path(driving, progress, contingency, decided, r)
    control[n, r, 0], control[n, r, 1] = u1, u2
    return not strays and progress.still[r] <= STUCK_STEPS


@kernel
def drive(driving, progress, control):
    """Drive the fleet to the ends of its paths; robots of lower number have priority.

    Args:
        driving: the fleet, its paths and its surroundings.
        progress: of robots that stand where their paths begin; receives how far they
            get.
        control: receives the controls, shape (K, R, 2).

    Returns:
        (steps until all stand at their ends, -1) or, if it fails, (steps, the robot
        that made no progress).
    """
    fleet, robots = driving.fleet, len(driving.fleet)
    contingency = new_contingency(fleet, driving.zones, driving.dt)
    decided = np.zeros(robots, np.bool_)
    steps = len(control)
    for r in range(robots):
        write_braking(fleet, r, driving.start[r], driving.dt, contingency, 0)
    for n in range(len(control)):
        if all_rest(driving, progress, contingency, n):
            return n, -1
        if driving.halt[0] or progress.idle[0] > STUCK_STEPS:
            steps = n
            break
        progress.idle[0] += 1
        decided[:] = False
        for r in range(robots):
            if not drive_robot(driving, progress, contingency, decided, n, r, control):
                return n, r
            decided[r] = True
    for r in range(robots - 1):
        if not progress.done[r]:
            return steps, r
    return steps, robots - 1


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
