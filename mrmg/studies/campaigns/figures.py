"""What the trials of a campaign add up to, by each of its factors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mrmg.studies.campaigns.trial import ERROR, REFUSED
from mrmg.studies.outcomes import CONFIDENCE, wilson_interval

if TYPE_CHECKING:
    from mrmg.studies.campaigns.reading import CampaignTrial

Row = Mapping[str, Any]

RESULTS = (
    "status", "feasible", "causes", "reason", "goals_total", "goals_visited",
    "goals_skipped", "cost_J", "makespan_s", "duration_s", "metered_J", "measured_J",
    "measured_error_pct", "charge_fraction", "obstacle_clearance_m", "robot_distance_m",
    "tracking_max_m", "contacts", "recharges", "replans", "plan_digest", "log_digest",
)  # fmt: skip
"""Columns of a table after those of the factors."""

PARTS = ("compile", "plan", "verify", "drive", "total")
"""Parts of a trial whose times on the clock are kept, in a table of their own."""

MEASURES = ("cost_J", "measured_J", "makespan_s", "duration_s", "plan_s", "total_s")
"""Figures whose medians and quartiles are given; the last two are on the clock."""

_QUANTILES = {"min": 0.0, "p25": 0.25, "median": 0.5, "p75": 0.75, "max": 1.0}


def table_row(trial: CampaignTrial, content: Row) -> dict[str, Any]:
    """Return a trial's row of the table that is the same wherever it was made."""
    result = content["result"]
    figures = {name: result.get(name) for name in RESULTS}
    return {"trial": trial.key, **trial.factors, **figures}


def times_row(trial: CampaignTrial, content: Row) -> dict[str, Any]:
    """Return a trial's row of the table of times on the clock."""
    times = content["time_s"]
    return {"trial": trial.key, **{f"{part}_s": times.get(part) for part in PARTS}}


def campaign_figures(
    name: str, factors: Sequence[Row], rows: Sequence[Row], times: Sequence[Row]
) -> dict[str, Any]:
    """Return the content of `summary.json`: of all trials, and by value of each factor.

    Args:
        name: of the campaign.
        factors: of each trial.
        rows: of `table_row`.
        times: of `times_row`.
    """
    merged = [{**row, **time} for row, time in zip(rows, times, strict=True)]
    by = {factor: _by_value(factor, factors, merged) for factor in factors[0]}
    return {"campaign": name, "confidence": CONFIDENCE, **_of(merged), "by": by}


def _by_value(
    factor: str, factors: Sequence[Row], rows: Sequence[Row]
) -> list[dict[str, Any]]:
    """Return the figures of the trials with each value of a factor."""
    levels: dict[Any, dict[str, Row]] = {}
    for own, row in zip(factors, rows, strict=True):
        others = str({name: value for name, value in own.items() if name != factor})
        levels.setdefault(own[factor], {})[others] = row
    first = next(iter(levels.values()))
    return [
        {"value": value, **_of([*own.values()]), "cost_to_first": _ratio(own, first)}
        for value, own in levels.items()
    ]


def _ratio(own: Mapping[str, Row], first: Mapping[str, Row]) -> dict[str, Any] | None:
    """Return the median ratio of planned energy in trials equal in all other factors.

    Args:
        own: trials with one value, by the other factors.
        first: those with the factor's first value.
    """
    pairs = [(row["cost_J"], first[others]["cost_J"]) for others, row in own.items()]
    ratios = [cost_J / first_J for cost_J, first_J in pairs if cost_J and first_J]
    if not ratios:
        return None
    return {"median": float(np.median(ratios)), "pairs": len(ratios)}


def _of(rows: Sequence[Row]) -> dict[str, Any]:
    """Return what some trials come to; refused ones do not count as infeasible."""
    counted = [row for row in rows if row["status"] not in (REFUSED, ERROR)]
    feasible = sum(row["feasible"] for row in counted)
    causes = sorted({cause for row in counted for cause in row["causes"] or ()})
    return {
        "trials": len(rows),
        "refused": sum(row["status"] == REFUSED for row in rows),
        "errors": sum(row["status"] == ERROR for row in rows),
        "feasible": feasible,
        "share": feasible / len(counted) if counted else None,
        "interval": list(wilson_interval(feasible, len(counted))) if counted else None,
        "failures": {
            cause: sum(cause in (row["causes"] or ()) for row in counted)
            for cause in causes
        },
        **{name: _distribution(counted, name) for name in MEASURES},
    }


def _distribution(rows: Sequence[Row], name: str) -> dict[str, float] | None:
    values = [row[name] for row in rows if row[name] is not None]
    if not values:
        return None
    return {key: float(np.quantile(values, at)) for key, at in _QUANTILES.items()}
