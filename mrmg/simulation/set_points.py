"""From the plan and the controllers' corrections to ramps of speed and steering."""

from __future__ import annotations

import numpy as np

from mrmg.scene.types import Scene
from mrmg.simulation.controller import HORIZON, HORIZON_STEP_S, Controller
from mrmg.simulation.controller_calls import ControllerCalls
from mrmg.simulation.reference import STANDSTILL_M_S, FleetReference, speed_states

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
        self._limits = [robot.model.limits for robot in scene.robots]
        self._control_bound = np.array(
            [[item.u1_max_m_s2, item.u2_max] for item in self._limits]
        )
        self._is_speed = speed_states(scene)[:, 3:]
        self._turns = self._is_speed[:, 1].tolist()
        self._reference, self._controllers = reference, controllers
        self._correction = np.zeros((len(self._limits), 2))
        start = reference.at(0.0)[:, 3:]
        self._asked = [(v, w) for v, w in start.tolist()]
        self.now, self.following = start, start.copy()

    def follow(self, reference: FleetReference) -> None:
        """Go on by another plan, from the present set-points."""
        self._reference = reference

    def correct(
        self, state: np.ndarray, clock_s: float, rate: float, calls: ControllerCalls
    ) -> None:
        """Let the controllers look ahead from the states that are seen.

        A robot whose plan waits for the whole horizon has nothing to correct.

        Args:
            state: seen states, shape (R, 5).
            clock_s: time of the fleet's clock.
            rate: plan seconds per second.
            calls: what the calls are noted in.
        """
        horizon = self._reference.paced(clock_s, rate, HORIZON_STEP_S, HORIZON + 1)
        start = np.concatenate([state[:, :3], self.following], axis=1)
        waits = _stand(horizon) if rate > 0.0 else np.zeros(len(start), np.bool_)
        self._correction[waits] = 0.0
        calls.begin()
        for index in np.flatnonzero(~waits).tolist():
            controller = self._controllers[index]
            own = horizon[:, index]
            self._correction[index] = controller.correct(start[index], own)
            calls.note(index, controller)

    def advance(
        self,
        axle_speed_m_s: np.ndarray,
        planned: np.ndarray,
        coming: np.ndarray,
        rate: float,
        period_s: float,
    ) -> None:
        """Make the ramps of the coming tick.

        Args:
            axle_speed_m_s: speed of each robot now, shape (R,).
            planned: states of the plan now, shape (R, 5).
            coming: states of the plan at the end of the tick, shape (R, 5).
            rate: plan seconds per second.
            period_s: length of the tick.
        """
        before, after = planned[:, 3:].tolist(), coming[:, 3:].tolist()
        correction, axle_speed = self._correction.tolist(), axle_speed_m_s.tolist()
        now, following = [], []
        for index, (v, w) in enumerate(self.following.tolist()):
            limits, turns = self._limits[index], self._turns[index]
            (v_before, w_before), (v_coming, w_coming) = before[index], after[index]
            # A robot that cannot follow must not pile up speed for later.
            rolling = axle_speed[index]
            v = _clipped(v, rolling - _STALL_M_S, rolling + _STALL_M_S)
            # Where the plan waits, so does the robot: creeping up would cost energy.
            waits = _is_still(v_before) and _is_still(v_coming)
            rests = waits and turns and _is_still(w_before) and _is_still(w_coming)
            asked = rate * v_coming, rate * w_coming if turns else w_coming
            last, (u1, u2) = self._asked[index], correction[index]
            u1 = -v / period_s if waits else u1 + (asked[0] - last[0]) / period_s
            u2 = -w / period_s if rests else u2 + (asked[1] - last[1]) / period_s
            u1 = _clipped(u1, -limits.u1_max_m_s2, limits.u1_max_m_s2)
            u2 = _clipped(u2, -limits.u2_max, limits.u2_max)
            v_next = _clipped(v + period_s * u1, limits.v_min_m_s, limits.v_max_m_s)
            w_next = _clipped(w + period_s * u2, -limits.w_max, limits.w_max)
            self._asked[index] = asked
            now.append((v, w))
            following.append((v_next, w_next))
        self.now, self.following = np.array(now), np.array(following)

    def brake(self, period_s: float) -> None:
        """Make the ramps of the coming tick those of stopping, steering held."""
        self.now = self.following.copy()
        change = self._is_speed * period_s * self._control_bound
        self.following = self.now - np.clip(self.now, -change, change)


def _stand(horizon: np.ndarray) -> np.ndarray:
    """Return which robots stand all along their horizons, (n, R, 5), shape (R,)."""
    slow = np.abs(horizon[:, :, 3]).max(axis=0) < STANDSTILL_M_S
    return np.asarray(slow & (np.ptp(horizon, axis=0).max(axis=1) < _STILL))


def _is_still(rate: float) -> bool:
    return abs(rate) < STANDSTILL_M_S


def _clipped(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
