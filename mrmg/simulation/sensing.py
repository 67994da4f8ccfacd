"""What the control sees of the fleet: noisy, late measurements, and a filter over them.

Positions and headings come from a localisation with noise and delay; wheel speed and
steering angle from encoders, the former with noise. Odometry, the motion that the
encoders report, carries the estimate from tick to tick; each measurement corrects it by
a share K of the difference from the estimate *at the time of the measurement*. K is the
gain of the steady Kalman filter of a random walk of variance q a tick seen with
variance r,

    P = (q + sqrt(q^2 + 4 q r)) / 2,    K = P / (P + r).
"""

from __future__ import annotations

from collections import deque

import numpy as np

from mrmg import seeding
from mrmg.motion.user_motion import plain_step
from mrmg.scene.types import Scene
from mrmg.simulation.disturbance import Disturbance

POSITION_DRIFT_M, HEADING_DRIFT_RAD = 0.005, 0.002
"""Standard deviations that odometry gathers in a second."""

SPEED_DRIFT_M_S = 0.1
"""Standard deviation of speed changes within a second that commands do not reveal."""


class Sensing:
    """Turns true states into what the control sees; by default that is the truth.

    Attributes:
        state: seen (x, y, theta, v, w), shape (R, 5).
        axle_speed_m_s: seen speed of the driven axles, shape (R,).
    """

    state: np.ndarray
    axle_speed_m_s: np.ndarray

    def look(
        self, state: np.ndarray, axle_speed_m_s: np.ndarray, commanded_m_s: np.ndarray
    ) -> None:
        """Take a measurement, one a tick.

        Args:
            state: the truth, shape (R, 5).
            axle_speed_m_s: the true speed of the driven axles, shape (R,).
            commanded_m_s: speed commanded for this instant, shape (R,).
        """
        self.state, self.axle_speed_m_s = state, axle_speed_m_s


class FilteredSensing(Sensing):
    """Sees noisy, late measurements through a filter."""

    def __init__(self, scene: Scene, disturbance: Disturbance, period_s: float) -> None:
        """Set up noise, delay and filter of the robots of `scene`, one look a period.

        The filter knows where its robots were meant to start.
        """
        robots = disturbance.robots
        self._period_s = period_s
        self._wheelbase_m = np.array([item.model.wheelbase_m for item in scene.robots])
        self._steps = [plain_step(item.model) for item in scene.robots]
        self._pose = np.array([item.pose for item in scene.robots])
        self._noise = np.array(
            [
                (item.position_noise_m, item.position_noise_m, item.heading_noise_rad)
                for item in robots
            ]
        )
        self._speed_noise = np.array([item.speed_noise_m_s for item in robots])
        drift = np.array([POSITION_DRIFT_M, POSITION_DRIFT_M, HEADING_DRIFT_RAD])
        self._gain = _kalman_gain(drift, self._noise, period_s)
        self._speed_gain = _kalman_gain(SPEED_DRIFT_M_S, self._speed_noise, period_s)
        self._rng = [
            seeding.stream(disturbance.seed, "sensors", item.robot) for item in robots
        ]
        self._delay = np.array([round(item.delay_s / period_s) for item in robots])
        longest = int(self._delay.max()) + 1
        self._true_poses: deque[np.ndarray] = deque(maxlen=longest)
        self._estimates: deque[np.ndarray] = deque(maxlen=longest)
        self._speed = np.zeros(len(robots))
        self._commanded = np.zeros(len(robots))
        self._steer = np.zeros(len(robots))

    def look(
        self, state: np.ndarray, axle_speed_m_s: np.ndarray, commanded_m_s: np.ndarray
    ) -> None:
        """Predict by odometry, then correct by what is measured."""
        noise = np.stack([rng.standard_normal(4) for rng in self._rng])
        speed = self._seen_speed(axle_speed_m_s, commanded_m_s, noise[:, 3])
        if self._estimates:
            self._carry_on(speed, state[:, 4])
        self._true_poses.append(state[:, :3].copy())
        self._estimates.append(self._pose.copy())
        self._correct(noise[:, :3])
        self._speed, self._steer = speed, state[:, 4].copy()
        self.axle_speed_m_s = speed
        self.state = np.column_stack([self._pose, speed, self._steer])

    def _seen_speed(
        self, axle_speed_m_s: np.ndarray, commanded_m_s: np.ndarray, noise: np.ndarray
    ) -> np.ndarray:
        """Return the speed: commanded changes, corrected by the noisy encoder."""
        measured = axle_speed_m_s + self._speed_noise * noise
        expected = self._speed + commanded_m_s - self._commanded
        self._commanded = commanded_m_s.copy()
        exact = self._speed_noise == 0.0
        filtered = expected + self._speed_gain * (measured - expected)
        return np.asarray(np.where(exact, measured, filtered))

    def _carry_on(self, speed: np.ndarray, steer: np.ndarray) -> None:
        """Move the estimates by one tick of odometry."""
        middle = 0.5 * (self._speed + speed), 0.5 * (self._steer + steer)
        for index, step in enumerate(self._steps):
            self._pose[index] = step(
                (*self._pose[index], middle[0][index], middle[1][index]),
                (0.0, 0.0),
                self._wheelbase_m[index],
                self._period_s,
            )[:3]

    def _correct(self, noise: np.ndarray) -> None:
        """Correct present and past estimates by the measurement that arrives now."""
        newest = len(self._estimates) - 1
        at = np.maximum(newest - self._delay, 0)
        robots = np.arange(len(self._delay))
        measured = np.array(self._true_poses)[at, robots] + self._noise * noise
        error = measured - np.array(self._estimates)[at, robots]
        error[:, 2] = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
        change = self._gain * error
        self._pose = self._pose + change
        # What was learnt holds for the past as well, or it would be learnt twice.
        for estimate in self._estimates:
            estimate += change


def sensing_of(scene: Scene, disturbance: Disturbance, period_s: float) -> Sensing:
    """Return the sensing of a disturbed mission, one look a period."""
    blurred = any(
        item.position_noise_m
        or item.heading_noise_rad
        or item.speed_noise_m_s
        or item.delay_s
        for item in disturbance.robots
    )
    if blurred:
        return FilteredSensing(scene, disturbance, period_s)
    return Sensing()


_LEAST_NOISE = 1e-3


def _kalman_gain(
    drift: np.ndarray | float, noise: np.ndarray, period_s: float
) -> np.ndarray:
    """Return K for a drift a second and a noise a measurement."""
    q = drift**2 * period_s
    r = np.maximum(noise, _LEAST_NOISE) ** 2
    p = 0.5 * (q + np.sqrt(q * q + 4.0 * q * r))
    return np.asarray(p / (p + r))
