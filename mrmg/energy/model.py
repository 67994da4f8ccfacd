"""The energy model: motion over terrain gives the power drawn from the battery.

Mechanical power at the drive, with v the speed over the map, a its change, k the
terrain's multiplier, k_turn that of turning, L theta' the speed at which tyres scrub in
a turn and h' the rate of climb:

    P_rolling = k C_rr m g |v|
    P_turning = k_turn C_turn m g |L theta'|
    P_inertia = m_eff a v
    P_grade   = m g h'

Battery power is the sum divided by the drive efficiency when the drive pulls, times the
regeneration efficiency when it brakes, plus idle and device power.

Rolling is charged by the way over the map: on a slope the way is longer by 1 / cos and
the load on the tyres smaller by cos. The grade's power is that of the height, so that
whatever is climbed adds up to m g times the difference of heights.

The paper's cost, distance times terrain plus turning, has neither inertia, grade nor
other consumers: the preset "paper".
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

PARTS = ("rolling", "turning", "inertia", "grade", "idle", "device")
"""The parts every energy account is split into; their sum is the battery's loss."""

EnergyPreset = Literal["full", "paper"]
"""Which parts count: all of them, or those of the paper's cost."""

GRAVITY_M_S2 = 9.81

N_COEFFICIENTS = 7
(
    ROLLING_N,
    TURNING_N,
    EFFECTIVE_MASS_KG,
    WEIGHT_N,
    DRIVE_EFF,
    REGEN_EFF,
    CONSUMERS_W,
) = range(N_COEFFICIENTS)


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyModel:
    """Coefficients of one robot's energy model.

    Attributes:
        rolling_force_N: C_rr m g on plain ground (multiplier 1).
        turning_force_N: C_turn m g, the force that scrubbing tyres meet.
        effective_mass_kg: mass plus the wheels' inertia seen along the road.
        weight_N: m g, what climbing works against.
        drive_efficiency: battery to wheel, in (0, 1].
        regeneration_efficiency: wheel to battery when braking, in [0, 1].
        idle_power_W: drawn at all times by the robot itself.
        device_power_W: drawn at all times by what it carries.
    """

    rolling_force_N: float
    turning_force_N: float
    effective_mass_kg: float
    weight_N: float
    drive_efficiency: float
    regeneration_efficiency: float
    idle_power_W: float
    device_power_W: float

    def with_preset(self, preset: EnergyPreset) -> EnergyModel:
        """Return the model with only the parts that count in `preset`.

        A metre of plain ground costs the same in all presets.
        """
        if preset == "full":
            return self
        return replace(
            self,
            effective_mass_kg=0.0,
            weight_N=0.0,
            idle_power_W=0.0,
            device_power_W=0.0,
        )

    def coefficients(self) -> np.ndarray:
        """Return what the kernels index, shape (N_COEFFICIENTS,)."""
        return np.array(
            [
                self.rolling_force_N,
                self.turning_force_N,
                self.effective_mass_kg,
                self.weight_N,
                self.drive_efficiency,
                self.regeneration_efficiency,
                self.idle_power_W + self.device_power_W,
            ]
        )

    def plain_ground_J_per_m(self) -> float:
        """Return the battery energy of a metre straight on at steady speed, k = 1."""
        return self.rolling_force_N / self.drive_efficiency

    def power_parts(
        self,
        speed_m_s: np.ndarray,
        acceleration_m_s2: np.ndarray,
        turn_speed_m_s: np.ndarray,
        multiplier: np.ndarray,
        climb_m_s: np.ndarray,
    ) -> np.ndarray:
        """Return the battery power by part [W], shape (n, len(PARTS)).

        Rolling and turning are charged as the battery would feed them. Inertia and
        grade share what remains of the drive's total in proportion to their mechanical
        power, so they turn negative where a robot slows down or descends.

        Args:
            speed_m_s: speed over the map, negative backwards, shape (n,).
            acceleration_m_s2: its change, shape (n,).
            turn_speed_m_s: k_turn L |theta'|, see `motion.dynamics.TURN_SPEEDS`, shape
                (n,).
            multiplier: of the terrain, shape (n,).
            climb_m_s: rate of climb, 0 on flat ground, shape (n,).
        """
        rolling = self.rolling_force_N * multiplier * np.abs(speed_m_s)
        turning = self.turning_force_N * turn_speed_m_s
        inertia = self.effective_mass_kg * acceleration_m_s2 * speed_m_s
        grade = self.weight_N * climb_m_s
        mechanical = rolling + turning + inertia + grade
        battery = np.where(
            mechanical > 0.0,
            mechanical / self.drive_efficiency,
            mechanical * self.regeneration_efficiency,
        )
        rolling = rolling / self.drive_efficiency
        turning = turning / self.drive_efficiency
        stored = inertia + grade
        share = np.divide(
            battery - rolling - turning,
            stored,
            out=np.full_like(stored, 1.0 / self.drive_efficiency),
            where=mechanical < 0.0,
        )
        grade = grade * share
        inertia = battery - rolling - turning - grade
        idle = np.full_like(battery, self.idle_power_W)
        device = np.full_like(battery, self.device_power_W)
        return np.stack([rolling, turning, inertia, grade, idle, device], axis=-1)


def battery_power(v, a, turn_speed, k, climb, c):  # type: ignore[no-untyped-def]
    """Return the battery power [W] of one robot: the scalar form the kernels compile.

    Args:
        v: speed [m/s].
        a: acceleration [m/s^2].
        turn_speed: k_turn L |theta'| [m/s].
        k: terrain multiplier.
        climb: rate of climb [m/s].
        c: `EnergyModel.coefficients()`.
    """
    mechanical = (
        c[ROLLING_N] * k * abs(v)
        + c[TURNING_N] * turn_speed
        + c[EFFECTIVE_MASS_KG] * a * v
        + c[WEIGHT_N] * climb
    )
    if mechanical > 0.0:
        return mechanical / c[DRIVE_EFF] + c[CONSUMERS_W]
    return mechanical * c[REGEN_EFF] + c[CONSUMERS_W]
