"""The electric motors of a robot's sides: current and speed give power."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Motor:
    """The direct-current motors of one side and their gear, as one motor.

    Attributes:
        torque_constant_Nm_A: torque before the gear per current.
        back_emf_constant_V_s: voltage per speed of the motor [V s/rad].
        resistance_Ohm: of the winding.
        gear_ratio: turns of the motor per turn of the wheel.
        gear_efficiency: from motor to wheel, in (0, 1].
        no_load_current_A: what turns motor and gear alone.
    """

    torque_constant_Nm_A: float
    back_emf_constant_V_s: float
    resistance_Ohm: float
    gear_ratio: float
    gear_efficiency: float
    no_load_current_A: float

    def volts_per_m_s(self, wheel_radius_m: float) -> float:
        """Return the back-EMF per speed of the wheels' rims [V s/m]."""
        return self.back_emf_constant_V_s * self.gear_ratio / wheel_radius_m

    def power_W(
        self, current_A: np.ndarray, speed_m_s: np.ndarray, wheel_radius_m: float
    ) -> np.ndarray:
        """Return the electric power of a side: current times terminal voltage.

        The terminal voltage is that of the back-EMF and of the winding, E + R I. Where
        no current is negative, its sign was not measured, nor that of the speed counts.
        """
        unsigned = bool(np.all(current_A >= 0.0))
        speed = np.abs(speed_m_s) if unsigned else speed_m_s
        volts = self.volts_per_m_s(wheel_radius_m) * speed
        return np.asarray(current_A * (volts + self.resistance_Ohm * current_A))
