"""Contour lines of a scene's elevation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from mrmg.scene.types import Scene
from mrmg.viz import style

_WIDTH_POINTS = 0.7
_MOST_LEVELS = 12


def contour_lines(scene: Scene) -> Iterator[tuple[float, np.ndarray]]:
    """Yield (height [m], points [m] of shape (n, 2)) of lines of round heights."""
    from contourpy import contour_generator

    elevation = scene.elevation
    if elevation is None:
        return
    lines = contour_generator(*elevation.nodes_m, elevation.height_m)
    for level in levels_m(
        float(elevation.height_m.min()), float(elevation.height_m.max())
    ):
        # A hair above: flat ground at a round height has no line of its own.
        for line in lines.lines(level + 1e-3):
            yield level, np.asarray(line)


def levels_m(low: float, high: float) -> np.ndarray:
    """Return round heights between two, 1, 2 or 5 times a power of ten apart [m]."""
    if high - low < 1e-6:
        return np.zeros(0)
    ticks = MaxNLocator(_MOST_LEVELS, steps=(1, 2, 5, 10)).tick_values(low, high)
    levels = np.round(ticks, 6)
    return np.asarray(levels[(levels > low) & (levels < high)])


def draw_contours(axes: Axes, scene: Scene) -> None:
    """Draw the lines on axes in metres."""
    for _, line in contour_lines(scene):
        axes.plot(*line.T, color=style.CONTOUR, linewidth=_WIDTH_POINTS, zorder=2)
