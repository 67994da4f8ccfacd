"""The drive control below the tracking controller: from ramps of speeds to forces.

F = R sign(v) + m (a + k_p e + I), with R the resistance of the ground as the energy
model has it, m the inertia, a the acceleration that was asked for, e the error of the
speed and I' = k_i e. What is left for acceleration is limited to what the tyres of the
driven axle can transmit. The same law holds for turning, with moments, yaw inertias and
yaw rates; m in the units of the gains stands for rad there.
"""

from __future__ import annotations

import math

import numpy as np

from mrmg.energy.model import GRAVITY_M_S2
from mrmg.scene.types import Scene

PROPORTIONAL_PER_S = 4.0
"""k_p."""

INTEGRAL_PER_S2 = 6.0
"""k_i."""

INTEGRAL_LIMIT_M_S2 = 8.0
"""Bound of |I|."""

_STANDSTILL_M_S = 1e-4
"""Mean speed of a ramp below which no direction is assumed."""


class SpeedLoop:
    """Control of several speeds at once."""

    def __init__(
        self,
        inertia: np.ndarray,
        limit: np.ndarray,
        weight: np.ndarray,
        level: float = 0.0,
    ) -> None:
        """Control speeds that are all zero at first.

        Args:
            inertia: mass [kg] or moment of inertia [kg m^2], shape (n,).
            limit: bound of the part that accelerates [N or N m], shape (n,).
            weight: what a slope takes, by its sine [N or N m], shape (n,).
            level: sine of the slope that friction holds.
        """
        self._inertia, self._limit = inertia.tolist(), limit.tolist()
        self._weight, self._level = weight, level
        self._integral_m_s2 = [0.0] * len(inertia)

    def force(
        self,
        speed: np.ndarray,
        wanted: np.ndarray,
        following: np.ndarray,
        resistance: np.ndarray,
        slope: np.ndarray,
        period_s: float,
    ) -> np.ndarray:
        """Return the force [N] or moment [N m] to hold for `period_s`, shape (n,).

        On a slope the weight is carried at all times, also by a robot that stands.

        Args:
            speed: speed now [m/s or rad/s].
            wanted: speed asked for now.
            following: speed asked for at the end of the period.
            resistance: what the ground takes [N or N m].
            slope: its sine, positive where the weight works against the motion.
            period_s: how long the force will be held.
        """
        forces = []
        bound = INTEGRAL_LIMIT_M_S2
        brakes = np.abs(slope) > self._level
        values = (speed, wanted, following, resistance, brakes)
        each = zip(*(value.tolist() for value in values), strict=True)
        for index, (now, asked, coming, ground, brake) in enumerate(each):
            error, middle = asked - now, 0.5 * (asked + coming)
            moves = abs(middle) > _STANDSTILL_M_S
            # One that shall stand is held by friction; what was learnt is forgotten.
            learnt = 0.0
            if moves or brake:
                learnt = period_s * INTEGRAL_PER_S2 * error
                learnt = min(max(self._integral_m_s2[index] + learnt, -bound), bound)
            self._integral_m_s2[index] = learnt
            acceleration = (coming - asked) / period_s
            feedback = PROPORTIONAL_PER_S * error + learnt
            inertial = self._inertia[index] * (acceleration + feedback)
            limit = self._limit[index]
            direction = math.copysign(1.0, middle) if moves else 0.0
            forces.append(direction * ground + min(max(inertial, -limit), limit))
        return np.asarray(forces + self._weight * slope)


def drive_control(scene: Scene) -> SpeedLoop:
    """Return the control of all robots of `scene` along their ways, shape (R,)."""
    models = [robot.model for robot in scene.robots]
    weight_N = np.array([item.mass_kg for item in models]) * GRAVITY_M_S2
    return SpeedLoop(
        inertia=np.array([item.effective_mass_kg for item in models]),
        limit=np.array([item.usable_grip for item in models]) * weight_N,
        weight=weight_N,
    )
