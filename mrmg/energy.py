"""The energy model: motion over terrain gives the power drawn from the battery.

Mechanical power at the drive, with v the speed, a the acceleration, k the terrain's
multiplier and psi the steering angle:

    P_rolling = k C_rr m g |v|
    P_turning = C_turn m g |tan psi| |v|
    P_inertia = m_eff a v

Battery power is the sum divided by the drive efficiency when the drive pulls, times the
regeneration efficiency when it brakes, plus idle power. The paper's cost, distance
times terrain plus turning, is the special case m_eff = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

PARTS = ("rolling", "turning", "inertia", "idle")
"""The parts every energy account is split into; their sum is the battery's loss."""

GRAVITY_M_S2 = 9.81

N_COEFFICIENTS = 6
ROLLING_N, TURNING_N, EFFECTIVE_MASS_KG, DRIVE_EFF, REGEN_EFF, IDLE_W = range(
    N_COEFFICIENTS
)


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyModel:
    """Coefficients of one robot's energy model.

    Attributes:
        rolling_force_N: C_rr m g on plain ground (multiplier 1).
        turning_force_N: C_turn m g, the extra force per |tan psi|.
        effective_mass_kg: mass plus the wheels' inertia seen along the road.
        drive_efficiency: battery to wheel, in (0, 1].
        regeneration_efficiency: wheel to battery when braking, in [0, 1].
        idle_power_W: drawn at all times.
    """

    rolling_force_N: float
    turning_force_N: float
    effective_mass_kg: float
    drive_efficiency: float
    regeneration_efficiency: float
    idle_power_W: float

    def coefficients(self) -> np.ndarray:
        """Return the coefficients in the order the kernels index them, shape (6,)."""
        return np.array(
            [
                self.rolling_force_N,
                self.turning_force_N,
                self.effective_mass_kg,
                self.drive_efficiency,
                self.regeneration_efficiency,
                self.idle_power_W,
            ]
        )

    def plain_ground_J_per_m(self) -> float:
        """Return the battery energy of a metre straight on at steady speed, k = 1."""
        return self.rolling_force_N / self.drive_efficiency

    def power_parts(
        self,
        speed_m_s: np.ndarray,
        acceleration_m_s2: np.ndarray,
        tan_steer: np.ndarray,
        multiplier: np.ndarray,
    ) -> np.ndarray:
        """Return the battery power by part [W], shape (n, len(PARTS)).

        Rolling and turning are charged as the battery would feed them; inertia is what
        remains of the total, so it turns negative where a slowing robot coasts.
        """
        way = np.abs(speed_m_s)
        rolling = self.rolling_force_N * multiplier * way
        turning = self.turning_force_N * np.abs(tan_steer) * way
        mechanical = (
            rolling + turning + self.effective_mass_kg * acceleration_m_s2 * speed_m_s
        )
        battery = np.where(
            mechanical > 0.0,
            mechanical / self.drive_efficiency,
            mechanical * self.regeneration_efficiency,
        )
        rolling = rolling / self.drive_efficiency
        turning = turning / self.drive_efficiency
        inertia = battery - rolling - turning
        idle = np.full_like(way, self.idle_power_W)
        return np.stack([rolling, turning, inertia, idle], axis=-1)


def battery_power(v, a, tan_steer, k, c):  # type: ignore[no-untyped-def]
    """Return the battery power [W] of one robot: the scalar form the kernels compile.

    Args:
        v: speed [m/s].
        a: acceleration [m/s^2].
        tan_steer: tan psi (car) or omega L / v (unicycle: zero).
        k: terrain multiplier.
        c: `EnergyModel.coefficients()`.
    """
    way = abs(v)
    mechanical = (
        c[ROLLING_N] * k * way
        + c[TURNING_N] * abs(tan_steer) * way
        + c[EFFECTIVE_MASS_KG] * a * v
    )
    if mechanical > 0.0:
        return mechanical / c[DRIVE_EFF] + c[IDLE_W]
    return mechanical * c[REGEN_EFF] + c[IDLE_W]
