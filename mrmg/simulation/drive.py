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
from mrmg.scene.robot_model import DRIVEN_LOAD_SHARE, GRIP_SHARE, RobotModel
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

    def __init__(self, inertia: np.ndarray, limit: np.ndarray) -> None:
        """Control speeds that are all zero at first.

        Args:
            inertia: mass [kg] or moment of inertia [kg m^2], shape (n,).
            limit: bound of the part that accelerates [N or N m], shape (n,).
        """
        self._inertia, self._limit = inertia.tolist(), limit.tolist()
        self._integral_m_s2 = [0.0] * len(inertia)

    def force(
        self,
        speed: np.ndarray,
        wanted: np.ndarray,
        following: np.ndarray,
        resistance: np.ndarray,
        brakes: np.ndarray,
        period_s: float,
    ) -> np.ndarray:
        """Return the force [N] or moment [N m] to hold for `period_s`, shape (n,).

        Args:
            speed: speed now [m/s or rad/s].
            wanted: speed asked for now.
            following: speed asked for at the end of the period.
            resistance: what the ground takes [N or N m].
            brakes: where standing takes more than friction, as on a slope.
            period_s: how long the force will be held.
        """
        forces = []
        bound = INTEGRAL_LIMIT_M_S2
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
        return np.array(forces)


class DriveControl:
    """Speed control of all robots along their ways."""

    def __init__(self, scene: Scene) -> None:
        """Control the robots of `scene`, all at rest."""
        models = [robot.model for robot in scene.robots]
        self._weight_N = np.array([item.mass_kg for item in models]) * GRAVITY_M_S2
        self._loop = SpeedLoop(
            inertia=np.array([item.effective_mass_kg for item in models]),
            limit=np.array([usable_grip_N(item) for item in models]),
        )

    def force_N(
        self,
        speed_m_s: np.ndarray,
        wanted_m_s: np.ndarray,
        next_m_s: np.ndarray,
        resistance_N: np.ndarray,
        slope: np.ndarray,
        period_s: float,
    ) -> np.ndarray:
        """Return the force to hold for `period_s`, shape (R,).

        On a slope the weight is carried at all times, also by a robot that stands.

        Args:
            speed_m_s: speed of the axle now.
            wanted_m_s: speed asked for now.
            next_m_s: speed asked for at the end of the period.
            resistance_N: force the ground is believed to take.
            slope: sine of the slope along each heading.
            period_s: how long the force will be held.
        """
        force_N = self._loop.force(
            speed_m_s, wanted_m_s, next_m_s, resistance_N, slope != 0.0, period_s
        )
        return np.asarray(force_N + self._weight_N * slope)


def usable_grip_N(model: RobotModel) -> float:
    """Return how much of the driven axle's grip under its least load is used."""
    share = DRIVEN_LOAD_SHARE * model.friction_coefficient
    return GRIP_SHARE * (share * model.mass_kg * GRAVITY_M_S2)
