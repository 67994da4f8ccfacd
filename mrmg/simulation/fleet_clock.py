"""One clock for the whole fleet: it slows down while any robot lags behind its plan.

Robots that each kept their own time would lose the separation the planner gave them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrmg.simulation.reference import STANDSTILL_M_S


@dataclass(frozen=True, slots=True)
class ClockParams:
    """How the clock's rate follows the worst lag.

    Attributes:
        tolerated_lag_s: lag that leaves the rate at 1.
        gain_per_s: loss of rate per second of further lag.
        slowing_per_s: fastest fall of the rate.
        recovery_per_s: fastest rise of the rate.
        least_speed_m_s: speed below which lag is measured as if at this speed.
        least_yaw_rate_rad_s: the same for turning on the spot.
    """

    tolerated_lag_s: float = 0.1
    gain_per_s: float = 1.2
    slowing_per_s: float = 4.0
    recovery_per_s: float = 1.5
    least_speed_m_s: float = 0.5
    least_yaw_rate_rad_s: float = 0.5


class FleetClock:
    """Plan time as a function of simulated time.

    Attributes:
        time_s: plan time reached.
        rate: plan seconds per simulated second, in [0, 1].
    """

    def __init__(
        self, turns: np.ndarray | None = None, params: ClockParams | None = None
    ) -> None:
        """Start at plan time 0, at full rate.

        Args:
            turns: which robots have a yaw rate as fifth state, shape (R,); None for
                none.
            params: how the rate follows the lag.
        """
        self.time_s = 0.0
        self.rate = 1.0
        self._turns = [] if turns is None else np.flatnonzero(turns).tolist()
        self._params = params or ClockParams()

    def pace(self, state: np.ndarray, reference: np.ndarray, period_s: float) -> None:
        """Set the rate from where the robots are and should be, both (R, 5)."""
        params = self._params
        pairs = list(zip(state.tolist(), reference.tolist(), strict=True))
        worst_s = max(lag_s(*pair, params.least_speed_m_s) for pair in pairs)
        for robot in self._turns:
            turning_s = turning_lag_s(*pairs[robot], params.least_yaw_rate_rad_s)
            worst_s = max(worst_s, turning_s)
        target = 1.0 - params.gain_per_s * max(worst_s - params.tolerated_lag_s, 0.0)
        lowest = self.rate - params.slowing_per_s * period_s
        highest = self.rate + params.recovery_per_s * period_s
        self.rate = min(max(target, lowest, 0.0), highest, 1.0)

    def advance(self, period_s: float) -> None:
        """Let `period_s` of simulated time pass."""
        self.time_s += self.rate * period_s


def lag_s(
    state: Sequence[float], reference: Sequence[float], least_speed_m_s: float
) -> float:
    """Return how late a robot is along its planned way [s].

    Args:
        state: true (x, y, theta, v, w).
        reference: planned (x, y, theta, v, w).
        least_speed_m_s: speed below which lag is measured as if at this speed.
    """
    x, y, heading, speed, _ = reference
    # One that waits is not late; where it stands short of its place, it stays there.
    if abs(speed) <= STANDSTILL_M_S:
        return 0.0
    ahead_m = (x - state[0]) * math.cos(heading) + (y - state[1]) * math.sin(heading)
    late_m = math.copysign(1.0, speed) * ahead_m
    return late_m / max(abs(speed), least_speed_m_s)


def turning_lag_s(
    state: Sequence[float], reference: Sequence[float], least_yaw_rate_rad_s: float
) -> float:
    """Return how late a robot is in its planned turn [s].

    One that drove on before it has turned would leave its way.

    Args:
        state: true (x, y, theta, v, omega).
        reference: planned (x, y, theta, v, omega).
        least_yaw_rate_rad_s: as the least speed of `lag_s`.
    """
    yaw_rate = reference[4]
    # The standstill of turning is that of driving, in radians.
    if abs(yaw_rate) <= STANDSTILL_M_S:
        return 0.0
    ahead_rad = reference[2] - state[2]
    late_rad = math.copysign(1.0, yaw_rate) * ahead_rad
    return late_rad / max(abs(yaw_rate), least_yaw_rate_rad_s)
