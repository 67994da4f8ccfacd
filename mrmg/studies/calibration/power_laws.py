"""Laws by which a robot's speed and yaw rate give its power, to be fitted to logs.

Each law is linear in means over time of features of the motion, with coefficients that
are a function of few parameters of a terrain:

- `linear`, the energy model's: P = P0 + a |v| + b |w|;
- `saturating`: P = P0 + a |v| + b |w| + c tanh(|w| / W), turning that costs a power of
  its own as soon as there is any;
- `quadratic`: P = P0 + a |v| + b |w| + c v^2, resistance that grows with speed;
- `motor`: each side's motor draws the current I that holds a constant force of rolling
  and one of scrub, and heats its winding,

      I_s = A sign(v_s) +- B h,    P = P0 + sum_s (K v_s I_s + R I_s^2),

  with the back-EMF K per speed and the resistance R of `robot.yaml`, v_s = v -+ T w / 2
  and h in [0, 1]: tyres give their full side force from a slip angle of a few degrees
  on (Pacejka, Tire and Vehicle Dynamics, brush model), which a skid-steered robot
  exceeds in all but wide turns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.scene.robot_model import RobotModel

SATURATION_RAD_S = 0.1
"""Yaw rate W at which the law `saturating` bends."""

FULL_SLIP = 0.1
"""Ratio of T |w| / 2 to |v| from which scrub is full: slip angles of about 3 degrees of
wheels as far ahead of the middle as a quarter of the effective track."""

CREEP_M_S = 0.01
"""Rim speed below which a side counts as standing."""


@dataclass(frozen=True, slots=True)
class PolynomialLaw:
    """A law that is linear in its parameters: `linear`, `saturating` or `quadratic`.

    Attributes:
        name: which of them.
        stationary_W: power at rest, which the constant does not fall below.
    """

    name: str
    stationary_W: float = 0.0

    @property
    def formula(self) -> str:
        """How it reads."""
        more = {"saturating": " + c tanh(|w| / W)", "quadratic": " + c v^2"}
        return f"P0 + a |v| + b |w|{more.get(self.name, '')}"

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of its parameters, with units."""
        last = {"saturating": ("c [W]",), "quadratic": ("c [W s^2/m^2]",)}
        first = ("a [W s/m]", "b [W s/rad]", "P0 [W]")
        return first + last.get(self.name, ())

    def features(self, speed_m_s: np.ndarray, yaw_rate_rad_s: np.ndarray) -> np.ndarray:
        """Return |v|, |w|, 1 and what is the law's own, shape (n,) -> (n, k)."""
        speed, yaw_rate = np.abs(speed_m_s), np.abs(yaw_rate_rad_s)
        columns = [speed, yaw_rate, np.ones_like(speed)]
        if self.name == "saturating":
            columns.append(np.tanh(yaw_rate / SATURATION_RAD_S))
        if self.name == "quadratic":
            columns.append(speed**2)
        return np.stack(columns, axis=1)

    def coefficients(self, parameters: np.ndarray) -> np.ndarray:
        """Return the parameters, P0 above the power at rest."""
        found = parameters.copy()
        found[2] += self.stationary_W
        return found

    def start(self, power_W: float, speed_m_s: float) -> np.ndarray:
        """Return parameters to begin a fit with."""
        per_speed = power_W / max(speed_m_s, CREEP_M_S)
        start = np.array([per_speed, per_speed, 0.2 * power_W, 0.2 * power_W])
        return start[: len(self.parameters)]


@dataclass(frozen=True, slots=True)
class MotorLaw:
    """The law `motor`.

    Attributes:
        volts_per_m_s: K, back-EMF per rim speed.
        resistance_Ohm: R, of the motors of a side.
        track_m: T, effective track.
        stationary_W: P0.
        fits_stationary: whether P0 is a parameter, above `stationary_W`.
    """

    volts_per_m_s: float
    resistance_Ohm: float
    track_m: float
    stationary_W: float = 0.0
    fits_stationary: bool = False

    name = "motor"
    formula = "P0 + sum_s (K v_s I_s + R I_s^2), I_s = A sign(v_s) +- B h"

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of its parameters, with units."""
        return ("A [A]", "B [A]") + (("P0 [W]",) if self.fits_stationary else ())

    def features(self, speed_m_s: np.ndarray, yaw_rate_rad_s: np.ndarray) -> np.ndarray:
        """Return what A, B, A^2, B^2, A B and P0 multiply, shape (n,) -> (n, 6)."""
        speed, half = speed_m_s, 0.5 * self.track_m * yaw_rate_rad_s
        left, right = speed - half, speed + half
        moving = (np.abs(left) > CREEP_M_S) | (np.abs(right) > CREEP_M_S)
        rims = np.abs(left) + np.abs(right)
        slip = np.maximum(FULL_SLIP * np.abs(speed), CREEP_M_S)
        scrub = np.minimum(np.abs(half) / slip, 1.0)
        # Spinning, rolling and scrub resist both sides; in arcs scrub drives the inner.
        spinning = np.sign(half) * (np.sign(right) - np.sign(left))
        return np.stack(
            [
                rims,
                2.0 * np.abs(half) * scrub,
                moving,
                scrub**2,
                spinning * scrub,
                np.ones_like(speed),
            ],
            axis=1,
        )

    def coefficients(self, parameters: np.ndarray) -> np.ndarray:
        """Return what multiplies the features, shape (6,)."""
        a, b = parameters[:2]
        k, r = self.volts_per_m_s, 2.0 * self.resistance_Ohm
        more_W = parameters[2] if self.fits_stationary else 0.0
        heat = [r * a * a, r * b * b, r * a * b]
        return np.array([k * a, k * b, *heat, self.stationary_W + more_W])

    def start(self, power_W: float, speed_m_s: float) -> np.ndarray:
        """Return parameters to begin a fit with."""
        amperes = 0.3 * power_W / (self.volts_per_m_s * max(speed_m_s, 0.1))
        start = np.array([amperes, 2.0 * amperes, 0.1 * power_W])
        return start[: len(self.parameters)]


PowerLaw = PolynomialLaw | MotorLaw
"""A law of power."""


def laws_of(
    model: RobotModel, *, stationary_W: float, knows_stationary: bool
) -> tuple[PowerLaw, ...]:
    """Return the laws that can be fitted to logs of a robot, the simplest first.

    Args:
        model: `motor` needs its motor constants.
        stationary_W: power at rest as far as it was logged, else 0.
        knows_stationary: whether it was logged.
    """
    laws: list[PowerLaw] = [
        PolynomialLaw(name, stationary_W)
        for name in ("linear", "saturating", "quadratic")
    ]
    if model.motor is not None:
        laws.append(
            MotorLaw(
                volts_per_m_s=model.motor.volts_per_m_s(model.wheel_radius_m),
                resistance_Ohm=model.motor.resistance_Ohm,
                track_m=model.skid_track_m or model.track_m,
                stationary_W=stationary_W,
                fits_stationary=not knows_stationary,
            )
        )
    return tuple(laws)
