"""The page of a comparison: table, courses over one another, maps side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrmg import storage
from mrmg.energy.battery_curves import BatteryCurve, shown_curves
from mrmg.report import chart_spec
from mrmg.report.compare import Comparison
from mrmg.report.map import mission_map
from mrmg.report.page import page, rendered
from mrmg.runs.record import RunRecord
from mrmg.viz import style

_SAMPLES = 800
_SHORTEST_S = 0.1


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
    # Courses have a colour for each run; maps have one for each robot.
    colored = range(max(len(names), *(len(item.scene.robots) for item in records)))
    numbers = [str(at) for at in colored]
    light, dark = style.robot_colors(numbers), style.robot_colors_on_dark(numbers)
    solved = [number for number, item in enumerate(records) if item.plan is not None]
    charts = _charts(comparison, solved) if solved else None
    body = rendered(
        "compare.html.jinja",
        comparison=comparison,
        owners={number: _owner(number) for number in solved},
        charts=[(item["id"], item["title"]) for item in charts["charts"]]
        if charts
        else [],
        maps=[
            (name, mission_map(record.scene, record.plan, record.log))
            for name, record in zip(names, records, strict=True)
        ],
    )
    colors = [(light[at], dark[at]) for at in numbers]
    return page("Comparison of runs", body, colors=colors, data=charts)


def _owner(number: int) -> str:
    # A name of its own kind: runs may be called like robots, which maps have, too.
    return f"run {number}"


def _charts(comparison: Comparison, solved: Sequence[int]) -> dict[str, Any]:
    curves = {
        number: shown_curves(record.scene, record.plan, record.log)
        for number, record in enumerate(comparison.records)
        if record.plan is not None
    }
    ends_s = [float(curve.time_s[-1]) for run in curves.values() for curve in run]
    end_s = max(_SHORTEST_S, *ends_s)
    time_s = np.linspace(0.0, end_s, _SAMPLES)

    def drawn(
        name: str, title: str, unit: str, of: Callable[[int], Any], digits: int = 1
    ) -> Any:
        lines = [
            chart_spec.line(comparison.names[at], "own", (at, _owner(at)), of(at))
            for at in solved
        ]
        return chart_spec.chart(name, title, unit, lines, digits=digits)

    def lowest(at: int) -> np.ndarray:
        return _lowest_percent(comparison.records[at], curves[at], time_s)

    def used(at: int) -> np.ndarray:
        return _used_kJ(curves[at], time_s)

    def goals(at: int) -> np.ndarray:
        return _goals_visited(curves[at], time_s)

    return {
        "time_s": chart_spec.rounded(time_s, 3),
        "charts": [
            drawn("used", "Energy drawn by the fleet", "kJ", used),
            drawn("goals", "Goals visited", "", goals, digits=0),
            drawn("lowest", "Lowest charge in the fleet", "%", lowest),
        ],
    }


def _used_kJ(curves: Sequence[BatteryCurve], time_s: np.ndarray) -> np.ndarray:
    """Return the energy drawn since the start; recharges add nothing."""
    used = np.zeros(len(time_s))
    for curve in curves:
        drop_J = -np.diff(curve.energy_J)
        for visit in curve.visits:
            if visit.kind == "station" and visit.step > 0:
                drop_J[visit.step - 1] = curve.energy_J[visit.step - 1] - visit.energy_J
        drawn_J = np.concatenate([[0.0], np.cumsum(drop_J)])
        used += np.interp(time_s, curve.time_s, drawn_J)
    return _until_end(used / 1000.0, curves, time_s)


def _goals_visited(curves: Sequence[BatteryCurve], time_s: np.ndarray) -> np.ndarray:
    visits = [visit for curve in curves for visit in curve.visits]
    at_s = np.sort([visit.time_s for visit in visits if visit.kind == "goal"])
    count = np.searchsorted(at_s, time_s, side="right")
    return _until_end(count.astype(float), curves, time_s)


def _lowest_percent(
    record: RunRecord, curves: Sequence[BatteryCurve], time_s: np.ndarray
) -> np.ndarray:
    shares = [
        np.interp(time_s, curve.time_s, curve.energy_J)
        / record.scene.robot(curve.robot).battery.capacity_J
        for curve in curves
    ]
    return _until_end(100.0 * np.min(shares, axis=0), curves, time_s)


def _until_end(
    values: np.ndarray, curves: Sequence[BatteryCurve], time_s: np.ndarray
) -> np.ndarray:
    end_s = max(float(curve.time_s[-1]) for curve in curves)
    return np.where(time_s > end_s, np.nan, values)
