"""A speed loop: from a ramp of speeds to the force, or moment, to hold.

F = R sign(v) + m (a + k_p e + I), with R the resistance of the ground, m the inertia, a
the acceleration that was asked for, e the error of the speed and I' = k_i e. What is
left for acceleration is limited to what the tyres can transmit. The same law holds for
turning, with moments, yaw inertias and yaw rates.
"""

from __future__ import annotations

import math
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
    integral_limit_m_s2: float = 8.0
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
        self._params = params
        self._inertia, self._limit = inertia.tolist(), limit.tolist()
        self._integral_m_s2 = [0.0] * len(inertia)

    def force(
        self,
        speed: np.ndarray,
        wanted: np.ndarray,
        following: np.ndarray,
        resistance: np.ndarray,
        period_s: float,
        *,
        brakes: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the force [N] or moment [N m] to hold for `period_s`, shape (n,).

        Args:
            speed: speed now [m/s or rad/s].
            wanted: speed asked for now.
            following: speed asked for at the end of the period.
            resistance: what the ground takes [N or N m].
            period_s: how long the force will be held.
            brakes: where standing takes more than friction, as on a slope; None for
                nowhere.
        """
        params, forces = self._params, []
        bound = params.integral_limit_m_s2
        held = [False] * len(speed) if brakes is None else brakes.tolist()
        values = (speed, wanted, following, resistance)
        each = zip(*(value.tolist() for value in values), held, strict=True)
        for index, (now, asked, coming, ground, brake) in enumerate(each):
            error, middle = asked - now, 0.5 * (asked + coming)
            moves = abs(middle) > params.standstill_m_s
            # One that shall stand is held by friction; what was learnt is forgotten.
            learnt = 0.0
            if moves or brake:
                learnt = period_s * params.integral_per_s2 * error
                learnt = min(max(self._integral_m_s2[index] + learnt, -bound), bound)
            self._integral_m_s2[index] = learnt
            acceleration = (coming - asked) / period_s
            feedback = params.proportional_per_s * error + learnt
            inertial = self._inertia[index] * (acceleration + feedback)
            limit = self._limit[index]
            direction = math.copysign(1.0, middle) if moves else 0.0
            forces.append(direction * ground + min(max(inertial, -limit), limit))
        return np.array(forces)
