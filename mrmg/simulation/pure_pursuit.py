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


TURNING_PARAMS = PurePursuitParams(
    least_lookahead_m=0.15, lookahead_s=0.2, steering_s=0.1
)
"""Of robots that turn by themselves: their curvature changes sooner than a car's."""


class PurePursuit:
    """Geometric tracking of one robot."""

    def __init__(
        self, model: RobotModel, params: PurePursuitParams | None = None
    ) -> None:
        """Follow with a robot of `model`."""
        self._w_limit = model.limits.w_max
        self._steering: _Wheels | _Turning
        if model.motion_model == "car":
            self._params = params or PurePursuitParams()
            self._steering = _Wheels(model.wheelbase_m)
        else:
            self._params = params or TURNING_PARAMS
            self._steering = _Turning(self._params.heading_per_s)

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
        turning_back = np.flatnonzero(
            self._steering.ends_arc(reference, reference[:, 3] * direction)
        )
        if len(turning_back):
            far[turning_back[0] :] = False
        if not far.any():
            w = self._steering.without_arc(state, reference)
        else:
            a, b = ahead[np.argmax(far)]
            w = self._steering.on_arc(2.0 * b / (a * a + b * b), state[3])
        return min(max(w, -self._w_limit), self._w_limit)


@dataclass(frozen=True, slots=True)
class _Wheels:
    """A car's: psi = atan(L kappa)."""

    wheelbase_m: float

    def ends_arc(self, reference: np.ndarray, along_m_s: np.ndarray) -> np.ndarray:
        """Return from where on the reference is on another arc, shape (HORIZON + 1,).

        It ends where the robot turns back.

        Args:
            reference: the states ahead, shape (HORIZON + 1, 5).
            along_m_s: their speeds in the direction of driving.
        """
        return np.asarray(along_m_s < 0.0)

    def on_arc(self, curvature_per_m: float, speed_m_s: float) -> float:
        """Return the steering angle."""
        return math.atan(self.wheelbase_m * curvature_per_m)

    def without_arc(self, state: np.ndarray, reference: np.ndarray) -> float:
        """Return the plan's steering angle."""
        return float(reference[0, 4])


@dataclass(frozen=True, slots=True)
class _Turning:
    """A differential drive's: omega = kappa v; on the spot it follows the heading."""

    heading_per_s: float

    def ends_arc(self, reference: np.ndarray, along_m_s: np.ndarray) -> np.ndarray:
        """It ends where the robot turns back, or turns on the spot."""
        spins = np.abs(reference[:, 4]) * _TIGHT_RADIUS_M > along_m_s
        return np.asarray(spins | (along_m_s < 0.0))

    def on_arc(self, curvature_per_m: float, speed_m_s: float) -> float:
        """Return the yaw rate."""
        return curvature_per_m * speed_m_s

    def without_arc(self, state: np.ndarray, reference: np.ndarray) -> float:
        """Return the plan's yaw rate, corrected by the heading."""
        error = math.remainder(reference[0, 2] - state[2], math.tau)
        return float(reference[0, 4]) + self.heading_per_s * error


def _in_frame_of(state: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return the reference's positions in the robot's frame, shape (n, 2)."""
    offset = reference[:, :2] - state[:2]
    cos, sin = math.cos(state[2]), math.sin(state[2])
    return np.asarray(offset @ np.array([[cos, -sin], [sin, cos]]))
