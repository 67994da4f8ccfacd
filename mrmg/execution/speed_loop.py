"""A speed loop: from a ramp of speeds to the force, or moment, to hold.

F = R sign(v) + m (a + k_p e + I), with R the resistance of the ground, m the inertia, a
the acceleration that was asked for, e the error of the speed and I' = k_i e. What is
left for acceleration is limited to what the tyres can transmit. The same law holds for
turning, with moments, yaw inertias and yaw rates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class SpeedLoopParams:
    """Gains of a speed loop; m stands for rad where it turns.

    Attributes:
        proportional_per_s: k_p.
        integral_per_s2: k_i.
        integral_limit_m_s2: bound of |I|.
        standstill_m_s: mean speed of a ramp below which no direction is assumed.
    """

    proportional_per_s: float = 4.0
    integral_per_s2: float = 6.0
    integral_limit_m_s2: float = 3.0
    standstill_m_s: float = 1e-4


class SpeedLoop:
    """Control of several speeds at once."""

    def __init__(
        self, inertia: np.ndarray, limit: np.ndarray, params: SpeedLoopParams
    ) -> None:
        """Control speeds that are all zero at first.

        Args:
            inertia: mass [kg] or moment of inertia [kg m^2], shape (n,).
            limit: bound of the part that accelerates [N or N m], shape (n,).
            params: the gains.
        """
        self._inertia, self._limit, self._params = inertia, limit, params
        self._integral_m_s2 = np.zeros(len(inertia))

    def force(
        self,
        speed: np.ndarray,
        wanted: np.ndarray,
        following: np.ndarray,
        resistance: np.ndarray,
        period_s: float,
        *,
        brakes: np.ndarray | bool = False,
    ) -> np.ndarray:
        """Return the force [N] or moment [N m] to hold for `period_s`, shape (n,).

        Args:
            speed: speed now [m/s or rad/s].
            wanted: speed asked for now.
            following: speed asked for at the end of the period.
            resistance: what the ground takes [N or N m].
            period_s: how long the force will be held.
            brakes: where standing takes more than friction, as on a slope.
        """
        params = self._params
        error = wanted - speed
        middle = 0.5 * (wanted + following)
        direction = np.sign(middle) * (np.abs(middle) > params.standstill_m_s)
        # A robot that shall stand is held by friction; what was learnt is forgotten.
        keeps = np.maximum(np.abs(direction), brakes)
        self._integral_m_s2 = keeps * np.clip(
            self._integral_m_s2 + period_s * params.integral_per_s2 * error,
            -params.integral_limit_m_s2,
            params.integral_limit_m_s2,
        )
        acceleration = (following - wanted) / period_s
        feedback = params.proportional_per_s * error + self._integral_m_s2
        inertial = self._inertia * (acceleration + feedback)
        return np.asarray(
            direction * resistance + np.clip(inertial, -self._limit, self._limit)
        )
