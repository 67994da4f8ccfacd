"""What the report states of the planner: its statistics, cost and bound over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from mrmg.report import chart_spec
from mrmg.report.page import rendered
from mrmg.runs.record import RunRecord

COST = "cost"
"""Group and name of the chart of cost and bound."""

_NAMES = {
    "time_s.init": "Roadmap built after",
    "time_s.routing": "Time of the discrete solver",
    "time_s.first_solution": "First plan after",
    "time_s.total": "Time of planning in all",
    "router_calls": "Calls of the discrete solver",
    "trees": "Motion trees",
    "coordinated": "Searches for motions of the fleet",
    "path_following_plans": "Times the fleet followed paths along its tours",
    "expansions": "Expansions of motion trees",
    "iterations": "Iterations of the guided tree",
    "iteration_cap": "Most iterations it may make",
    "vertices": "Vertices of motion trees",
    "groups": "Groups of vertices",
    "dead_ends": "Expansions that led nowhere",
}
_TOLD_IN_WORDS = ("bound", "bound_J", "bound_s", "gap")
_SHOWN = {"J": ("kJ", 1e-3), "s": ("s", 1.0), "1": ("", 1.0)}
"""Unit and factor in which the chart shows each unit of an objective."""

_TITLES = {
    "energy": "Energy",
    "makespan": "Makespan",
    "blend": "Weighted sum of energy and makespan",
}
_ROOM = (0.9, 1.05)
"""Room below and above the courses, as factors."""


def planner(record: RunRecord) -> Markup:
    """Return what the planner did, and how good its plan is known to be."""
    statistics = record.planning["statistics"]
    times = statistics.get("time_s", {})
    rows = [
        [_NAMES.get(place, place), _said(place, value, times)]
        for place, value in _flat(statistics)
        if place not in _TOLD_IN_WORDS
        and (record.plan is not None or place != "time_s.first_solution")
    ]
    chart, figures = cost_chart(record), record.summary["plan"]
    return rendered(
        "planner.html.jinja",
        figures=figures,
        hints=record.planning.get("hints", []),
        charts=[chart] if chart else [],
        rows=rows,
        found=found_plans(record),
    )


def found_plans(record: RunRecord) -> Sequence[Mapping[str, Any]]:
    """Return the plans found over time, each of lower cost than the one before."""
    return list(record.planning["statistics"].get("improvements", []))


def cost_chart(record: RunRecord) -> dict[str, Any] | None:
    """Return the chart of cost and bound over the time of planning.

    None where the planner left no course of its costs.
    """
    found = found_plans(record)
    if record.plan is None or not found:
        return None
    total_s = record.planning["statistics"]["time_s"]["total"]
    found_s = [float(item["time_s"]) for item in found]
    time_s = np.array([0.0, *found_s, max(total_s, found_s[-1])])
    wanted = record.summary["plan"]["objective"]
    unit, size = _SHOWN[wanted["unit"]]
    values = [size * item["objective"]["value"] for item in found]
    bounds = [_scaled(item["objective"]["bound"], size) for item in found]
    last = _scaled(wanted["bound"], size)
    value = np.array([np.nan, *values, values[-1]])
    bound = np.array([np.nan, *bounds, last])
    if np.isnan(bound[:-1]).all():
        bound[:] = last  # when it became known was not kept
    bound = np.fmax.accumulate(bound)
    lines = [chart_spec.line("cost of the plan", "course", (0, COST), value)]
    if not np.isnan(bound).all():
        lines.append(chart_spec.line("proven bound", "limit", (0, COST), bound))
    shown = np.concatenate([value, bound])
    return chart_spec.chart(
        COST,
        f"{_TITLES[wanted['name']]} of the best plan over the time of planning",
        unit,
        lines,
        group=COST,
        limits=(_ROOM[0] * np.nanmin(shown), _ROOM[1] * np.nanmax(shown)),
        along_s=time_s,
    )


def _scaled(value: float | None, size: float) -> float:
    return np.nan if value is None else size * value


def _said(place: str, value: float | str, times: Mapping[str, float]) -> str:
    """Return a statistic as text; times with their unit and share."""
    if isinstance(value, str):
        return value
    if not place.startswith("time_s."):
        return f"{value:.4g}" if isinstance(value, float) else str(value)
    text = f"{value:.3f} s"
    total_s = times.get("total", 0.0)
    if place == "time_s.routing" and total_s > 0.0:
        text += f" ({100.0 * value / total_s:.0f} % of all)"
    return text


def _flat(statistics: Mapping[str, Any]) -> list[tuple[str, float | str]]:
    """Return figures as (place, value), times first; what is no figure is left out."""
    spent_s = statistics.get("time_s", {})
    times = {f"time_s.{name}": value for name, value in spent_s.items()}
    known = {**dict.fromkeys(_NAMES), **times, **statistics}
    return [item for item in known.items() if isinstance(item[1], str | int | float)]
