"""Robust fits of power laws to logged runs, and how well they predict other runs.

A run is cut into pieces of about two seconds, whose mean power the law is to give. The
pieces' errors, relative to the run's mean power, count as in a Huber-like loss
(`soft_l1`), and every run counts alike, however long it is: runs differ more from each
other than pieces of one run do, so that long runs must not outvote short ones.

How far another run will be off is estimated by leaving out each run in turn: the
logarithms of measured over predicted energy. Their root mean square on a terrain,
pooled with that of the other terrains as if it came from `PRIOR_RUNS` more runs, is the
spread, and Student's t gives the interval.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from mrmg.studies.calibration.fit import t_quantile
from mrmg.studies.calibration.power_laws import PowerLaw
from mrmg.studies.calibration.robot_logs import LoggedRun

PIECE_S = 2.0
"""Length of a piece: longer than a speed controller takes to settle."""

OUTLIER_SHARE = 0.15
"""Relative error from which pieces count less than by its square."""

PRIOR_RUNS = 2.0
"""How many runs of a terrain the spread of the other terrains weighs as much as."""

HOLD = 0.01
"""Weight of the starting values: holds what the runs do not determine."""

PREDICTED_SHARE = 0.9
"""Probability that a run's energy lies in its interval."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """The pieces of a run under a law.

    Attributes:
        features: mean features of each piece, shape (p, k).
        power_W: mean power of each piece, shape (p,).
        duration_s: of each piece, shape (p,).
        speed_m_s: mean speed of each piece, shape (p,).
        yaw_rate_rad_s: mean yaw rate of each piece, shape (p,).
    """

    features: np.ndarray
    power_W: np.ndarray
    duration_s: np.ndarray
    speed_m_s: np.ndarray
    yaw_rate_rad_s: np.ndarray

    @staticmethod
    def of(run: LoggedRun, law: PowerLaw) -> Pieces:
        """Cut a run into pieces."""
        weight_s = run.weight_s
        count = max(1, round(float(weight_s.sum()) / PIECE_S))
        count = min(count, len(weight_s))
        ends_s = np.linspace(0.0, weight_s.sum(), count + 1)[1:-1]
        starts = np.append(0, np.searchsorted(np.cumsum(weight_s), ends_s) + 1)
        starts = np.unique(np.minimum(starts, len(weight_s) - 1))
        duration_s = np.add.reduceat(weight_s, starts)
        motion = (run.speed_m_s, run.yaw_rate_rad_s)
        rows = np.column_stack([law.features(*motion), run.power_W, *motion])
        means = np.add.reduceat(rows * weight_s[:, None], starts) / duration_s[:, None]
        power_W, speed_m_s, yaw_rate_rad_s = means[:, -3:].T
        return Pieces(means[:, :-3], power_W, duration_s, speed_m_s, yaw_rate_rad_s)

    @property
    def energy_J(self) -> float:
        """What the run took."""
        return float(self.power_W @ self.duration_s)

    @property
    def mean_power_W(self) -> float:
        """Mean power of the run."""
        return self.energy_J / float(self.duration_s.sum())

    def predicted_J(self, coefficients: np.ndarray) -> float:
        """Return the energy by the law."""
        return float(self.features @ coefficients @ self.duration_s)

    def log_error(self, coefficients: np.ndarray) -> float:
        """Return the logarithm of measured over predicted energy."""
        predicted_J = max(self.predicted_J(coefficients), 1e-3 * self.energy_J)
        return float(np.log(self.energy_J / predicted_J))


@dataclass(frozen=True, slots=True)
class Spread:
    """How far runs of a terrain are off their prediction.

    Attributes:
        deviation: standard deviation of the logarithm of measured over predicted
            energy.
        freedom: its degrees of freedom.
    """

    deviation: float
    freedom: float

    def factors(self) -> tuple[float, float]:
        """Return the ends of the interval of a run's energy, over the prediction."""
        reach = t_quantile(self.freedom, PREDICTED_SHARE) * self.deviation
        return float(np.exp(-reach)), float(np.exp(reach))


