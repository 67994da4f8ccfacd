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
    "status", "feasible", "causes", "reason", "goals", "goals_visited", "cost_J",
    "makespan_s", "duration_s", "metered_J", "measured_J", "measured_error_pct",
    "charge_fraction", "obstacle_clearance_m", "robot_distance_m", "tracking_max_m",
    "contacts", "recharges", "replans", "plan_digest", "log_digest",
)  # fmt: skip
"""Columns of a table after those of the factors."""

PARTS = ("compile", "plan", "verify", "drive", "total")
"""Parts of a trial whose times on the clock are kept, in a table of their own."""

MEASURES = {
    "cost_J": "planned energy",
    "measured_J": "measured energy",
    "makespan_s": "planned makespan",
    "duration_s": "driven time",
    "plan_s": "time to plan",
    "total_s": "time of the trial",
}
"""Figures whose medians and quartiles are given, with what pages call them."""

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
    by: dict[str, list[dict[str, Any]]] = {}
    for factor in factors[0]:
        levels: dict[Any, list[Row]] = {}
        for own, row in zip(factors, merged, strict=True):
            levels.setdefault(own[factor], []).append(row)
        by[factor] = [{"value": at, **_of(own)} for at, own in levels.items()]
    return {"campaign": name, "confidence": CONFIDENCE, **_of(merged), "by": by}


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
