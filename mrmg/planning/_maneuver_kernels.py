"""Turning in tight places: the best of all short sequences of held motions.

Where the way lies abeam or behind, or steering has run against something, a robot looks
two or three motions ahead, each one of a few speeds and steering angles held for a
while. It takes the first motion of the sequence after which it is, all told, nearest to
its target: way driven + way to go + what turning towards that way still takes.
"""

from __future__ import annotations

from math import atan2, cos, pi, sin

import numpy as np

from mrmg.compilation import kernel
from mrmg.motion._kernels import step
from mrmg.planning._fleet_kernels import PLANNING_MARGIN_M, space_of
from mrmg.planning._mission_kernels import look_ahead
from mrmg.planning._random_kernels import random_unit
from mrmg.planning._safety_kernels import toward_zero
from mrmg.planning._steering_kernels import control_towards, wrap
from mrmg.world._kernels import (
    clearance_estimate,
    footprint_is_clear,
    place_footprint,
)

TURN_SHARE = 1.2
"""Way that turning by one radian takes, in turning radii."""

TIGHT_TURN = 2.0
"""How much dearer turning round is where there is no room for it."""

TAIL_FIRST = 0.6
"""Radians of turning that leaving backwards is counted as."""

TAIL_SHARE = 0.4
"""Surcharge of each metre that would have to be driven backwards ..."""

TAIL_REACH_M = 20.0
"""... for at most this long."""

SWITCH_M = 1.0
"""Way that stopping to change the direction is counted as [m]."""


MANEUVER_STEPS = 20
"""Length of each motion, in steps."""

MANEUVER_VIEW_M = 12.0
"""How far along the way a rated state looks [m]."""


@kernel
def hold_motion(mission, r, first, v, w, state):
    """Drive at wanted (v, w) for MANEUVER_STEPS, or up to whatever is in the way.

    Args:
        mission, r: the problem and the robot.
        first: state to begin with.
        v, w: wanted speed and steering.
        state: receives the state at the end.

    Returns:
        Way driven [m].
    """
    fleet = mission.fleet
    dt = mission.params.dt
    space = space_of(mission.spaces, fleet[r].space)
    corners = fleet[r].corners
    placed = np.empty((corners, 2))
    after = np.empty(5)
    state[:] = first
    way = 0.0
    for _ in range(MANEUVER_STEPS):
        u1, u2 = control_towards(fleet, r, state, v, w, dt)
        if state[3] * v < 0.0:
            u1 = toward_zero(state[3], fleet[r].limit[3], dt)
        step(fleet[r].model, state, u1, u2, fleet[r].wheelbase, dt, after)
        place_footprint(fleet[r].corner[:corners], after[0], after[1], after[2], placed)
        c, s = cos(after[2]), sin(after[2])
        mx, my = fleet[r].middle[0], fleet[r].middle[1]
        if not footprint_is_clear(
            space,
            placed,
            after[0] + c * mx - s * my,
            after[1] + s * mx + c * my,
            fleet[r].radius,
            PLANNING_MARGIN_M,
        ):
            state[3] = 0.0
            return way
        way += 0.5 * abs(state[3] + after[3]) * dt
        state[:] = after
    return way


@kernel
def way_left(mission, r, target, state, waypoint):
    """Return (way to a target, way that turning towards it is counted as) [m].

    Leaving backwards is an alternative to turning round, the dearer the longer the way;
    turning round is dearer where there is no room for it.
    """
    fleet = mission.fleet
    to_go = look_ahead(mission, r, target, state, MANEUVER_VIEW_M, waypoint)
    off = abs(wrap(atan2(waypoint[1] - state[1], waypoint[0] - state[0]) - state[2]))
    turn = TURN_SHARE * fleet[r].turning_radius
    tail = turn * (pi - off + TAIL_FIRST) + TAIL_SHARE * min(to_go, TAIL_REACH_M)
    if off > 0.5 * pi:
        space = space_of(mission.spaces, fleet[r].space)
        room = clearance_estimate(space, state[0], state[1])
        tight = 0.5 * (fleet[r].turning_radius + 2.0 - room)
        turn *= 1.0 + TIGHT_TURN * max(0.0, min(1.0, tight))
    return to_go, min(turn * off, tail)


@kernel
def best_maneuver(mission, r, target, start, stuck, random, out):
    """Find the first of the held motions that bring the robot on its way best.

    Depth-first over sequences of two motions, or of three coarser ones for a robot that
    has been stuck; ratings of a stuck robot get a random part, so that it tries others.

    Args:
        mission, r, target: the problem, the robot and where it wants to go.
        start: present state.
        stuck: how often it has tried in vain.
        random: state of the generator.
        out: receives the wanted (v, w).

    Returns:
        Whether the best sequence gets anywhere at all.
    """
    limit = mission.fleet[r].limit
    depth = 3 if stuck > 1 else 2
    steerings = 3 if stuck > 1 else 5
    noise = min(1.0 * stuck, 5.0)
    states = np.empty((depth + 1, 5))
    states[0] = start
    motion = np.zeros(depth, np.int64)
    driven = np.zeros(depth + 1)
    speed = np.zeros(depth + 1)
    speed[0] = start[3]
    first = np.zeros(2)
    waypoint = np.zeros(2)
    best = np.inf
    level = 0
    while level >= 0:
        if motion[level] == 2 * steerings:
            motion[level] = 0
            level -= 1
            continue
        i = motion[level]
        motion[level] += 1
        v = 0.7 * limit[1] if i < steerings else limit[0]
        w = (2.0 * (i % steerings) / (steerings - 1) - 1.0) * limit[2]
        if level == 0:
            first[0], first[1] = v, w
        end = states[level + 1]
        way = hold_motion(mission, r, states[level], v, w, end)
        if way < 0.05:
            continue
        extra = SWITCH_M if speed[level] * v < -1e-6 else 0.0
        if level == 0:
            extra += noise * random_unit(random)
        driven[level + 1] = driven[level] + way + extra
        speed[level + 1] = v
        to_go, turning = way_left(mission, r, target, end, waypoint)
        rating = driven[level + 1] + to_go + turning
        if rating < best:
            best = rating
            out[0], out[1] = first[0], first[1]
        if level + 1 < depth:
            level += 1
    return best < np.inf
