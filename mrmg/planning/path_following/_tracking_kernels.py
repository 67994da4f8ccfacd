"""Driving one robot along its path in closed loop, as if it were alone."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import borrowed, kernel
from mrmg.motion._kernels import step
from mrmg.planning.path_following._following_kernels import (
    at_rest,
    first_segment,
    track_control,
)
from mrmg.planning.problem._clearance_kernels import moves_clear
from mrmg.planning.problem._target_kernels import askew, in_target
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS
from mrmg.world._kernels import multiplier_in

STRAYED_M = 1.0
"""Distance from the path at which driving is given up."""


@kernel
def drive(own, spaces, terrain, course, dt, spent_s, state, control):
    """Drive a robot along its path until it rests at the end.

    Args:
        own: the robot, shape (1,).
        spaces, terrain: its surroundings.
        course: its path.
        dt: step [s].
        spent_s: receives what it took to each node without stays, as time on plain
            ground [s], shape (N,); what it does not get to keeps what is there.
        state: its state, and room for those after it, shape (n + 1, 5).
        control: receives the controls, shape (n, 2).

    Returns:
        (steps, whether it got there); if it did not, it would run into an obstacle or
        stray from its path after the last of them, or there was no more room.
    """
    own, spaces, terrain, course = borrowed((own, spaces, terrain, course))
    corner = np.empty((MOST_CORNERS, 2))
    segment, stood, spent = first_segment(course, state[0]), 0, 0.0
    for k in range(len(control)):
        if at_rest(course, segment, state[k]):
            return k, True
        before = segment
        u1, u2, segment, stood, off = track_control(
            own, course, segment, stood, state[k], dt
        )
        spent_s[before + 1 : segment + 1] = spent
        control[k, 0], control[k, 1] = u1, u2
        step(own[0], state[k], u1, u2, dt, state[k + 1])
        if stood == 0:
            spent += dt * multiplier_in(terrain, state[k, 0], state[k, 1])
        strays = abs(off) > STRAYED_M
        if strays or not moves_clear(own, spaces, state[k], state[k + 1], corner):
            return k + 1, False
    return len(control), False


@kernel
def first_inside(targets, t, state, first):
    """Return the first of the states from `first` on at a target; their number if none.

    Args:
        targets: the targets.
        t: number of the target.
        state: shape (n, 5).
        first: number of a state.
    """
    for k in range(first, len(state)):
        # A robot ends with its finish's heading; it may enter it with any.
        if in_target(targets, t, state[k, 0], state[k, 1]) and (
            t >= targets.places or askew(targets, t, state[k]) == 0.0
        ):
            return k
    return len(state)
