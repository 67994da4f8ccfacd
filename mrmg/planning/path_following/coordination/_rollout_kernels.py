"""Motions from one place and heading, carried to wherever a search needs them.

The shipped motion models drive alike everywhere and in every direction. So what a
motion leads through is worked out once for each speed and steering that it begins
with, which recur: motions hold speeds and steerings.
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np

from mrmg.compilation import inlined, kernel
from mrmg.planning.path_following.coordination._motion_kernels import HOLD, MOVE, move

ROLLED = 509
"""Pairs of speed and steering that are remembered; a prime, so that they spread."""

FINEST = 2.0**54
"""Factor that makes different integers of different speeds from 1/4 m/s up, so that
sums which differ in the last bit alone do not take each other's place."""


class Rollouts(NamedTuple):
    """States of all motions from the origin, by the speed and steering at their begin.

    Attributes:
        begin: speed and steering; NaN where there are none yet, shape (N, 2).
        state: from HOLD on, and of each step from 0 on, shape (N, P + 1, K + 1, 5).
    """

    begin: np.ndarray
    state: np.ndarray


@kernel
def rolled_out(search, rollouts, state, control):
    """Return the row of the rollouts that begin like a state; they are made if need be.

    Args:
        search: gives robot, motions and step.
        rollouts: those known; receive what is missing in place of what was there.
        state: shape (5,).
        control: room for the controls of one, shape (n, 2).
    """
    v, w = state[3], state[4]
    row = (3 * int(FINEST * v) + int(FINEST * w)) % len(rollouts.begin)
    if rollouts.begin[row, 0] != v or rollouts.begin[row, 1] != w:
        for i in range(MOVE - HOLD + len(search.task.motion)):
            motion = rollouts.state[row, i]
            motion[0, 0], motion[0, 1], motion[0, 2] = 0.0, 0.0, 0.0
            motion[0, 3], motion[0, 4] = v, w
            move(search, HOLD + i, 0, search.task.steps, motion, control)
        rollouts.begin[row, 0], rollouts.begin[row, 1] = v, w
    return row


@inlined
def carry(rollout, steps, state):
    """Write the states of a rollout that begins at state[0].

    Args:
        rollout: shape (K + 1, 5).
        steps: number of them.
        state: receives them, shape (n, 5).
    """
    c, s = cos(state[0, 2]), sin(state[0, 2])
    for k in range(1, steps + 1):
        x, y = rollout[k, 0], rollout[k, 1]
        state[k, 0] = state[0, 0] + c * x - s * y
        state[k, 1] = state[0, 1] + s * x + c * y
        state[k, 2] = state[0, 2] + rollout[k, 2]
        state[k, 3], state[k, 4] = rollout[k, 3], rollout[k, 4]
