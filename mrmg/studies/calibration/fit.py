"""Linear least squares with confidence intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from mrmg.counted import counted

CONFIDENCE = 0.95
"""Probability that an interval holds the true value, if the residuals are noise."""


def t_quantile(freedom: float, share: float = CONFIDENCE) -> float:
    """Return the number that Student's t stays below in size with a probability."""
    return float(stdtrit(freedom, 0.5 + 0.5 * share))


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearFit:
    """The x that brings A x closest to b.

    Attributes:
        value: x, shape (p,).
        half_width: of the intervals about x: the quantile of Student's t with n - p
            degrees of freedom times the standard error, shape (p,).
        fitted: A x, shape (n,).
        residual: b - A x, shape (n,).
    """

    value: np.ndarray
    half_width: np.ndarray
    fitted: np.ndarray
    residual: np.ndarray

    @property
    def residual_rms(self) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(np.mean(self.residual**2)))


def fit_linear(matrix: np.ndarray, measured: np.ndarray) -> LinearFit:
    """Fit A x = b.

    Args:
        matrix: A, of full column rank, shape (n, p) with n > p.
        measured: b, shape (n,).

    Raises:
        ValueError: if the columns of A do not separate the parameters.
    """
    rows, parameters = matrix.shape
    # Columns of like size, so that the rank is not a matter of units.
    length = np.linalg.norm(matrix, axis=0)
    scale = np.where(length > 0.0, length, 1.0)
    if rows <= parameters or np.linalg.matrix_rank(matrix / scale) < parameters:
        raise ValueError(
            f"{counted(rows, 'measurement')} cannot tell {parameters} values apart"
        )
    value = np.linalg.lstsq(matrix / scale, measured, rcond=None)[0] / scale
    fitted = matrix @ value
    residual = measured - fitted
    freedom = rows - parameters
    normal = (matrix / scale).T @ (matrix / scale)
    variance = residual @ residual / freedom * np.diag(np.linalg.inv(normal))
    return LinearFit(
        value=value,
        half_width=t_quantile(freedom) * np.sqrt(variance) / scale,
        fitted=fitted,
        residual=residual,
    )
