"""Energy parameters of terrains from a law that was fitted to logs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrmg.scene.robot_model import RobotModel
from mrmg.studies.calibration.calibrate import Estimate
from mrmg.studies.calibration.fit import t_quantile
from mrmg.studies.calibration.log_fit import LawFit
from mrmg.studies.calibration.power_laws import PowerLaw
from mrmg.studies.calibration.robot_logs import LoggedRun

LEAST_REST_S = 1.0
"""Time at rest from which the stationary power is found."""

EXCITED_SHARE = 0.02
"""Share of its runs' time that a robot must drive, or turn, to be calibrated for it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TerrainEstimate:
    """What the runs on a terrain yield.

    Attributes:
        name: of the terrain.
        runs: how many there are.
        rolling_W_s_m: power of driving straight on at cruise speed, over the speed.
        turning_W_s_rad: power of turning at the planned rate, over the rate.
        stationary_W: power at rest.
        inertia_kg: mass that resists acceleration, the motors' share included.
        multiplier: rolling over that of the first terrain.
        turning_multiplier: turning over that of the first terrain.
        energy_spread: of a run's energy from run to run.
    """

    name: str
    runs: int
    rolling_W_s_m: Estimate
    turning_W_s_rad: Estimate
    stationary_W: Estimate
    inertia_kg: Estimate
    multiplier: float
    turning_multiplier: float
    energy_spread: float

    def entry(self) -> dict[str, float | str]:
        """Return the terrain's entry in a scene."""
        return {
            "id": self.name,
            "multiplier": round(self.multiplier, 3),
            "turning_multiplier": round(self.turning_multiplier, 3),
            "energy_spread": round(self.energy_spread, 3),
        }

    def to_json(self) -> dict[str, Any]:
        """Return everything as JSON data."""
        found = ("rolling_W_s_m", "turning_W_s_rad", "stationary_W", "inertia_kg")
        estimates = {name: getattr(self, name).to_json() for name in found}
        return {**self.entry(), "runs": self.runs, **estimates}


def turning_length_m(model: RobotModel) -> float:
    """Return the length by which a yaw rate is a speed of scrub in the energy model."""
    return model.wheelbase_m if model.motion_model == "car" else model.track_m


def stationary_power(model: RobotModel, runs: Sequence[LoggedRun]) -> Estimate:
    """Return the power at rest: the median of the medians of runs that rest enough.

    What the model states if none does. One run alone does not show how runs differ.
    """
    rests = [
        run.power_W[run.at_rest]
        for run in runs
        if float(run.weight_s[run.at_rest].sum()) >= LEAST_REST_S
    ]
    medians = np.array([float(np.median(power)) for power in rests])
    was_W = model.idle_power_W
    if not len(medians):
        return Estimate(value=was_W, half_width=np.nan, unit="W", was=was_W)
    value_W, number = float(np.median(medians)), len(medians)
    half_W = math.inf
    if number > 1:
        error_W = float(np.std(medians, ddof=1)) / math.sqrt(number)
        # A median is less certain than a mean, by this factor at most.
        half_W = t_quantile(number - 1) * math.sqrt(math.pi / 2.0) * error_W
    return Estimate(value=value_W, half_width=half_W, unit="W", was=was_W)


def terrain_estimates(
    model: RobotModel, fit: LawFit, runs: Sequence[LoggedRun], stationary: Estimate
) -> tuple[TerrainEstimate, ...]:
    """Return what the runs on each terrain yield; the first terrain is plain ground."""
    secants = {
        name: _secants(model, fit.law, item) for name, item in fit.parameters.items()
    }
    plain = next(iter(secants.values()))
    found = []
    for name, (rolling, turning) in secants.items():
        rows = fit.rows(name)
        own = [runs[at] for at in rows]
        values = np.array(
            [_secants(model, fit.law, item) for item in fit.without[rows]]
        )
        half = np.where(_excitation(own), _jackknife(values), np.nan).tolist()
        inertia = np.array([_inertia(model, fit, run) for run in own])
        weight = np.array([_jolt(run) for run in own])
        mass = float(inertia @ weight / max(float(weight.sum()), 1e-9))
        mass_half = _spread_of_mean(inertia, weight)
        found.append(
            TerrainEstimate(
                name=name,
                runs=len(own),
                rolling_W_s_m=Estimate(value=rolling, half_width=half[0], unit="W s/m"),
                turning_W_s_rad=Estimate(
                    value=turning, half_width=half[1], unit="W s/rad"
                ),
                stationary_W=stationary,
                inertia_kg=Estimate(
                    value=mass,
                    half_width=mass_half,
                    unit="kg",
                    was=model.effective_mass_kg,
                ),
                multiplier=_ratio(rolling, plain[0]),
                turning_multiplier=_ratio(turning, plain[1]),
                energy_spread=fit.spread(name).deviation,
            )
        )
    return tuple(found)


