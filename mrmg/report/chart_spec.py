"""Charts as JSON: what the script of a page needs to draw one."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

_MOST_SAMPLES = 1200
_FINEST_S = 0.1


def grid(end_s: float) -> np.ndarray:
    """Return the times of a page's charts from 0 to an end [s], at least two."""
    end_s = max(end_s, _FINEST_S)
    samples = min(math.ceil(end_s / _FINEST_S) + 1, _MOST_SAMPLES)
    return np.linspace(0.0, end_s, samples)


def chart(
    name: str,
    title: str,
    unit: str,
    lines: Iterable[dict[str, Any]],
    *,
    group: str = "",
    digits: int = 2,
    limits: tuple[float, float] | None = None,
    along_s: np.ndarray | None = None,
) -> dict[str, Any]:
    """Return a chart over the page's grid of times, or over times of its own.

    Args:
        name: the page has a place of that name.
        title: heading above the chart.
        unit: of the values.
        lines: from `line`.
        group: section of the page it belongs to.
        digits: of values in the legend.
        limits: that the vertical axis shows at least; None fits it, from zero.
        along_s: times of its own, which are not the mission's; values hold until the
            next.
    """
    return {
        "id": name,
        "group": group,
        "title": title,
        "unit": unit,
        "digits": digits,
        "series": list(lines),
        "range": limits,
        "along_s": None if along_s is None else rounded(along_s, 3),
    }


def line(
    label: str,
    look: str,
    owner: tuple[int, str],
    values: np.ndarray,
    *,
    digits: int = 3,
) -> dict[str, Any]:
    """Return one line of a chart.

    Args:
        label: name in the legend.
        look: "planned", "simulated", "limit", "course" of what is no robot's, or "own"
            for the owner's dash pattern.
        owner: number of its colour, and what a toggle calls it.
        values: at the chart's times, NaN where there is none.
        digits: kept after the decimal point.
    """
    return {
        "label": label,
        "look": look,
        "color": owner[0],
        "owner": owner[1],
        "values": rounded(values, digits),
    }


def rounded(values: np.ndarray, digits: int) -> list[float | None]:
    """Return numbers for JSON; NaN becomes None."""
    return [
        None if math.isnan(value) else value
        for value in np.round(values, digits).tolist()
    ]
