"""From the plan and the controllers' corrections to ramps of speed and steering."""

from __future__ import annotations

import numpy as np

from mrmg.execution.controller import HORIZON, HORIZON_STEP_S, Controller
from mrmg.execution.reference import STANDSTILL_M_S, FleetReference, speed_states
from mrmg.scene.types import Scene

_STALL_M_S = 0.3
_STILL = 1e-6


class SetPoints:
    """Commanded (v [m/s], psi [rad] or omega [rad/s]) of all robots, ramps in time.

    The plan's own controls are fed forward tick by tick, exactly as they switch; the
    controllers, called less often, only add to them.

    Attributes:
        now: set-points at the present tick, shape (R, 2).
        following: set-points at the next tick, shape (R, 2).
    """

    def __init__(
        self, scene: Scene, reference: FleetReference, controllers: list[Controller]
    ) -> None:
        """Start at the plan's first set-points.

        Args:
            scene: whose robots' limits bound the set-points.
            reference: the plan.
            controllers: one a robot, in the scene's order.
        """
        limits = [robot.model.limits for robot in scene.robots]
        self._lower = np.array([[item.v_min_m_s, -item.w_max] for item in limits])
        self._upper = np.array([[item.v_max_m_s, item.w_max] for item in limits])
        self._control_bound = np.array(
            [[item.u1_max_m_s2, item.u2_max] for item in limits]
        )
        self._is_speed = speed_states(scene)[:, 3:]
        self._reference, self._controllers = reference, controllers
        self._correction = np.zeros((len(limits), 2))
        self._planned = reference.at(np.zeros(1))[0, :, 3:]
        self.now = self._planned.copy()
        self.following = self._planned.copy()

    def follow(self, reference: FleetReference) -> None:
        """Go on by another plan, from the present set-points."""
        self._reference = reference

    def correct(self, state: np.ndarray, clock_s: float, rate: float) -> int:
        """Let the controllers look ahead from the true states, shape (R, 5).

        A robot whose plan waits for the whole horizon has nothing to correct.

        Returns:
            Number of controllers called.
        """
        horizon = self._reference.paced(clock_s, rate, HORIZON_STEP_S, HORIZON + 1)
        still = np.ptp(horizon, axis=0).max(axis=1) < _STILL
        slow = (np.abs(horizon[..., 3]) < STANDSTILL_M_S).all(axis=0)
        waits = still & slow & (rate > 0.0)
        self._correction[waits] = 0.0
        for index in np.flatnonzero(~waits):
            start = np.concatenate([state[index, :3], self.following[index]])
            self._correction[index] = self._controllers[index].correct(
                start, horizon[:, index]
            )
        return int((~waits).sum())

    def advance(
        self, axle_speed_m_s: np.ndarray, clock_s: float, rate: float, period_s: float
    ) -> None:
        """Make the ramps of the coming tick.

        Args:
            axle_speed_m_s: speed of each robot now, shape (R,).
            clock_s: plan time now.
            rate: plan seconds per second.
            period_s: length of the tick.
        """
        self.now = self.following.copy()
        # A robot that cannot follow must not pile up speed for later.
        self.now[:, 0] = np.clip(
            self.now[:, 0], axle_speed_m_s - _STALL_M_S, axle_speed_m_s + _STALL_M_S
        )
        coming = self._reference.at(clock_s + rate * period_s * np.arange(2))[..., 3:]
        planned = np.where(self._is_speed, rate * coming[1], coming[1])
        control = (planned - self._planned) / period_s + self._correction
        # Where the plan waits, so does the robot: creeping up would cost energy.
        waits = (np.abs(coming[..., 0]) < STANDSTILL_M_S).all(axis=0)
        rests = waits & (np.abs(coming[..., 1]) < STANDSTILL_M_S).all(axis=0)
        stops = self._is_speed & np.stack([waits, rests], axis=1)
        control = np.where(stops, -self.now / period_s, control)
        control = np.clip(control, -self._control_bound, self._control_bound)
        self.following = np.clip(
            self.now + period_s * control, self._lower, self._upper
        )
        self._planned = planned

    def brake(self, period_s: float) -> None:
        """Make the ramps of the coming tick those of stopping, steering held."""
        self.now = self.following.copy()
        change = self._is_speed * period_s * self._control_bound
        self.following = self.now - np.clip(self.now, -change, change)