def _secants(
    model: RobotModel, law: PowerLaw, parameters: np.ndarray
) -> tuple[float, float]:
    """Return power over speed at cruise, and over yaw rate in the planned turn."""
    limits = model.planned_limits
    speed = limits.v_max_m_s
    car = model.motion_model == "car"
    turn_speed = speed if car else 0.0
    rate = limits.w_max
    if car:
        rate = speed * np.tan(limits.w_max) / model.wheelbase_m
    rest, cruise, before, turning = (
        law_power_W(law, parameters, v, w)
        for v, w in ((0.0, 0.0), (speed, 0.0), (turn_speed, 0.0), (turn_speed, rate))
    )
    return (cruise - rest) / speed, max(turning - before, 1e-6) / float(rate)


def law_power_W(
    law: PowerLaw, parameters: np.ndarray, speed_m_s: float, yaw_rate_rad_s: float
) -> float:
    """Return the power of steady motion by a law."""
    features = law.features(np.array([speed_m_s]), np.array([yaw_rate_rad_s]))
    return float(features[0] @ law.coefficients(parameters))


def _jackknife(values: np.ndarray) -> np.ndarray:
    """Return half-widths of the confidence intervals of a mean of runs, shape (k,)."""
    runs = len(values)
    if runs < 2:
        return np.full(values.shape[1], np.nan)
    variance = (runs - 1) / runs * ((values - values.mean(axis=0)) ** 2).sum(axis=0)
    return np.asarray(t_quantile(runs - 1) * np.sqrt(variance))


def _excitation(runs: Sequence[LoggedRun]) -> tuple[bool, bool]:
    """Return whether a robot drove, and whether it turned, in enough of the time."""
    time_s = sum(float(run.weight_s.sum()) for run in runs)
    drives_s = sum(float(run.weight_s @ (np.abs(run.speed_m_s) > 0.05)) for run in runs)
    turns_s = sum(
        float(run.weight_s @ (np.abs(run.yaw_rate_rad_s) > 0.03)) for run in runs
    )
    return drives_s > EXCITED_SHARE * time_s, turns_s > EXCITED_SHARE * time_s


def _acceleration_power(run: LoggedRun) -> np.ndarray:
    """Return v dv/dt of each row [m^2/s^3]: power of inertia per kg, shape (n,)."""
    return np.asarray(np.gradient(0.5 * run.speed_m_s**2, run.time_s))


def _jolt(run: LoggedRun) -> float:
    return float(run.weight_s @ _acceleration_power(run) ** 2)


def _inertia(model: RobotModel, fit: LawFit, run: LoggedRun) -> float:
    """Return the mass that the law's error over accelerations shows in a run [kg]."""
    features = fit.law.features(run.speed_m_s, run.yaw_rate_rad_s)
    coefficients = fit.law.coefficients(fit.parameters[run.terrain])
    error_W = run.power_W - features @ coefficients
    felt = float((run.weight_s * error_W) @ _acceleration_power(run))
    return model.drive_efficiency * felt / max(_jolt(run), 1e-12)


def _spread_of_mean(values: np.ndarray, weight: np.ndarray) -> float:
    """Return the half-width of the confidence interval of a weighted mean."""
    effective = float(weight.sum() ** 2 / max(float((weight**2).sum()), 1e-12))
    if effective <= 1.5:
        return float("nan")
    mean = float(values @ weight / weight.sum())
    variance = float(weight @ (values - mean) ** 2 / weight.sum()) / (effective - 1.0)
    return t_quantile(effective - 1.0) * math.sqrt(variance)


def _ratio(value: float, plain: float) -> float:
    return max(max(value, 1e-9) / max(plain, 1e-9), 1e-3)
