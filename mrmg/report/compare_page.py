"""The page of a comparison: table, courses over one another, maps side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrmg import storage
from mrmg.energy.battery_curves import BatteryCurve, shown_curves
from mrmg.report import chart_spec
from mrmg.report.compare import Comparison
from mrmg.report.map import mission_map
from mrmg.report.page import page, rendered

_CHARTS = (
    ("used", "Energy drawn by the fleet", "kJ", 1),
    ("goals", "Goals visited", "", 0),
    ("lowest", "Lowest charge in the fleet", "%", 1),
)
"""Name, title, unit and digits of each chart."""


def write_comparison(comparison: Comparison, path: Path) -> None:
    """Write the comparison as a page that stands alone.

    Args:
        comparison: what to show.
        path: HTML file to write.
    """
    storage.write_text(path, comparison_html(comparison))


def comparison_html(comparison: Comparison) -> str:
    """Return the comparison as HTML."""
    names, records = comparison.names, comparison.records
    curves = {
        number: shown_curves(item.scene, item.plan, item.log)
        for number, item in enumerate(records)
        if item.plan is not None
    }
    data = _charts(comparison, curves) if curves else None
    body = rendered(
        "compare.html.jinja",
        comparison=comparison,
        owners={number: _owner(number) for number in curves},
        charts=data["charts"] if data else (),
        maps=[
            (name, mission_map(record.scene, record.plan, record.log))
            for name, record in zip(names, records, strict=True)
        ],
    )
    # Courses have a colour for each run; maps have one for each robot.
    colored = max(len(names), *(len(item.scene.robots) for item in records))
    return page("Comparison of runs", body, colors=colored, data=data)


def _owner(number: int) -> str:
    # A name of its own kind: runs may be called like robots, which maps have, too.
    return f"run {number}"


def _charts(
    comparison: Comparison, curves: Mapping[int, Sequence[BatteryCurve]]
) -> dict[str, Any]:
    """Return the charts of all runs that have curves, by their number."""
    ends_s = [float(curve.time_s[-1]) for run in curves.values() for curve in run]
    time_s = chart_spec.grid(max(ends_s))
    courses = {number: _courses(run, time_s) for number, run in curves.items()}
    charts = []
    for name, title, unit, digits in _CHARTS:
        lines = [
            chart_spec.line(
                comparison.names[number], "own", (number, _owner(number)), own[name]
            )
            for number, own in courses.items()
        ]
        charts.append(chart_spec.chart(name, title, unit, lines, digits=digits))
    return {"time_s": chart_spec.rounded(time_s, 3), "charts": charts}


def _courses(
    curves: Sequence[BatteryCurve], time_s: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the values of a run in each chart by its name, NaN after the run."""
    courses = {
        "used": sum(np.interp(time_s, own.time_s, own.used_J) for own in curves) / 1e3,
        "goals": _goals_visited(curves, time_s),
        "lowest": _lowest_percent(curves, time_s),
    }
    over = time_s > max(float(curve.time_s[-1]) for curve in curves)
    return {name: np.where(over, np.nan, own) for name, own in courses.items()}


def _goals_visited(curves: Sequence[BatteryCurve], time_s: np.ndarray) -> np.ndarray:
    visits = [visit for curve in curves for visit in curve.visits]
    at_s = np.sort([visit.time_s for visit in visits if visit.kind == "goal"])
    return np.searchsorted(at_s, time_s, side="right").astype(float)


def _lowest_percent(curves: Sequence[BatteryCurve], time_s: np.ndarray) -> np.ndarray:
    shares = [
        np.interp(time_s, curve.time_s, curve.energy_J / curve.battery.capacity_J)
        for curve in curves
    ]
    return np.asarray(100.0 * np.min(shares, axis=0))
