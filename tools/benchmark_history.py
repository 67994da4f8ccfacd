"""The history of BENCHMARKS.md: a row of key figures for each version."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping
from typing import Any

from benchmark_tables import Documents, Table, num, of, pair

Rows = list[Mapping[str, Any]]


def rows(documents: Documents, name: str, key: str = "rows") -> Rows:
    """Return the rows of a result, none if it is not stored."""
    return list(documents.get(name, {}).get(key, []))


def named(found: Rows, **wanted: Any) -> Mapping[str, Any]:
    """Return the row with given values, an empty one if there is none."""
    fits = (row for row in found if all(row.get(k) == v for k, v in wanted.items()))
    return next(fits, {})


def both(row: Mapping[str, Any], first: str, second: str, digits: int) -> str:
    """Return two numbers of a row; "-" if it is empty."""
    return pair(row, first, second, digits) if row else "-"


def total(found: Rows, part: str, whole: str) -> str:
    """Return the sum of counts over the sum of wholes."""
    own = [row for row in found if row.get("scene") != "all"]
    if not own:
        return "-"
    return of(sum(row[part] for row in own), sum(row[whole] for row in own))


def first_plan(documents: Documents) -> str:
    """Return the time to the first plan of scenes 1-6."""
    row = named(rows(documents, "first_plans"), scene="all")
    return num(row.get("first_s_median"))


def to_bound(documents: Documents) -> str:
    """Return cost / bound of scenes 1-6, at first and after 30 s."""
    row = named(rows(documents, "bounds"), scene="all")
    return both(row, "cost_to_bound_first", "cost_to_bound_30_s", 3)


def paper(documents: Documents) -> str:
    """Return times and costs of profile paper over the default."""
    row = named(rows(documents, "table_1", "ratios"), scene="all")
    return both(row, "first_plan", "cost", 2)


def large_fleet(documents: Documents) -> str:
    """Return the time to the first plan of 32 robots with 128 goals."""
    row = named(rows(documents, "growth"), series="large", robots=32)
    return num(row.get("first_plan_s_median"))


def cars(documents: Documents) -> str:
    """Return the share of CL-MAPF runs that are solved."""
    return total(rows(documents, "clmapf"), "solved", "runs")


def narrow(documents: Documents) -> str:
    """Return the share of missions on narrow maps that are solved."""
    return total(rows(documents, "maps"), "ok", "runs")


def driven(documents: Documents) -> str:
    """Return the share of shipped missions that were driven well."""
    return total(rows(documents, "missions"), "ok", "runs")


def foreign(documents: Documents) -> str:
    """Return median errors on the foreign tyre, before and after calibration."""
    row = named(rows(documents, "foreign_tyre"), scene="all")
    return both(row, "before_median_pct", "after_median_pct", 1)


def logs(documents: Documents) -> str:
    """Return the best law's median error on logs of a real robot."""
    found = rows(documents, "energy_logs")
    return num(found[0]["median_error_pct"], 1) if found else "-"


def held(documents: Documents) -> str:
    """Return how many figures of the physics hold."""
    found = rows(documents, "physics", "figures")
    return of(sum(row["holds"] for row in found), len(found)) if found else "-"


def routed(documents: Documents) -> str:
    """Return the share of generated missions that are routed within 1 %."""
    row = named(rows(documents, "routing"), router="search")
    return of(row["within_1_pct"], row["missions"]) if row else "-"


def kinodynamic(documents: Documents) -> str:
    """Return the median time over the kinodynamic files."""
    found = [row["plan_s_median"] for row in rows(documents, "kinodynamic")]
    return num(statistics.median(found)) if found else "-"


COLUMNS: Mapping[str, Callable[[Documents], str]] = {
    "first plan [s]": first_plan,
    "cost / bound: first, 30 s": to_bound,
    "paper / default: time, cost": paper,
    "driven well": driven,
    "narrow maps": narrow,
    "CL-MAPF": cars,
    "kinodynamic [s]": kinodynamic,
    "router within 1 %": routed,
    "32 robots, 128 goals [s]": large_fleet,
    "physics": held,
    "foreign tyre: before, calibrated [%]": foreign,
    "real logs [%]": logs,
}


def history(stored: Mapping[str, Documents]) -> Table:
    """Return a row for each version, newest first."""
    table = []
    for version, documents in stored.items():
        dates = sorted(each["protocol"]["date"] for each in documents.values())
        figures = [figure(documents) for figure in COLUMNS.values()]
        table.append([version, dates[-1] if dates else "-", *figures])
    return ["version", "measured until", *COLUMNS], table
