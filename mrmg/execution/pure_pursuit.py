"""Pure pursuit (Coulter 1992): steer along the arc to a point ahead; a plain baseline.

The arc through a point at (a, b) in the robot's frame has the curvature
2 b / (a^2 + b^2), forwards and backwards alike. Speed follows the error along the way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrmg.execution.controller import HORIZON_STEP_S
from mrmg.scene.robot_model import RobotModel


@dataclass(frozen=True, slots=True)
class PurePursuitParams:
    """How far ahead to look and how firmly to act.

    Attributes:
        least_lookahead_m: distance of the point ahead at standstill.
        lookahead_s: further distance per speed.
        steering_s: time in which the wheels shall be turned to the arc's angle.
        along_per_s2: acceleration per error along the way.
        speed_per_s: acceleration per error of the speed.
    """

    least_lookahead_m: float = 0.4
    lookahead_s: float = 0.4
    steering_s: float = 0.15
    along_per_s2: float = 2.0
    speed_per_s: float = 2.5


class PurePursuit:
    """Geometric tracking of one robot."""

    def __init__(
        self, model: RobotModel, params: PurePursuitParams | None = None
    ) -> None:
        """Follow with a robot of `model`."""
        self._wheelbase_m = model.wheelbase_m
        self._psi_limit = model.limits.w_max
        self._params = params or PurePursuitParams()

    def correct(self, state: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Return the controls towards the point ahead, less the reference's."""
        params = self._params
        ahead = _in_frame_of(state, reference)
        planned_u2 = (reference[1, 4] - reference[0, 4]) / HORIZON_STEP_S
        speed_error = reference[0, 3] - state[3]
        u1 = params.along_per_s2 * ahead[0, 0] + params.speed_per_s * speed_error
        u2 = (self._pursued_psi(state, reference, ahead) - state[4]) / params.steering_s
        return np.array([u1, u2 - planned_u2])

    def _pursued_psi(
        self, state: np.ndarray, reference: np.ndarray, ahead: np.ndarray
    ) -> float:
        """Return the steering angle of the arc; without a point, the plan's."""
        params = self._params
        lookahead_m = params.least_lookahead_m + params.lookahead_s * abs(state[3])
        direction = np.sign(reference[:, 3].sum())
        far = (direction * ahead[:, 0] > 0.0) & (np.hypot(*ahead.T) >= lookahead_m)
        turning_back = np.flatnonzero(reference[:, 3] * direction < 0.0)
        if len(turning_back):
            far[turning_back[0] :] = False
        if not far.any():
            return float(reference[0, 4])
        a, b = ahead[np.argmax(far)]
        psi = math.atan(self._wheelbase_m * 2.0 * b / (a * a + b * b))
        return min(max(psi, -self._psi_limit), self._psi_limit)


def _in_frame_of(state: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return the reference's positions in the robot's frame, shape (n, 2)."""
    offset = reference[:, :2] - state[:2]
    cos, sin = math.cos(state[2]), math.sin(state[2])
    return np.asarray(offset @ np.array([[cos, -sin], [sin, cos]]))
