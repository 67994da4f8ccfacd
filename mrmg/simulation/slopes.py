"""How the ground slopes under the robots, along the way they head."""

from __future__ import annotations

import math

import numpy as np

from mrmg.scene.types import Scene


class SlopesUnderfoot:
    """Slopes along the headings of a fleet, below the centres of mass."""

    def __init__(self, scene: Scene) -> None:
        """Look at the elevation of `scene`."""
        self._relief = scene.elevation
        self._lead_m = [robot.model.center_of_mass_m for robot in scene.robots]
        self._flat = np.ones(len(scene.robots)), np.zeros(len(scene.robots))

    def under(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return cosine and sine of the slope along each heading, each (R,).

        The sine is positive uphill.

        Args:
            state: of the robots, shape (R, 5).
        """
        if self._relief is None:
            return self._flat
        level, slope = [], []
        for (x, y, heading, _, _), lead_m in zip(
            state.tolist(), self._lead_m, strict=True
        ):
            cos, sin = math.cos(heading), math.sin(heading)
            slope_x, slope_y = self._relief.slope_at(x + lead_m * cos, y + lead_m * sin)
            rise = slope_x * cos + slope_y * sin
            level.append(1.0 / math.hypot(1.0, rise))
            slope.append(rise * level[-1])
        return np.array(level), np.array(slope)
