"""How the time of planning grows with a mission, drawn for papers."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter
from print_style import PAGE_IN, print_figure

from mrmg.viz import style

_HEIGHT_IN = 2.3
_MARKED = (1.0, 2.0, 5.0)
"""Times with a number, in every decade."""
_INK, _FACE = "#003B5C", "#56B4E9"


@dataclass(frozen=True, slots=True)
class GrowthPoint:
    """One planned mission of a series.

    Attributes:
        size: of what grows.
        first_s: time to the first verified plan; None without one.
    """

    size: int
    first_s: float | None


def exponent(points: Sequence[GrowthPoint]) -> float:
    """Return the power of the size that median times grow with; NaN if unknown.

    It is the slope of the least-squares line through their logarithms.
    """
    medians = _medians(points)
    if len(medians) < 2:
        return float("nan")
    size, first_s = np.log(np.array(medians)).T
    return float(np.polyfit(size, first_s, 1)[0])


def _medians(points: Sequence[GrowthPoint]) -> list[tuple[int, float]]:
    """Return the sizes that have plans, and the median times to these."""
    found: dict[int, list[float]] = {}
    for point in sorted(points, key=lambda point: point.size):
        if point.first_s is not None:
            found.setdefault(point.size, []).append(point.first_s)
    return [(size, statistics.median(times_s)) for size, times_s in found.items()]


def draw_growth(series: Mapping[str, Sequence[GrowthPoint]], path: Path) -> None:
    """Draw the time to the first verified plan against what grows, a panel for each.

    Dots are missions, the line joins medians; missions without a plan are counted
    above. Both axes are logarithmic.

    Args:
        series: missions by the name of what grows in them, at least one.
        path: file to write (PDF, SVG or PNG by its suffix).
    """
    with print_figure((PAGE_IN, _HEIGHT_IN), path) as figure:
        all_axes = np.ravel(figure.subplots(1, len(series), sharey=True))
        for axes, (name, points) in zip(all_axes, series.items(), strict=True):
            _draw_panel(axes, points)
            power = exponent(points)
            axes.set_xlabel(name if np.isnan(power) else f"{name}, power {power:.2f}")
        all_axes[0].set_ylabel("time to the first plan [s]")


def _draw_panel(axes: Axes, points: Sequence[GrowthPoint]) -> None:
    by_size: dict[int, list[GrowthPoint]] = {}
    for point in sorted(points, key=lambda point: point.size):
        by_size.setdefault(point.size, []).append(point)
    for size, own in by_size.items():
        times_s = [point.first_s for point in own if point.first_s is not None]
        axes.plot([size] * len(times_s), times_s, "o", color=_FACE, ms=3, alpha=0.7)
        failed = len(own) - len(times_s)
        if failed:
            axes.annotate(
                f"{failed}/{len(own)}\nfailed",
                (size, 1.02),
                xycoords=("data", "axes fraction"),
                ha="center",
                va="bottom",
                fontsize=5.5,
                color=style.RESERVE,
            )
    if medians := _medians(points):
        axes.plot(*zip(*medians, strict=True), color=_INK, linewidth=1.2)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=_MARKED))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xticks(list(by_size), [str(size) for size in by_size])
    axes.set_xticks([], minor=True)
    axes.grid(axis="y", color="#E4E6EA", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
