"""The history of BENCHMARKS.md: key figures of a version, as texts."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Mapping
from typing import Any

Row = Mapping[str, Any]
Documents = Mapping[str, Mapping[str, Any]]


def num(value: float | None, digits: int = 2, scale: float = 1.0) -> str:
    """Return a number as text; "-" for none."""
    return "-" if value is None else f"{scale * value:.{digits}f}"


def named(rows: Iterable[Row], **wanted: Any) -> Row:
    """Return the row with given values, an empty one if there is none."""
    fits = (row for row in rows if all(row.get(k) == v for k, v in wanted.items()))
    return next(fits, {})


def figures(result: str, *keys: str, digits: int = 2, **wanted: Any) -> Any:
    """Return what gives numbers of one row of a result; "-" where it is missing."""

    def of(documents: Documents) -> str:
        document = documents.get(result, {})
        rows = [*document.get("rows", ()), *document.get("ratios", ())]
        row = named((row for row in rows if keys[0] in row), **wanted)
        return ", ".join(num(row[key], digits) for key in keys) if row else "-"

    return of


def share(result: str, part: str, whole: str, table: str = "rows") -> Any:
    """Return what sums counts of a result over its rows."""

    def of(documents: Documents) -> str:
        rows = [
            row
            for row in documents.get(result, {}).get(table, ())
            if row.get("scene") != "all"
        ]
        if not rows:
            return "-"
        wholes = sum(row[whole] if whole else 1 for row in rows)
        return f"{sum(row[part] for row in rows)} of {wholes}"

    return of


def kinodynamic(documents: Documents) -> str:
    """Return the median time over the kinodynamic files."""
    rows = documents.get("kinodynamic", {}).get("rows", ())
    times = [row["plan_s_median"] for row in rows]
    return num(statistics.median(times)) if times else "-"


HISTORY: Mapping[str, Callable[[Documents], str]] = {
    "first plan [s]": figures("first_plans", "first_s_median", scene="all"),
    "cost / bound: first, 30 s": figures(
        "bounds", "cost_to_bound_first", "cost_to_bound_30_s", digits=3, scene="all"
    ),
    "paper / default: time, cost": figures(
        "table_1", "first_plan", "cost", scene="all"
    ),
    "driven well": share("missions", "ok", "runs"),
    "narrow maps": share("maps", "ok", "runs"),
    "CL-MAPF": share("clmapf", "solved", "runs"),
    "kinodynamic [s]": kinodynamic,
    "router within 1 %": figures("routing", "within_1_pct", digits=0, router="search"),
    "32 robots, 128 goals [s]": figures(
        "growth", "first_plan_s_median", series="large", robots=32
    ),
    "physics: figures that hold": share("physics", "holds", "", "figures"),
    "foreign tyre: before, calibrated [%]": figures(
        "foreign_tyre", "before_median_pct", "after_median_pct", digits=1, scene="all"
    ),
    "real logs [%]": figures("energy_logs", "median_error_pct", digits=1, law="motor"),
}
"""What gives each figure of a version's documents."""
