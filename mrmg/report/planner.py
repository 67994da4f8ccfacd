"""What the report states of the planner: its statistics, cost and bound over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mrmg.report import chart_spec
from mrmg.report.page import elements as html
from mrmg.report.sections import kJ
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


def planner(record: RunRecord) -> list[str]:
    """Return what the planner did, and how good its plan is known to be."""
    statistics = record.planning["statistics"]
    times = statistics.get("time_s", {})
    rows = [
        [_NAMES.get(place, place), _said(place, value, times)]
        for place, value in _flat(statistics)
        if place not in _TOLD_IN_WORDS
        and (record.plan is not None or place != "time_s.first_solution")
    ]
    chart = cost_chart(record)
    return [
        _quality(record.summary["plan"]),
        html.bullets(record.planning.get("hints", [])),
        html.charts([(COST, chart["title"])] if chart else []),
        html.beside(
            html.table(["Statistic", "Value"], rows),
            _improvements(found_plans(record)),
        ),
    ]


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
    wanted = judged(record.summary["plan"])
    unit, size = _SHOWN[wanted["unit"]]
    values = [size * judged(item)["value"] for item in found]
    bounds = [_scaled(judged(item)["bound"], size) for item in found]
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


def judged(figures: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return name, unit, value and bound of what a plan is judged by.

    Before objectives could be chosen it was the energy.
    """
    energy = {
        "name": "energy",
        "unit": "J",
        "value": figures["cost_J"],
        "bound": figures.get("bound_J"),
    }
    return dict(figures.get("objective", energy))


def _scaled(value: float | None, size: float) -> float:
    return np.nan if value is None else size * value


def _said_value(value: float, unit: str) -> str:
    """Return a value of the objective as text."""
    if unit == "J":
        return kJ(value)
    return f"{value:.1f} s" if unit == "s" else f"{value:.4g}"


def _quality(figures: Mapping[str, Any] | None) -> str:
    """Return how far the plan can be from the optimum, if that is known."""
    if figures is None or figures.get("gap") is None:
        return ""
    objective = judged(figures)
    least = _said_value(objective["bound"], objective["unit"])
    value = _said_value(objective["value"], objective["unit"])
    share = f"{100.0 * figures['gap']:.1f} %"
    return html.paragraph(
        {
            "energy": f"No plan for this mission needs less than {least}: this one "
            f"({value}) is at most {share} above the minimum.",
            "makespan": f"No plan for this mission is over before {least}: this one "
            f"({value}) takes at most {share} longer than the shortest there is.",
            "blend": "No plan for this mission has a weighted sum of energy and "
            f"makespan below {least}: this one ({value}) is at most {share} above the "
            "least there is.",
        }[objective["name"]]
    )


def _improvements(found: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        [
            f"{item['time_s']:.2f} s",
            kJ(item["cost_J"]),
            f"{item['makespan_s']:.1f} s" if "makespan_s" in item else "",
            _bound_of(judged(item)),
            "" if item.get("gap") is None else f"{100.0 * item['gap']:.1f} %",
        ]
        for item in found
    ]
    columns = ["After", "Energy", "Makespan", "Proven bound", "Above the bound"]
    return html.table(columns, rows)


def _bound_of(objective: Mapping[str, Any]) -> str:
    if objective["bound"] is None:
        return ""
    return _said_value(objective["bound"], objective["unit"])


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
