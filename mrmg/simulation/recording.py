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
