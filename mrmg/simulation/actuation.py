"""Drives and steering that do not follow their commands exactly.

Each answers a command u with the first-order lag tau y' = g u - y, g its gain. Within a
tick the force is held at the lag's mean and the steering ramps between its ends, so
that impulse and angle are exact at every tick.
"""

from __future__ import annotations

import numpy as np

from mrmg.simulation.disturbance import Disturbance

_SHORTEST_S = 1e-9


class Actuation:
    """Turns what is commanded into what the robots' actuators do; by default just that.

    All arrays have shape (R,).
    """

    def force_N(self, commanded_N: np.ndarray, period_s: float) -> np.ndarray:
        """Return the mean force over a tick in which one force is commanded."""
        return commanded_N

    def steer(
        self, start: np.ndarray, end: np.ndarray, period_s: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the steering at both ends of a tick in which a ramp is commanded."""
        return start, end


class LaggingActuation(Actuation):
    """Lag and gain of all robots' actuators."""

    def __init__(self, disturbance: Disturbance, steer: np.ndarray) -> None:
        """Start at rest.

        Args:
            disturbance: gives lags and gains.
            steer: steering at the start, shape (R,).
        """
        robots = disturbance.robots
        self._lag_s = np.array([item.lag_s for item in robots])
        self._drive_gain = 1.0 + np.array([item.drive_gain for item in robots])
        self._steer_gain = 1.0 + np.array([item.steering_gain for item in robots])
        self._force_N = np.zeros(len(robots))
        self._steer = self._steer_gain * steer

    def force_N(self, commanded_N: np.ndarray, period_s: float) -> np.ndarray:
        """Return the mean force over the tick."""
        wanted = self._drive_gain * commanded_N
        gone, mean_gone = self._decay(period_s)
        mean = wanted + (self._force_N - wanted) * mean_gone
        self._force_N = wanted + (self._force_N - wanted) * gone
        return np.asarray(mean)

    def steer(
        self, start: np.ndarray, end: np.ndarray, period_s: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the steering at both ends of the tick."""
        gone, _ = self._decay(period_s)
        before = self._steer
        behind = self._steer_gain * (end - start) / period_s * self._lag_s
        self._steer = (
            self._steer_gain * end
            - behind
            + (before - self._steer_gain * start + behind) * gone
        )
        return before, self._steer

    def _decay(self, period_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Return exp(-T / tau) and its mean over the tick; 0 where there is no lag."""
        gone = np.exp(-period_s / np.maximum(self._lag_s, _SHORTEST_S))
        return gone, (1.0 - gone) * self._lag_s / period_s


def actuation_of(disturbance: Disturbance, steer: np.ndarray) -> Actuation:
    """Return the actuators of a mission, at rest with the wheels at `steer`, (R,)."""
    differs = any(
        item.lag_s or item.drive_gain or item.steering_gain
        for item in disturbance.robots
    )
    return LaggingActuation(disturbance, steer) if differs else Actuation()
