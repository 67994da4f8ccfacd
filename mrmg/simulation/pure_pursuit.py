"""Pure pursuit (Coulter 1992): steer along the arc to a point ahead; a plain baseline.

The arc through a point at (a, b) in the robot's frame has the curvature
2 b / (a^2 + b^2), forwards and backwards alike. Speed follows the error along the way.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from mrmg.scene.robot_model import RobotModel
from mrmg.simulation.controller import HORIZON_STEP_S

_TIGHT_RADIUS_M = 0.3
"""Radius of a turn below which no point is pursued round it."""


ALONG_PER_S2 = 2.0
"""Acceleration per error along the way."""

SPEED_PER_S = 2.5
"""Acceleration per error of the speed."""

HEADING_PER_S = 3.0
"""Yaw rate per error of the heading where nothing is ahead; of robots that turn on the
spot."""


class _Reach(NamedTuple):
    """How far ahead to look, and how firmly to turn there.

    Attributes:
        least_lookahead_m: distance of the point ahead at standstill.
        lookahead_s: further distance per speed.
        steering_s: time in which psi, or omega, shall be brought to the arc's.
    """

    least_lookahead_m: float
    lookahead_s: float
    steering_s: float


_REACH = {"car": _Reach(0.4, 0.4, 0.15), "unicycle": _Reach(0.15, 0.2, 0.1)}
"""By motion model: the curvature of robots that turn by themselves changes sooner than
a car's."""


class PurePursuit:
    """Geometric tracking of one robot.

    A car's steering angle follows an arc of curvature kappa by psi = atan(L kappa), a
    differential drive's yaw rate by omega = kappa v; on the spot that follows the
    heading.
    """

    def __init__(self, model: RobotModel) -> None:
        """Follow with a robot of `model`."""
        self._reach = _REACH[model.motion_model]
        self._turns = model.motion_model == "unicycle"
        self._wheelbase_m, self._w_limit = model.wheelbase_m, model.limits.w_max

    def correct(self, state: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Return the controls towards the point ahead, less the reference's."""
        ahead = _in_frame_of(state, reference)
        planned_u2 = (reference[1, 4] - reference[0, 4]) / HORIZON_STEP_S
        speed_error = reference[0, 3] - state[3]
        u1 = ALONG_PER_S2 * ahead[0, 0] + SPEED_PER_S * speed_error
        turn = self._pursued_w(state, reference, ahead) - state[4]
        u2 = turn / self._reach.steering_s
        return np.array([u1, u2 - planned_u2])

    def _pursued_w(
        self, state: np.ndarray, reference: np.ndarray, ahead: np.ndarray
    ) -> float:
        """Return psi or omega of the arc; without a point, what the plan suggests."""
        reach = self._reach
        lookahead_m = reach.least_lookahead_m + reach.lookahead_s * abs(state[3])
        direction = np.sign(reference[:, 3].sum())
        far = (direction * ahead[:, 0] > 0.0) & (np.hypot(*ahead.T) >= lookahead_m)
        # The arc ends where the robot turns back, or turns on the spot.
        along_m_s = reference[:, 3] * direction
        ends = along_m_s < 0.0
        if self._turns:
            ends |= np.abs(reference[:, 4]) * _TIGHT_RADIUS_M > along_m_s
        if ends.any():
            far[np.argmax(ends) :] = False
        if far.any():
            a, b = ahead[np.argmax(far)]
            curvature_per_m = 2.0 * b / (a * a + b * b)
            if self._turns:
                w = float(curvature_per_m * state[3])
            else:
                w = math.atan(self._wheelbase_m * curvature_per_m)
        else:
            w = float(reference[0, 4])
            if self._turns:
                error = math.remainder(reference[0, 2] - state[2], math.tau)
                w += HEADING_PER_S * error
        return min(max(w, -self._w_limit), self._w_limit)


def _in_frame_of(state: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return the reference's positions in the robot's frame, shape (n, 2)."""
    offset = reference[:, :2] - state[:2]
    cos, sin = math.cos(state[2]), math.sin(state[2])
    return np.asarray(offset @ np.array([[cos, -sin], [sin, cos]]))
