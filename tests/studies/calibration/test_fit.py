"""Least squares and its intervals, against closed forms and by repetition."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from mrmg.studies.calibration.fit import fit_linear


def test_a_line_has_the_textbooks_slope_and_interval() -> None:
    rng = np.random.default_rng(0)
    x = np.linspace(0.0, 5.0, 12)
    y = 2.0 + 0.7 * x + rng.normal(0.0, 0.1, len(x))
    fit = fit_linear(np.stack([np.ones_like(x), x], axis=1), y)
    line = stats.linregress(x, y)
    quantile = stats.t.ppf(0.975, len(x) - 2)
    np.testing.assert_allclose(fit.value, [line.intercept, line.slope])
    np.testing.assert_allclose(
        fit.half_width, quantile * np.array([line.intercept_stderr, line.stderr])
    )
    np.testing.assert_allclose(fit.fitted + fit.residual, y)
    assert fit.residual_rms == pytest.approx(np.sqrt(np.mean(fit.residual**2)))


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """In 2000 experiments; a share of 0.95 has a standard error of 0.005."""
    rng = np.random.default_rng(1)
    matrix = rng.normal(size=(8, 3)) * [1.0, 1e3, 1e-3]
    truth = np.array([3.0, -2e-3, 4e3])
    held = np.zeros(3)
    for _ in range(2000):
        fit = fit_linear(matrix, matrix @ truth + rng.normal(size=8))
        held += np.abs(fit.value - truth) <= fit.half_width
    np.testing.assert_allclose(held / 2000, 0.95, atol=0.02)


def test_units_do_not_matter() -> None:
    rng = np.random.default_rng(2)
    matrix, measured = rng.normal(size=(9, 2)), rng.normal(size=9)
    plain, scaled = fit_linear(matrix, measured), fit_linear(matrix * 1e9, measured)
    np.testing.assert_allclose(scaled.value * 1e9, plain.value)
    np.testing.assert_allclose(scaled.half_width * 1e9, plain.half_width)


@pytest.mark.parametrize(
    "matrix",
    [
        np.ones((2, 2)),  # as many unknowns as measurements
        np.stack([np.arange(5.0), 2 * np.arange(5.0)], axis=1),  # collinear
        np.stack([np.arange(5.0), np.zeros(5)], axis=1),  # never excited
    ],
)
def test_what_cannot_be_told_apart_is_refused(matrix: np.ndarray) -> None:
    with pytest.raises(ValueError, match="cannot tell 2 values apart"):
        fit_linear(matrix, np.ones(len(matrix)))
