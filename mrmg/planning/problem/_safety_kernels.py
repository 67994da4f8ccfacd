"""Committed braking: what keeps robots safe while they follow paths.

Each robot carries a contingency trajectory: the states it will go through if it brakes
from now on, steering held, until it stands. All of them keep clear of obstacles and,
step by step, of each other. A robot may replace its own by "one step under a new
control, then brake" only if that keeps clear too; otherwise it follows the one it has.
So braking is always possible, and a mission may end at any time.
"""

from __future__ import annotations

from math import ceil, cos, hypot, sin
from typing import NamedTuple

import numpy as np

from mrmg.compilation import by_reference, kernel
from mrmg.motion._kernels import CAR, USER, copy_numbers, steer_user, step
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS, space_of
from mrmg.world._kernels import (
    clearance_at_least,
    convex_convex_distance,
    footprint_is_clear,
    place_footprint,
    point_in_convex,
)

REST = 1e-9
"""Speed below which a robot counts as standing [m/s]."""


@by_reference
class Zones(NamedTuple):
    """Convex regions that one robot at a time may be in, or committed to enter.

    Attributes:
        center: shape (S, 2).
        reach: radius of the circle about the centre that holds the region, shape (S,).
        corner: padded corners of polygons, shape (S, M, 2).
        corners: number of corners; 0 for a circle, shape (S,).
    """

    center: np.ndarray
    reach: np.ndarray
    corner: np.ndarray
    corners: np.ndarray


class Contingency(NamedTuple):
    """Committed motions; two slots a robot, one active and one for a proposal.

    Attributes:
        state: shape (R, 2, K, 5).
        corner: placed footprints, shape (R, 2, K, M, 2); only where `placed`, as most
            are far from everything.
        placed: shape (R, 2, K).
        middle: middles of the footprints, shape (R, 2, K, 2).
        length: number of states in each slot, shape (R, 2).
        active: slot in force, shape (R,).
        now: index of the present state in the active slot, shape (R,).
        zones: where one robot at a time may be.
    """

    state: np.ndarray
    corner: np.ndarray
    placed: np.ndarray
    middle: np.ndarray
    length: np.ndarray
    active: np.ndarray
    now: np.ndarray
    zones: Zones


@kernel
def new_contingency(fleet, zones, dt):
    """Return an empty contingency that holds the fleet's longest braking."""
    robots = len(fleet)
    longest = 0
    for r in range(robots):
        slowing_s = max(fleet[r].limit[1], -fleet[r].limit[0]) / fleet[r].limit[3]
        if fleet[r].model != CAR:
            slowing_s = max(slowing_s, fleet[r].limit[2] / fleet[r].limit[4])
        longest = max(longest, int(ceil(slowing_s / dt)) + 3)
    return Contingency(
        np.zeros((robots, 2, longest, 5)),
        np.empty((robots, 2, longest, MOST_CORNERS, 2)),
        np.zeros((robots, 2, longest), np.bool_),
        np.zeros((robots, 2, longest, 2)),
        np.zeros((robots, 2), np.int64),
        np.zeros(robots, np.int64),
        np.zeros(robots, np.int64),
        zones,
    )


@kernel
def toward_zero(value, bound, dt):
    """Return the rate that brings `value` to 0 as fast as `bound` allows."""
    if abs(value) < REST:
        return 0.0
    return max(-bound, min(bound, -value / dt))


@kernel
def braking_control(fleet, r, state, dt):
    """Return the control (u1, u2) of full braking; a car holds its steering."""
    if fleet[r].model == USER:
        return steer_user(fleet[r], state, state[0], state[1], 0.0, dt)
    u1 = toward_zero(state[3], fleet[r].limit[3], dt)
    u2 = 0.0
    if fleet[r].model != CAR:
        u2 = toward_zero(state[4], fleet[r].limit[4], dt)
    return u1, u2


@kernel
def stands(fleet, r, state):
    """Return whether a robot is at rest."""
    return abs(state[3]) < REST and (fleet[r].model == CAR or abs(state[4]) < REST)


@kernel
def write_braking(fleet, r, first, dt, contingency, slot):
    """Fill a slot with `first` and the braking that follows it."""
    states = contingency.state[r, slot]
    copy_numbers(first, states[0])
    n = 1
    while n < len(states) and not stands(fleet, r, states[n - 1]):
        u1, u2 = braking_control(fleet, r, states[n - 1], dt)
        step(fleet[r], states[n - 1], u1, u2, dt, states[n])
        n += 1
    mx, my = fleet[r].middle[0], fleet[r].middle[1]
    for k in range(n):
        x, y, theta = states[k, 0], states[k, 1], states[k, 2]
        c, s = cos(theta), sin(theta)
        contingency.middle[r, slot, k, 0] = x + c * mx - s * my
        contingency.middle[r, slot, k, 1] = y + s * mx + c * my
        contingency.placed[r, slot, k] = False
    contingency.length[r, slot] = n


