"""Pure pursuit (Coulter 1992): steer along the arc to a point ahead; a plain baseline.

The arc through a point at (a, b) in the robot's frame has the curvature
2 b / (a^2 + b^2), forwards and backwards alike. Speed follows the error along the way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrmg.scene.robot_model import RobotModel
from mrmg.simulation.controller import HORIZON_STEP_S

_TIGHT_RADIUS_M = 0.3
"""Radius of a turn below which no point is pursued round it."""


@dataclass(frozen=True, slots=True)
class PurePursuitParams:
    """How far ahead to look and how firmly to act.

    Attributes:
        least_lookahead_m: distance of the point ahead at standstill.
        lookahead_s: further distance per speed.
        steering_s: time in which psi, or omega, shall be brought to the arc's.
        along_per_s2: acceleration per error along the way.
        speed_per_s: acceleration per error of the speed.
        heading_per_s: yaw rate per error of the heading where nothing is ahead; of
            robots that turn on the spot.
    """

    least_lookahead_m: float = 0.4
    lookahead_s: float = 0.4
    steering_s: float = 0.15
    along_per_s2: float = 2.0
    speed_per_s: float = 2.5
    heading_per_s: float = 3.0


_PARAMS = {
    "car": PurePursuitParams(),
    "unicycle": PurePursuitParams(
        least_lookahead_m=0.15, lookahead_s=0.2, steering_s=0.1
    ),
}
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
        self._params = _PARAMS[model.motion_model]
        self._turns = model.motion_model == "unicycle"
        self._wheelbase_m, self._w_limit = model.wheelbase_m, model.limits.w_max

    def correct(self, state: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Return the controls towards the point ahead, less the reference's."""
        params = self._params
        ahead = _in_frame_of(state, reference)
        planned_u2 = (reference[1, 4] - reference[0, 4]) / HORIZON_STEP_S
        speed_error = reference[0, 3] - state[3]
        u1 = params.along_per_s2 * ahead[0, 0] + params.speed_per_s * speed_error
        u2 = (self._pursued_w(state, reference, ahead) - state[4]) / params.steering_s
        return np.array([u1, u2 - planned_u2])

    def _pursued_w(
        self, state: np.ndarray, reference: np.ndarray, ahead: np.ndarray
    ) -> float:
        """Return psi or omega of the arc; without a point, what the plan suggests."""
        params = self._params
        lookahead_m = params.least_lookahead_m + params.lookahead_s * abs(state[3])
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
                w += params.heading_per_s * error
        return min(max(w, -self._w_limit), self._w_limit)


def _in_frame_of(state: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return the reference's positions in the robot's frame, shape (n, 2)."""
    offset = reference[:, :2] - state[:2]
    cos, sin = math.cos(state[2]), math.sin(state[2])
    return np.asarray(offset @ np.array([[cos, -sin], [sin, cos]]))
