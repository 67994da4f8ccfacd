"""The drive control below the tracking controller: from a speed ramp to a force.

F = R sign(v) + m_eff (a + k_p e + I), with R the resistance of the ground, a the
acceleration that was asked for, e the error of the speed and I' = k_i e. What is left
for acceleration is limited to what the tyres of the driven axle can transmit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.energy import GRAVITY_M_S2
from mrmg.scene.types import Scene


@dataclass(frozen=True, slots=True)
class DriveParams:
    """Gains of the speed loop.

    Attributes:
        proportional_per_s: k_p.
        integral_per_s2: k_i.
        integral_limit_m_s2: bound of |I|.
        grip_share: share of the driven axle's static grip that is used.
        standstill_m_s: mean speed of a ramp below which no direction is assumed.
    """

    proportional_per_s: float = 4.0
    integral_per_s2: float = 6.0
    integral_limit_m_s2: float = 3.0
    grip_share: float = 0.8
    standstill_m_s: float = 1e-4


class DriveControl:
    """Speed control of all robots."""

    def __init__(self, scene: Scene, params: DriveParams | None = None) -> None:
        """Control the robots of `scene`, all at rest."""
        self._params = params or DriveParams()
        models = [robot.model for robot in scene.robots]
        self._mass_kg = np.array([model.effective_mass_kg for model in models])
        self._grip_N = np.array(
            [
                # Half the weight: the driven axle carries at least that.
                0.5 * model.friction_coefficient * model.mass_kg * GRAVITY_M_S2
                for model in models
            ]
        )
        self._integral_m_s2 = np.zeros(len(models))

    def force_N(
        self,
        speed_m_s: np.ndarray,
        wanted_m_s: np.ndarray,
        next_m_s: np.ndarray,
        resistance_N: np.ndarray,
        period_s: float,
    ) -> np.ndarray:
        """Return the force to hold for `period_s`, shape (R,).

        Args:
            speed_m_s: speed of the axle now.
            wanted_m_s: speed asked for now.
            next_m_s: speed asked for at the end of the period.
            resistance_N: force the ground is believed to take.
            period_s: how long the force will be held.
        """
        params = self._params
        error = wanted_m_s - speed_m_s
        middle = 0.5 * (wanted_m_s + next_m_s)
        direction = np.sign(middle) * (np.abs(middle) > params.standstill_m_s)
        # A robot that shall stand is held by friction; what was learnt is forgotten.
        self._integral_m_s2 = np.abs(direction) * np.clip(
            self._integral_m_s2 + period_s * params.integral_per_s2 * error,
            -params.integral_limit_m_s2,
            params.integral_limit_m_s2,
        )
        acceleration = (next_m_s - wanted_m_s) / period_s
        feedback = params.proportional_per_s * error + self._integral_m_s2
        inertial_N = self._mass_kg * (acceleration + feedback)
        limit_N = params.grip_share * self._grip_N
        return np.asarray(
            direction * resistance_N + np.clip(inertial_N, -limit_N, limit_N)
        )