@dataclass(frozen=True, slots=True)
class LawFit:
    """A law fitted to runs of a few terrains, and to all of them but one each time.

    Attributes:
        law: what was fitted.
        terrain: of each run.
        parameters: of each terrain, shape (p,).
        without: parameters of the run's terrain fitted without the run, by run, shape
            (n, p).
        log_error: logarithm of measured over predicted energy of each run by the fit
            without it, shape (n,).
    """

    law: PowerLaw
    terrain: tuple[str, ...]
    parameters: Mapping[str, np.ndarray]
    without: np.ndarray
    log_error: np.ndarray

    def spread(self, name: str, *, without: int | None = None) -> Spread:
        """Return how far runs of a terrain are off.

        Args:
            name: of the terrain.
            without: number of a run whose error does not count.
        """
        squares = {
            each: self.log_error[[at for at in self.rows(each) if at != without]] ** 2
            for each in self.parameters
        }
        means = [float(own.mean()) for own in squares.values() if len(own)]
        pooled = float(np.mean(means)) if means else 0.0
        own = squares[name]
        total = float(own.sum()) + PRIOR_RUNS * pooled
        return Spread(
            deviation=float(np.sqrt(total / (len(own) + PRIOR_RUNS))),
            freedom=max(len(own) + PRIOR_RUNS - 1.0, 1.0),
        )

    def rows(self, name: str) -> list[int]:
        """Return the numbers of the runs on a terrain."""
        return [at for at, own in enumerate(self.terrain) if own == name]

    def quality(self) -> dict[str, Any]:
        """Return how well runs are predicted that were left out, as JSON data."""
        ratio = np.exp(self.log_error)
        error_pct = 100.0 * np.abs(np.exp(-self.log_error) - 1.0)
        ends = [
            self.spread(name, without=at).factors()
            for at, name in enumerate(self.terrain)
        ]
        low, high = np.array(ends).T
        holds, width_pct = (low <= ratio) & (ratio <= high), 100.0 * (high - low)

        def of(rows: Sequence[int]) -> dict[str, float]:
            return {
                "median_error_pct": float(np.median(error_pct[rows])),
                "intervals_hold_pct": 100.0 * float(np.mean(holds[rows])),
                "interval_width_pct": float(np.median(width_pct[rows])),
            }

        return {
            "mean_log_error": float(np.abs(self.log_error).mean()),
            "worst_error_pct": float(error_pct.max()),
            **of(range(len(self.terrain))),
            "terrains": {
                name: {"runs": len(self.rows(name)), **of(self.rows(name))}
                for name in self.parameters
            },
        }


def fit_law(law: PowerLaw, runs: Sequence[LoggedRun]) -> LawFit:
    """Fit a law to runs, terrain by terrain, and without each run in turn.

    A terrain of one run is predicted without it by the runs of all other terrains.

    Args:
        law: what to fit.
        runs: at least two.
    """
    pieces = [Pieces.of(run, law) for run in runs]
    terrain = tuple(run.terrain for run in runs)
    scale = _scale(law, runs)
    whole = fit_pieces(law, pieces, scale, scale)
    groups = {
        name: [item for item, own in zip(pieces, terrain, strict=True) if own == name]
        for name in dict.fromkeys(terrain)
    }
    parameters = {
        name: fit_pieces(law, own, scale, whole) for name, own in groups.items()
    }
    without = []
    for left_out, name in zip(pieces, terrain, strict=True):
        others = [item for item in groups[name] if item is not left_out]
        if others:
            without.append(fit_pieces(law, others, scale, whole))
        else:
            rest = [item for item in pieces if item is not left_out]
            without.append(fit_pieces(law, rest, scale, scale))
    log_error = [
        item.log_error(law.coefficients(found))
        for item, found in zip(pieces, without, strict=True)
    ]
    return LawFit(law, terrain, parameters, np.array(without), np.array(log_error))


def fit_pieces(
    law: PowerLaw, runs: Sequence[Pieces], scale: np.ndarray, hold: np.ndarray
) -> np.ndarray:
    """Return the parameters >= 0 that give the pieces' powers best.

    Args:
        law: what to fit.
        runs: to these.
        scale: size of the parameters, shape (p,).
        hold: what they are where the runs do not determine them, shape (p,).

    Returns:
        Parameters of shape (p,).
    """
    features = np.concatenate([item.features / item.mean_power_W for item in runs])
    power = np.concatenate([item.power_W / item.mean_power_W for item in runs])
    share = np.concatenate([item.duration_s / item.duration_s.sum() for item in runs])
    weight = np.sqrt(share)
    held = hold / scale

    def errors(found: np.ndarray) -> np.ndarray:
        off = (power - features @ law.coefficients(found * scale)) / OUTLIER_SHARE
        soft = np.sign(off) * np.sqrt(2.0 * (np.sqrt(1.0 + off**2) - 1.0))
        return np.append(weight * soft, HOLD * (found - held))

    bounds = (np.zeros(len(scale)), np.full(len(scale), np.inf))
    starts = (np.ones(len(scale)), np.maximum(held, 0.05))
    fits = [least_squares(errors, start, bounds=bounds) for start in starts]
    best = min(fits, key=lambda fit: float(fit.cost))
    return np.asarray(best.x * scale)


def _scale(law: PowerLaw, runs: Sequence[LoggedRun]) -> np.ndarray:
    duration_s = sum(float(run.weight_s.sum()) for run in runs)
    power_W = sum(run.energy_J for run in runs) / duration_s
    way_m = sum(float(np.abs(run.speed_m_s) @ run.weight_s) for run in runs)
    return law.start(power_W, way_m / duration_s)
