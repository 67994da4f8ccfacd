"""From logged runs on several terrains to energy parameters of a robot.

Every law of `power_laws` is fitted, each run left out in turn; that with the least mean
error predicts. What the planner's energy model has, one coefficient of rolling and one
of turning per terrain, are the secants of that law at the speeds that the robot plans
with: its cruise speed, and its yaw rate on the spot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrmg.counted import counted
from mrmg.energy.model import GRAVITY_M_S2
from mrmg.errors import UsageError
from mrmg.scene.loading.editing import KeyPath, NewValue
from mrmg.scene.robot_model import RobotModel
from mrmg.studies.calibration.calibrate import Estimate
from mrmg.studies.calibration.fit import CONFIDENCE
from mrmg.studies.calibration.log_fit import (
    PREDICTED_SHARE,
    LawFit,
    Pieces,
    fit_law,
)
from mrmg.studies.calibration.power_laws import laws_of
from mrmg.studies.calibration.robot_logs import LoggedRun
from mrmg.studies.calibration.terrain_estimates import (
    TerrainEstimate,
    stationary_power,
    terrain_estimates,
    turning_length_m,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPrediction:
    """A run's energy as it was measured and as it is predicted without the run.

    Attributes:
        run: the log.
        fitted: whether other predictions use the run; not for test runs.
        predicted_J: by the law fitted to the other runs of the terrain.
        interval_J: holds the energy with a probability of `PREDICTED_SHARE`.
    """

    run: LoggedRun
    fitted: bool
    predicted_J: float
    interval_J: tuple[float, float]

    @property
    def error_pct(self) -> float:
        """Predicted less measured energy, as a share of the measured one."""
        return 100.0 * (self.predicted_J / self.run.energy_J - 1.0)

    @property
    def holds(self) -> bool:
        """Whether the interval holds the measured energy."""
        low, high = self.interval_J
        return low <= self.run.energy_J <= high

    def to_json(self) -> dict[str, Any]:
        """Return the prediction as JSON data."""
        return {
            "file": self.run.file,
            "terrain": self.run.terrain,
            "energy_J": self.run.energy_J,
            "predicted_J": self.predicted_J,
            "error_pct": self.error_pct,
            "interval_J": list(self.interval_J),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class LogCalibration:
    """What logs of a robot yield.

    Attributes:
        model: whose they are, as it was before.
        runs: the fitted ones first, then the test runs.
        fits: of all laws; the best first.
        terrains: in the order they were named; the first one is plain ground.
        stationary_W: power at rest.
    """

    model: RobotModel
    runs: tuple[RunPrediction, ...]
    fits: tuple[LawFit, ...]
    terrains: tuple[TerrainEstimate, ...]
    stationary_W: Estimate

    @property
    def notes(self) -> tuple[str, ...]:
        """What of the logs is left out."""
        return tuple(note for item in self.runs for note in item.run.notes)

    def changes(self) -> dict[KeyPath, NewValue]:
        """Return what `robot.yaml` should say instead: of the first terrain."""
        plain = self.terrains[0]
        weight_N = self.model.mass_kg * GRAVITY_M_S2 / self.model.drive_efficiency
        scrub_m = turning_length_m(self.model)
        found = {
            "rolling_coefficient": (plain.rolling_W_s_m, weight_N),
            "turning_coefficient": (plain.turning_W_s_rad, weight_N * scrub_m),
            "idle_power": (self.stationary_W, 1.0),
        }
        files = len([item for item in self.runs if item.fitted])
        changes: dict[KeyPath, NewValue] = {}
        for key, (estimate, unit) in found.items():
            if estimate.half_width != estimate.half_width:
                continue  # not determined by these runs
            value, half = estimate.value / unit, estimate.half_width / unit
            law = self.fits[0].law.name
            source = f": {counted(files, 'run')}, on {plain.name}, law {law}"
            width = f" +-{half:.1g} ({CONFIDENCE:.0%})" if estimate.has_interval else ""
            unit_text = "W" if key == "idle_power" else "1"
            changes[(key,)] = NewValue(
                repr(float(f"{value:.4g}")), unit_text, "fitted to logs", source + width
            )
        return changes

    def laws_json(self) -> list[dict[str, Any]]:
        """Return how well each law predicts runs it was not fitted to, best first."""
        return [
            {
                "name": fit.law.name,
                "formula": fit.law.formula,
                "parameters_per_terrain": len(fit.law.parameters),
                **fit.quality(),
            }
            for fit in self.fits
        ]

    def to_json(self) -> dict[str, Any]:
        """Return everything as JSON data."""
        best, names = self.fits[0].law, ", ".join(fit.law.name for fit in self.fits[1:])
        return {
            "format": 1,
            "model": self.model.name,
            "law": best.name,
            "law_reason": f"'{best.name}' misses the runs it was not fitted to by the "
            f"least mean |log(measured / predicted)|, before {names}",
            "laws": self.laws_json(),
            "prediction_share": PREDICTED_SHARE,
            "confidence": CONFIDENCE,
            "stationary_W": self.stationary_W.to_json(),
            "terrains": [item.to_json() for item in self.terrains],
            "runs": [item.to_json() for item in self.runs],
            "notes": list(self.notes),
            "tested": [item.run.file for item in self.runs if not item.fitted],
        }


def calibrate_from_logs(
    model: RobotModel, runs: Sequence[LoggedRun], tests: Sequence[LoggedRun] = ()
) -> LogCalibration:
    """Fit the energy parameters of a robot to logged runs.

    Args:
        model: gives mass, geometry, efficiency and motor constants, if it has any.
        runs: fitted; the terrain of the first one is plain ground.
        tests: only predicted; their terrains must be among those of `runs`.

    Raises:
        UsageError: if there are fewer than two runs, or a test run's terrain is not
            among theirs.
    """
    if len(runs) < 2:
        raise UsageError("one log does not show how runs differ; give at least two")
    known = list(dict.fromkeys(run.terrain for run in runs))
    for test in tests:
        if test.terrain not in known:
            raise UsageError(
                f"{test.file}: no log is of terrain '{test.terrain}'; fitted are "
                f"{', '.join(known)}"
            )
    stationary = stationary_power(model, runs)
    knows = not np.isnan(stationary.half_width)
    laws = laws_of(
        model,
        stationary_W=stationary.value if knows else 0.0,
        knows_stationary=knows or all(run.of_motors for run in runs),
    )
    fits = sorted(
        (fit_law(law, runs) for law in laws),
        key=lambda fit: float(np.abs(fit.log_error).mean()),
    )
    best = fits[0]
    left_out = [
        _prediction(best, run, best.without[at], at) for at, run in enumerate(runs)
    ]
    tested = [_prediction(best, test, best.parameters[test.terrain]) for test in tests]
    return LogCalibration(
        model=model,
        runs=(*left_out, *tested),
        fits=tuple(fits),
        terrains=terrain_estimates(model, best, runs, stationary),
        stationary_W=stationary,
    )


def _prediction(
    fit: LawFit, run: LoggedRun, parameters: np.ndarray, number: int | None = None
) -> RunPrediction:
    """Return a run as a fit predicts it.

    Args:
        fit: of the best law.
        run: to be predicted.
        parameters: of the law, found without the run.
        number: of the run in the fit; None for a test run.
    """
    predicted_J = Pieces.of(run, fit.law).predicted_J(fit.law.coefficients(parameters))
    low, high = fit.spread(run.terrain, without=number).factors()
    return RunPrediction(
        run=run,
        fitted=number is not None,
        predicted_J=predicted_J,
        interval_J=(low * predicted_J, high * predicted_J),
    )