@kernel
def place(fleet, contingency, r, slot, k):
    """Place a committed footprint, if it is not yet."""
    if not contingency.placed[r, slot, k]:
        state = contingency.state[r, slot, k]
        outline = fleet[r].corner[: fleet[r].corners]
        corners = contingency.corner[r, slot, k]
        place_footprint(outline, state[0], state[1], state[2], corners)
        contingency.placed[r, slot, k] = True


@kernel
def clear_of_obstacles(fleet, spaces, contingency, r, slot, first):
    """Return whether a slot's states from `first` on keep the margin from obstacles."""
    space = space_of(spaces, fleet[r].space)
    radius, margin = fleet[r].radius, fleet[r].margin
    for k in range(first, contingency.length[r, slot]):
        cx, cy = contingency.middle[r, slot, k, 0], contingency.middle[r, slot, k, 1]
        if clearance_at_least(space, cx, cy) > radius + margin:
            continue
        place(fleet, contingency, r, slot, k)
        corners = contingency.corner[r, slot, k, : fleet[r].corners]
        if not footprint_is_clear(space, corners, cx, cy, radius, margin):
            return False
    return True


@kernel
def clear_of_robot(fleet, contingency, r, slot, first, other, other_first, margin):
    """Return whether two committed motions keep `margin`, step by step.

    State `first + k` of robot r is compared with state `other_first + k` of the other;
    a robot that stands stays.
    """
    other_slot = contingency.active[other]
    last = contingency.length[r, slot] - 1
    other_last = contingency.length[other, other_slot] - 1
    reach = fleet[r].radius + fleet[other].radius + margin
    span = max(last - first, other_last - other_first)
    for k in range(max(span, 0) + 1):
        i = min(first + k, last)
        j = min(other_first + k, other_last)
        apart = hypot(
            contingency.middle[r, slot, i, 0]
            - contingency.middle[other, other_slot, j, 0],
            contingency.middle[r, slot, i, 1]
            - contingency.middle[other, other_slot, j, 1],
        )
        if apart >= reach:
            continue
        place(fleet, contingency, r, slot, i)
        place(fleet, contingency, other, other_slot, j)
        between = convex_convex_distance(
            contingency.corner[r, slot, i, : fleet[r].corners],
            contingency.corner[other, other_slot, j, : fleet[other].corners],
        )
        if between < margin:
            return False
    return True


@kernel
def passes_gate(contingency, zone, r, slot, first):
    """Return whether a slot's states from `first` on are in a gate at any time."""
    zones = contingency.zones
    n = zones.corners[zone]
    for k in range(first, contingency.length[r, slot]):
        x, y = contingency.state[r, slot, k, 0], contingency.state[r, slot, k, 1]
        far = hypot(x - zones.center[zone, 0], y - zones.center[zone, 1])
        if far > zones.reach[zone]:
            continue
        if n == 0 or point_in_convex(x, y, zones.corner[zone, :n]):
            return True
    return False


@kernel
def gate_is_taken(contingency, zone, r):
    """Return whether a robot other than r is in a gate or committed to enter it."""
    for other in range(len(contingency.now)):
        if other != r and passes_gate(
            contingency, zone, other, contingency.active[other], contingency.now[other]
        ):
            return True
    return False


@kernel
def clear_of_gates(contingency, r, slot):
    """Return whether a slot's states enter no gate that another robot has taken."""
    for zone in range(len(contingency.zones.reach)):
        if passes_gate(contingency, zone, r, slot, 0) and gate_is_taken(
            contingency, zone, r
        ):
            return False
    return True


@kernel
def try_control(fleet, spaces, contingency, decided, r, u1, u2, dt):
    """Replace robot r's contingency by one step of a control and braking, if safe.

    Args:
        fleet, spaces: the fleet and its free spaces.
        contingency: changed in place on success.
        decided: which robots have already made this step, shape (R,).
        r: robot.
        u1, u2: control.
        dt: step [s].

    Returns:
        Whether it was safe.
    """
    active = contingency.active[r]
    slot = 1 - active
    state = contingency.state[r, active, contingency.now[r]]
    after = np.empty(5)
    step(fleet[r], state, u1, u2, dt, after)
    write_braking(fleet, r, after, dt, contingency, slot)
    if not clear_of_obstacles(fleet, spaces, contingency, r, slot, 0):
        return False
    if not clear_of_gates(contingency, r, slot):
        return False
    for other in range(len(fleet)):
        if other == r:
            continue
        # A robot that has not moved yet is met where its braking takes it.
        other_first = contingency.now[other] + (0 if decided[other] else 1)
        spacing = max(fleet[r].spacing, fleet[other].spacing)
        if not clear_of_robot(
            fleet, contingency, r, slot, 0, other, other_first, spacing
        ):
            return False
    contingency.active[r] = slot
    contingency.now[r] = 0
    return True


@kernel
def follow_braking(contingency, r):
    """Advance robot r one step along its contingency trajectory."""
    last = contingency.length[r, contingency.active[r]] - 1
    contingency.now[r] = min(contingency.now[r] + 1, last)


@kernel
def present_state(contingency, r):
    """Return robot r's present state, a view of shape (5,)."""
    return contingency.state[r, contingency.active[r], contingency.now[r]]
