"""From a robot model to the parameters its simulated robot shows."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

import mrmg
from mrmg.errors import UsageError
from mrmg.scene.driven_parts import why_not_driven
from mrmg.scene.loading.editing import KeyPath, NewValue
from mrmg.scene.robot_model import RobotModel
from mrmg.simulation.plants import DEFAULT_PLANT
from mrmg.studies.calibration.fit import CONFIDENCE, LinearFit, fit_linear
from mrmg.studies.calibration.manoeuvres import manoeuvres_of
from mrmg.studies.calibration.measurement import PARAMETERS, UNITS, Leg, drive_legs

Progress = Callable[[float, str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A parameter of the energy model as it was measured.

    Attributes:
        value: best estimate.
        half_width: of its confidence interval; infinite where one measurement alone
            yields the value, nan where none does.
        unit: of both.
        was: what the model states; None where the model has no such parameter.
        key: where `robot.yaml` has it; None where it has not.
    """

    value: float
    half_width: float
    unit: str
    was: float | None = None
    key: KeyPath | None = None

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper end of the confidence interval."""
        return self.value - self.half_width, self.value + self.half_width

    @property
    def has_interval(self) -> bool:
        """Whether it is known how far off the value may be."""
        return math.isfinite(self.half_width)

    def rounded(self) -> str:
        """Return the value with the digits that the interval supports, and one more."""
        if not self.half_width or not self.value:
            return repr(self.value)
        digits = math.ceil(math.log10(abs(self.value) / self.half_width)) + 1
        return repr(float(f"{self.value:.{max(digits, 2)}g}"))

    def to_json(self) -> dict[str, Any]:
        """Return the estimate as JSON data; without ends if they are not known."""
        low, high = self.interval if self.has_interval else (None, None)
        return {
            "value": self.value,
            "low": low,
            "high": high,
            "unit": self.unit,
            "was": self.was,
            "key": ".".join(self.key) if self.key else None,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """What the manoeuvres of one model yield.

    Attributes:
        model: what was calibrated, as it was before.
        legs: what was driven.
        fit: of the legs' power by the parameters of `measurement.PARAMETERS`.
        estimates: by name; those of `PARAMETERS` and the wheel inertia that makes the
            model's effective mass the measured one.
        plant: ground contact that they were driven on.
    """

    model: RobotModel
    legs: tuple[Leg, ...]
    fit: LinearFit
    estimates: Mapping[str, Estimate]
    plant: str = DEFAULT_PLANT

    def changes(self) -> dict[KeyPath, NewValue]:
        """Return what `robot.yaml` should say instead."""
        return {
            item.key: _new_value(item, self.plant)
            for item in self.estimates.values()
            if item.key is not None
        }

    def to_json(self) -> dict[str, Any]:
        """Return everything as JSON data."""
        legs = [
            {
                "manoeuvre": leg.manoeuvre.name,
                "piece": leg.piece,
                "multiplier": leg.manoeuvre.multiplier,
                "duration_s": leg.duration_s,
                "measured_W": leg.power_W,
                "fitted_W": float(fitted),
                "residual_W": float(residual),
            }
            for leg, fitted, residual in zip(
                self.legs, self.fit.fitted, self.fit.residual, strict=True
            )
        ]
        return {
            "format": 1,
            "model": self.model.name,
            "plant": self.plant,
            "confidence": CONFIDENCE,
            "parameters": {
                name: item.to_json() for name, item in self.estimates.items()
            },
            "residual_rms_W": self.fit.residual_rms,
            "residual_max_W": float(np.abs(self.fit.residual).max()),
            "legs": legs,
            "versions": {"mrmg": mrmg.__version__, "mujoco": version("mujoco")},
        }


def calibrate(
    model: RobotModel,
    *,
    plant: str = DEFAULT_PLANT,
    on_progress: Progress | None = None,
) -> Calibration:
    """Drive the manoeuvres of a model in MuJoCo and fit its energy model to them.

    Equal models give equal calibrations.

    Args:
        model: gives limits, geometry, mass and MJCF; what it believes of rolling,
            turning and inertia only helps its drive control.
        plant: ground contact that it is driven on.
        on_progress: called with the fraction done and what is being driven.

    Raises:
        UsageError: if the model can only be planned for, the robot cannot drive the
            manoeuvres, or moves as if it had less mass than the model states.
        FileError: if its MJCF cannot be used.
    """
    reason = why_not_driven(model)
    if reason is not None:
        raise UsageError(
            f"model '{model.name}' has {reason}; there is nothing to drive in MuJoCo"
        )
    manoeuvres = manoeuvres_of(model)
    legs: list[Leg] = []
    for index, manoeuvre in enumerate(manoeuvres):
        if on_progress is not None:
            on_progress(index / len(manoeuvres), manoeuvre.name)
        legs += drive_legs(model, manoeuvre, plant)
    return fit_legs(model, legs, plant)


def fit_legs(
    model: RobotModel, legs: Sequence[Leg], plant: str = DEFAULT_PLANT
) -> Calibration:
    """Fit the energy model of `model` to the power of legs that were driven.

    Raises:
        UsageError: if the robot moves as if it had less mass than the model states.
    """
    matrix = np.array([leg.features for leg in legs])
    fit = fit_linear(matrix, np.array([leg.power_W for leg in legs]))
    return Calibration(
        model=model,
        legs=tuple(legs),
        fit=fit,
        estimates=_estimates(model, fit),
        plant=plant,
    )


def _estimates(model: RobotModel, fit: LinearFit) -> dict[str, Estimate]:
    estimates = {
        name: Estimate(
            value=float(value),
            half_width=float(half_width),
            unit=UNITS[name],
            was=getattr(model, name, None),
            key=(name,) if name.endswith("_coefficient") else None,
        )
        for name, value, half_width in zip(
            PARAMETERS, fit.value, fit.half_width, strict=True
        )
    }
    estimates["wheel_inertia_kg_m2"] = _wheel_inertia(
        model, estimates["effective_mass_kg"]
    )
    return estimates


def _wheel_inertia(model: RobotModel, effective_mass: Estimate) -> Estimate:
    """Return the inertia of a wheel that accounts for the effective mass."""
    per_kg_m2 = model.wheel_radius_m**2 / model.wheel_count
    value = (effective_mass.value - model.mass_kg) * per_kg_m2
    if value < 0.0:
        raise UsageError(
            f"model '{model.name}' resists acceleration like "
            f"{effective_mass.value:.1f} kg, less than its mass of {model.mass_kg:g} "
            "kg in robot.yaml; correct the mass there"
        )
    return Estimate(
        value=value,
        half_width=effective_mass.half_width * per_kg_m2,
        unit="kg m^2",
        was=model.wheel_inertia_kg_m2,
        key=("wheel", "inertia"),
    )


def _new_value(item: Estimate, plant: str) -> NewValue:
    unit = "" if item.unit == "1" else f" {item.unit}"
    where = "" if plant == DEFAULT_PLANT else f" on the plant {plant}"
    detail = (
        f" {version('mujoco')}{where}: +-{item.half_width:.1g}{unit} ({CONFIDENCE:.0%})"
    )
    return NewValue(item.rounded(), item.unit, "calibrated in MuJoCo", detail)
