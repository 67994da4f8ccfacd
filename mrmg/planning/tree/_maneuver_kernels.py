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
from mrmg.motion._kernels import copy_numbers, step
from mrmg.planning.problem._control_kernels import control_towards, wrap
from mrmg.planning.problem._safety_kernels import toward_zero
from mrmg.planning.roadmap._fleet_kernels import space_of
from mrmg.planning.routing._random_kernels import random_unit
from mrmg.planning.tree._mission_kernels import look_ahead
from mrmg.world._kernels import (
    clearance_at_least,
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


LEAST_WAY_M = 0.05
"""A motion that gets no farther than this leads nowhere [m]."""

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
    copy_numbers(first, state)
    way = 0.0
    for _ in range(MANEUVER_STEPS):
        u1, u2 = control_towards(fleet, r, state, v, w, dt)
        if state[3] * v < 0.0:
            u1 = toward_zero(state[3], fleet[r].limit[3], dt)
        step(fleet[r], state, u1, u2, dt, after)
        c, s = cos(after[2]), sin(after[2])
        mx, my = fleet[r].middle[0], fleet[r].middle[1]
        cx, cy = after[0] + c * mx - s * my, after[1] + s * mx + c * my
        if clearance_at_least(space, cx, cy) <= fleet[r].radius + fleet[r].margin:
            place_footprint(
                fleet[r].corner[:corners], after[0], after[1], after[2], placed
            )
            if not footprint_is_clear(
                space, placed, cx, cy, fleet[r].radius, fleet[r].margin
            ):
                state[3] = 0.0
                return way
        way += 0.5 * abs(state[3] + after[3]) * dt
        copy_numbers(after, state)
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
def _motion(limit, i, steerings):
    """Return the (v, w) of the i-th of 2 x `steerings` motions, forward ones first."""
    v = 0.7 * limit[1] if i < steerings else limit[0]
    return v, (2.0 * (i % steerings) / (steerings - 1) - 1.0) * limit[2]


@kernel
def best_maneuver(mission, r, target, start, stuck, random, out):
    """Find the first of the held motions that bring the robot on its way best.

    Looks at all first motions, then at what may follow them, the promising ones first.
    For a robot that has been stuck there are three motions, coarser ones, and ratings
    get a random part, so that it tries others.

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
    ends = np.empty((2 * steerings, 5))
    driven = np.empty(2 * steerings)
    least = np.full(2 * steerings, np.inf)
    waypoint = np.zeros(2)
    best = np.inf
    for i in range(2 * steerings):
        v, w = _motion(limit, i, steerings)
        way = hold_motion(mission, r, start, v, w, ends[i])
        if way < LEAST_WAY_M:
            continue
        driven[i] = way + noise * random_unit(random)
        if start[3] * v < -1e-6:
            driven[i] += SWITCH_M
        to_go, turning = way_left(mission, r, target, ends[i], waypoint)
        least[i] = driven[i] + (to_go if to_go < np.inf else 0.0)
        if driven[i] + to_go + turning < best:
            best = driven[i] + to_go + turning
            out[0], out[1] = v, w
    while True:
        likeliest = np.argmin(least)
        if least[likeliest] >= best:
            return best < np.inf
        least[likeliest] = np.inf
        v, w = _motion(limit, likeliest, steerings)
        rating = best_sequel(
            mission,
            r,
            target,
            ends[likeliest],
            v,
            driven[likeliest],
            depth - 1,
            steerings,
            best,
        )
        if rating < best:
            best = rating
            out[0], out[1] = v, w


@kernel
def best_sequel(mission, r, target, start, gear, before, depth, steerings, best):
    """Return the best rating of up to `depth` motions after `start`, if below `best`.

    Depth-first; what cannot beat the best by driving on is not looked into.

    Args:
        mission, r, target: the problem, the robot and where it wants to go.
        start: state to begin with.
        gear: sign of the speed it came with.
        before: way driven up to there [m].
        depth: number of motions.
        steerings: steering angles of a motion.
        best: best rating so far.
    """
    limit = mission.fleet[r].limit
    states = np.empty((depth + 1, 5))
    copy_numbers(start, states[0])
    motion = np.zeros(depth, np.int64)
    driven = np.zeros(depth + 1)
    driven[0] = before
    speed = np.zeros(depth + 1)
    speed[0] = gear
    waypoint = np.zeros(2)
    level = 0
    while level >= 0:
        if motion[level] == 2 * steerings:
            motion[level] = 0
            level -= 1
            continue
        v, w = _motion(limit, motion[level], steerings)
        motion[level] += 1
        end = states[level + 1]
        way = hold_motion(mission, r, states[level], v, w, end)
        if way < LEAST_WAY_M:
            continue
        driven[level + 1] = driven[level] + way
        if speed[level] * v < 0.0:
            driven[level + 1] += SWITCH_M
        speed[level + 1] = v
        if driven[level + 1] >= best:
            continue
        to_go, turning = way_left(mission, r, target, end, waypoint)
        best = min(best, driven[level + 1] + to_go + turning)
        if level + 1 < depth and driven[level + 1] + to_go < best:
            level += 1
    return best
