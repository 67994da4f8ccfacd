"""What the report says of the planner: its statistics, cost and bound over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mrmg.results import chart_spec
from mrmg.results import report_page as html
from mrmg.results.report_record import RunRecord
from mrmg.results.report_sections import kJ

COST = "cost"
"""Group and name of the chart of cost and bound."""

_NAMES = {
    "time_s.init": "Roadmap built after",
    "time_s.routing": "Time of the discrete solver",
    "time_s.first_solution": "First plan after",
    "time_s.total": "Time of planning in all",
    "router_calls": "Calls of the discrete solver",
    "expansions": "Expansions of motion trees",
    "vertices": "Vertices of motion trees",
    "groups": "Groups of vertices",
    "dead_ends": "Expansions that led nowhere",
}
_TOLD_IN_WORDS = ("bound_J", "gap")
_ROOM = (0.9, 1.05)
"""Room below and above the courses, as factors."""


def planner(record: RunRecord) -> list[str]:
    """Return what the planner did, and how good its plan is known to be."""
    statistics = record.planning["statistics"]
    times = statistics.get("time_s", {})
    rows = [
        [html.text(_NAMES.get(place, place)), html.text(_said(place, value, times))]
        for place, value in _flat(statistics)
        if place not in _TOLD_IN_WORDS
    ]
    chart = cost_chart(record)
    return [
        _quality(record.summary["plan"]),
        html.charts([(COST, chart["title"])] if chart else []),
        html.beside(
            html.table(["Statistic", "Value"], rows),
            _improvements(found_plans(record)),
        ),
    ]


def found_plans(record: RunRecord) -> Sequence[Mapping[str, float]]:
    """Return the plans found over time, each cheaper than the one before."""
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
    cost_kJ = np.array([np.nan, *_kJ(found, "cost_J"), found[-1]["cost_J"] / 1000.0])
    last = record.summary["plan"].get("bound_J")
    bound_kJ = np.array([np.nan, *_kJ(found, "bound_J"), _in_kJ(last)])
    if np.isnan(bound_kJ[:-1]).all():
        bound_kJ[:] = _in_kJ(last)  # when it became known was not kept
    bound_kJ = np.fmax.accumulate(bound_kJ)
    lines = [chart_spec.line("cost of the plan", "course", (0, COST), cost_kJ)]
    if not np.isnan(bound_kJ).all():
        lines.append(chart_spec.line("proven bound", "limit", (0, COST), bound_kJ))
    shown = np.concatenate([cost_kJ, bound_kJ])
    return chart_spec.chart(
        COST,
        "Energy of the best plan over the time of planning",
        "kJ",
        lines,
        group=COST,
        limits=(_ROOM[0] * np.nanmin(shown), _ROOM[1] * np.nanmax(shown)),
        along_s=time_s,
    )


def _kJ(found: Sequence[Mapping[str, float]], name: str) -> list[float]:
    return [_in_kJ(item.get(name)) for item in found]


def _in_kJ(value_J: float | None) -> float:
    return np.nan if value_J is None else value_J / 1000.0


def _quality(figures: Mapping[str, Any] | None) -> str:
    """Return how far the plan can be from the cheapest there is, if it is known."""
    if figures is None or figures.get("gap") is None:
        return ""
    return html.paragraph(
        f"No plan for this mission needs less than {kJ(figures['bound_J'])}: this one "
        f"({kJ(figures['cost_J'])}) is at most {100.0 * figures['gap']:.1f} % dearer "
        "than the cheapest there is."
    )


def _improvements(found: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        [
            f"{item['time_s']:.2f} s",
            kJ(item["cost_J"]),
            "" if item.get("bound_J") is None else kJ(item["bound_J"]),
            "" if item.get("gap") is None else f"{100.0 * item['gap']:.1f} %",
        ]
        for item in found
    ]
    return html.table(["After", "Cost of the plan", "Bound", "Above the bound"], rows)


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


def _flat(values: Mapping[str, Any], prefix: str = "") -> list[tuple[str, float | str]]:
    """Return nested figures as (place, value), times first; lists are left out."""
    entries: list[tuple[str, float | str]] = []
    for name, value in values.items():
        if isinstance(value, Mapping):
            entries += _flat(value, f"{prefix}{name}.")
        elif isinstance(value, (str, int, float)):
            entries.append((f"{prefix}{name}", value))
    ranks = {place: rank for rank, place in enumerate(_NAMES)}
    return sorted(entries, key=lambda entry: ranks.get(entry[0], len(ranks)))
