"""Contour lines of a scene's relief."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from mrmg.results import style
from mrmg.scene.types import Scene

_WIDTH_POINTS = 0.7
_HALO = [withStroke(linewidth=2.0, foreground="white")]

_MOST_LEVELS = 12
_LEAST_LABELLED_M = 6.0


def contour_lines(scene: Scene) -> Iterator[tuple[float, np.ndarray]]:
    """Yield (height [m], points [m] of shape (n, 2)) of lines of round heights."""
    from contourpy import contour_generator

    elevation = scene.elevation
    if elevation is None:
        return
    x_min, y_min, x_max, y_max = scene.bounds
    rows, columns = elevation.height_m.shape
    lines = contour_generator(
        np.linspace(x_min, x_max, columns),
        np.linspace(y_min, y_max, rows),
        elevation.height_m,
    )
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
    least = (high - low) / _MOST_LEVELS
    power = 10.0 ** np.floor(np.log10(least))
    step = next(power * n for n in (1, 2, 5, 10) if power * n >= least)
    first, last = np.floor(low / step) + 1.0, np.ceil(high / step) - 1.0
    return np.asarray(np.round(np.arange(first, last + 0.5) * step, 6))


def label_spot(line: np.ndarray) -> tuple[float, float] | None:
    """Return where a line has room for its height: half way; None if it is short."""
    way_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    if way_m[-1] < _LEAST_LABELLED_M:
        return None
    middle = int(np.searchsorted(way_m, 0.5 * way_m[-1]))
    return float(line[middle, 0]), float(line[middle, 1])


def draw_contours(axes: Axes, scene: Scene, label_points: float | None) -> None:
    """Draw the lines on axes in metres, with their heights.

    Args:
        axes: where to draw.
        scene: what to draw.
        label_points: size of names on the map, of which heights have three quarters;
            None for none.
    """
    for level_m, line in contour_lines(scene):
        axes.plot(*line.T, color=style.CONTOUR, linewidth=_WIDTH_POINTS, zorder=2)
        spot = label_spot(line)
        if spot is not None and label_points is not None:
            axes.text(
                *spot,
                f"{level_m:g} m",
                fontsize=0.75 * label_points,
                color=style.CONTOUR,
                ha="center",
                va="center",
                path_effects=_HALO,
                zorder=2.5,
            )
