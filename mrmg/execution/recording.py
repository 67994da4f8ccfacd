"""Collecting what a run does, tick by tick."""

from __future__ import annotations

from collections import defaultdict

import numpy as np


class Recording:
    """Rows of named quantities, one row a tick."""

    def __init__(self) -> None:
        """Start without rows."""
        self._rows: defaultdict[str, list[np.ndarray]] = defaultdict(list)

    def add(self, **values: np.ndarray | float) -> None:
        """Append one row; arrays are copied."""
        for name, value in values.items():
            self._rows[name].append(np.array(value))

    def in_time(self, name: str) -> np.ndarray:
        """Return all rows of a quantity, shape (n, ...)."""
        return np.array(self._rows[name])

    def by_robot(self, name: str, robots: int) -> np.ndarray:
        """Return all rows of a quantity that has one value a robot, shape (R, n, ...).

        Args:
            name: the quantity.
            robots: R, which decides the shape where there is no row.
        """
        rows = self._rows[name]
        if not rows:
            return np.empty((robots, 0))
        return np.ascontiguousarray(np.swapaxes(np.array(rows), 0, 1))


def held_force_work_J(
    force_N: np.ndarray,
    rolled_m: np.ndarray,
    speed_gain_m_s: np.ndarray,
    physics_step_s: float,
) -> np.ndarray:
    """Return the work of forces held over several physics steps, shape (..., 2).

    The integrator moves the wheels at the speed of each step's end; taken at the mean
    of both ends, as kinetic energy is, the way is shorter by dt / 2 times the gain of
    speed.

    Args:
        force_N: the forces, of any shape.
        rolled_m: way rolled under each.
        speed_gain_m_s: speed at the end less speed at the start.
        physics_step_s: dt of the integrator.

    Returns:
        Driving work (>= 0) and braking work (<= 0) [J].
    """
    work = force_N * (rolled_m - 0.5 * physics_step_s * speed_gain_m_s)
    parts = np.zeros((*work.shape, 2))
    np.maximum(work, 0.0, out=parts[..., 0])
    np.minimum(work, 0.0, out=parts[..., 1])
    return parts
