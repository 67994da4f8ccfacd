"""One clock for the whole fleet: it slows down while any robot lags behind its plan.

Robots that each kept their own time would lose the separation the planner gave them.
"""

from __future__ import annotations

import math

import numpy as np

from mrmg.simulation.reference import STANDSTILL_M_S

TOLERATED_LAG_S = 0.1
"""Worst lag that leaves the rate at 1."""

GAIN_PER_S = 1.2
"""Loss of rate per second of further lag."""

SLOWING_PER_S = 4.0
"""Fastest fall of the rate."""

RECOVERY_PER_S = 1.5
"""Fastest rise of the rate."""

LEAST_RATE = 0.5
"""Speed [m/s], or yaw rate [rad/s], below which lag is measured as if at this one."""


class FleetClock:
    """Plan time as a function of simulated time.

    Attributes:
        time_s: plan time reached.
        rate: plan seconds per simulated second, in [0, 1].
    """

    def __init__(self, turns: np.ndarray) -> None:
        """Start at plan time 0, at full rate.

        Args:
            turns: which robots have a yaw rate as fifth state, shape (R,).
        """
        self.time_s = 0.0
        self.rate = 1.0
        self._turns = np.flatnonzero(turns).tolist()

    def pace(self, state: np.ndarray, reference: np.ndarray, period_s: float) -> None:
        """Set the rate from where the robots are and should be, both (R, 5)."""
        ahead = (reference - state).tolist()
        planned = reference.tolist()
        lags_s = []
        for (x, y, *_), (_, _, heading, speed, _) in zip(ahead, planned, strict=True):
            ahead_m = x * math.cos(heading) + y * math.sin(heading)
            lags_s.append(lag_s(ahead_m, speed))
        # One that drove on before it has turned would leave its way.
        lags_s += [lag_s(ahead[robot][2], planned[robot][4]) for robot in self._turns]
        target = 1.0 - GAIN_PER_S * max(max(lags_s) - TOLERATED_LAG_S, 0.0)
        lowest = self.rate - SLOWING_PER_S * period_s
        highest = self.rate + RECOVERY_PER_S * period_s
        self.rate = min(max(target, lowest, 0.0), highest, 1.0)

    def advance(self, period_s: float) -> None:
        """Let `period_s` of simulated time pass."""
        self.time_s += self.rate * period_s


def lag_s(ahead: float, rate: float) -> float:
    """Return how late a robot is [s].

    Args:
        ahead: how far it is planned to be ahead along its way [m], or in its turn
            [rad].
        rate: its planned speed [m/s], or yaw rate [rad/s].
    """
    # One that waits is not late; where it stands short of its place, it stays there.
    # The standstill of turning is that of driving, in radians.
    if abs(rate) <= STANDSTILL_M_S:
        return 0.0
    return math.copysign(1.0, rate) * ahead / max(abs(rate), LEAST_RATE)
