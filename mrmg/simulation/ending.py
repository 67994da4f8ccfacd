"""When a drive is over: the fleet is at rest after its plan, or is past helping."""

from __future__ import annotations

import math

import numpy as np

from mrmg.mujoco_import import mujoco

_LOST_M = 2.0
_REST_S = 1.0
_LONGEST_REST_S = 5.0
_AT_REST = 0.005
_STALLED_RATE = 0.1
_LONGEST_STALL_S = 5.0
_DIVERGED = [
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
    int(mujoco.mjtWarning.mjWARN_BADCTRL),
]


class Ending:
    """Watches whether a fleet gets on with its plan, and comes to rest after it.

    Attributes:
        finished_s: when the plan was over; infinity until then.
    """

    def __init__(self, data: mujoco.MjData, is_speed: np.ndarray) -> None:
        """Watch a simulation; `is_speed` marks the states that are speeds, (R, 5)."""
        self._data, self._is_speed = data, is_speed
        self.finished_s, self._got_on_s = np.inf, 0.0

    @property
    def stalled_s(self) -> float:
        """How long the fleet has hardly got on with its plan."""
        return float(self._data.time - self._got_on_s)

    def restart(self) -> None:
        """Expect another plan from now on."""
        self.finished_s, self._got_on_s = np.inf, float(self._data.time)

    def look(self, *, plan_is_over: bool, rate: float) -> None:
        """Note whether the plan is over, and how fast the fleet's clock runs."""
        if plan_is_over:
            self.finished_s = min(self.finished_s, self._data.time)
        if plan_is_over or rate > _STALLED_RATE:
            self._got_on_s = self._data.time

    def is_done(self, state: np.ndarray) -> bool:
        """Return whether the fleet rests after its plan; `state` has shape (R, 5)."""
        if self._data.time - self.finished_s < _REST_S:
            return False
        return bool(np.abs(state[self._is_speed]).max() < _AT_REST)

    def trouble(self, state: np.ndarray, planned: np.ndarray, *, sound: bool) -> str:
        """Return why the fleet is past helping, in the log's words; "" if it is not.

        Args:
            state: true states, shape (R, 5).
            planned: where the plan has the robots, shape (R, 5).
            sound: whether both are numbers.
        """
        if not sound or self._data.warning.number[_DIVERGED].any():
            return "diverged"
        pairs = zip(state.tolist(), planned.tolist(), strict=True)
        if any(math.dist(now[:2], meant[:2]) > _LOST_M for now, meant in pairs):
            return "lost"
        if self.stalled_s > _LONGEST_STALL_S:
            return "stalled"
        if self._data.time - self.finished_s > _LONGEST_REST_S:
            return "restless"
        return ""
