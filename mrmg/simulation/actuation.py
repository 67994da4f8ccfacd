"""Drives and steering that do not follow their commands exactly.

Each answers a command u with the first-order lag tau y' = g u - y, g its gain. Within a
tick the force is held at the lag's mean and the steering ramps between its ends, so
that impulse and angle are exact at every tick. Without lag, and with gains of 1, they
do just what is commanded.
"""

from __future__ import annotations

import numpy as np

from mrmg.simulation.disturbance import Disturbance

_SHORTEST_S = 1e-9


class Actuation:
    """Turns what is commanded into what the robots' actuators do.

    All arrays have shape (R,).
    """

    def __init__(
        self, disturbance: Disturbance, steer: np.ndarray, period_s: float
    ) -> None:
        """Start at rest.

        Args:
            disturbance: gives lags and gains.
            steer: steering at the start, shape (R,).
            period_s: length of a tick.
        """
        robots = disturbance.robots
        self._lag_s = np.array([item.lag_s for item in robots])
        self._drive_gain = 1.0 + np.array([item.drive_gain for item in robots])
        self._steer_gain = 1.0 + np.array([item.steering_gain for item in robots])
        self._force_N = np.zeros(len(robots))
        self._steer = self._steer_gain * steer
        self._period_s = period_s
        # exp(-T / tau) and its mean over the tick; 0 where there is no lag.
        self._gone = np.exp(-period_s / np.maximum(self._lag_s, _SHORTEST_S))
        self._mean_gone = (1.0 - self._gone) * self._lag_s / period_s

    def force_N(self, commanded_N: np.ndarray) -> np.ndarray:
        """Return the mean force over a tick in which one force is commanded."""
        wanted = self._drive_gain * commanded_N
        mean = wanted + (self._force_N - wanted) * self._mean_gone
        self._force_N = wanted + (self._force_N - wanted) * self._gone
        return np.asarray(mean)

    def steer(
        self, start: np.ndarray, end: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the steering at both ends of a tick in which a ramp is commanded."""
        before = self._steer
        behind = self._steer_gain * (end - start) / self._period_s * self._lag_s
        self._steer = (
            self._steer_gain * end
            - behind
            + (before - self._steer_gain * start + behind) * self._gone
        )
        return before, self._steer
