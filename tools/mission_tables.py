"""The tables of `tools/bench`: missions by scene and profile, and profiles compared."""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from protocol import Row
from scipy.stats import bootstrap

MOMENTS_S = (5.0, 30.0)
"""Times after which a budget's plans are compared with the bound."""


def moments(options: argparse.Namespace) -> dict[str, float | None]:
    """Return the times whose best plans are compared with the bound; None: first."""
    reached = [time_s for time_s in MOMENTS_S if time_s <= (options.budget or 0.0)]
    return {"first": None, **{f"{time_s:g} s": time_s for time_s in reached}}


def solver_share(row: Mapping[str, Any]) -> float:
    """Return the share of the discrete solver in the time of planning."""
    time_s = row["statistics"]["time_s"]
    return float(time_s["routing"] / time_s["total"])


def first_s(row: Mapping[str, Any]) -> float:
    """Return the time to the first plan of a solved row [s]."""
    return float(row["statistics"]["time_s"]["first_solution"])


def p95(values: list[float]) -> float:
    """Return the value that one in twenty exceeds."""
    return sorted(values)[min(len(values) - 1, int(0.95 * len(values)))]


class Column(NamedTuple):
    """A column of the table: its key in JSON, its head, and what it has of a row."""

    key: str
    head: str
    digits: int
    of: Callable[[Row], float | None]
    over: Callable[[list[float]], float] = statistics.median

    def value(self, solved: list[Row]) -> float | None:
        """Return the figure over solved missions; None if it was not measured."""
        values = [x for x in map(self.of, solved) if x is not None]
        return self.over(values) if values else None


def of_moment(name: str, row: Row) -> float | None:
    """Return the cost to the bound of the best plan by a time."""
    after: dict[str, float] = row.get("cost_to_bound_after", {})
    return after.get(name)


COLUMNS = (
    Column("first_s_median", "first_s median", 3, first_s),
    Column("first_s_p95", "first_s p95", 3, first_s, p95),
    Column("plan_s_median", "plan_s median", 3, lambda row: row["plan_s"]),
    Column("solver_share_median", "solver share median", 2, solver_share),
    Column("cost_m_median", "cost_m median", 1, lambda row: row["cost_m"]),
)
BOUND = tuple(
    Column(
        f"cost_to_bound_{name.replace(' ', '_')}",
        f"cost/bound {name}",
        3,
        partial(of_moment, name),
    )
    for name in ("first", *(f"{time_s:g} s" for time_s in MOMENTS_S))
) + (
    Column(
        "cost_to_bound_median",
        "cost/bound median",
        3,
        lambda row: row.get("cost_to_bound"),
    ),
)
DRIVEN = (
    Column("rms_m_worst", "rms_m worst", 4, lambda row: row.get("tracking_rms_m"), max),
    Column("max_m_worst", "max_m worst", 4, lambda row: row.get("tracking_max_m"), max),
    Column(
        "metered_pct_worst",
        "metered% worst",
        2,
        lambda row: row.get("metered_error_pct"),
        max,
    ),
    Column(
        "measured_pct_worst",
        "measured% worst",
        2,
        lambda row: row.get("measured_error_pct"),
        max,
    ),
    Column("x_real_median", "x real", 0, lambda row: row.get("realtime_factor")),
)


def printed(options: argparse.Namespace) -> tuple[Column, ...]:
    """Return the columns that are printed."""
    reached = {f"cost/bound {name}" for name in (*moments(options), "median")}
    bound = [column for column in BOUND if options.bound and column.head in reached]
    return (*COLUMNS, *bound, *(DRIVEN if options.execute else ()))


def header(options: argparse.Namespace) -> str:
    """Return the table's head."""
    return " | ".join(("scene", "ok", *(column.head for column in printed(options))))


def print_scene(scene: str, rows: list[Row], options: argparse.Namespace) -> list[Row]:
    """Print one line of the table for each profile; return what they say."""
    table = []
    for profile in options.profile:
        name = f"{scene} {profile}" if len(options.profile) > 1 else scene
        of_profile = [row for row in rows if row["profile"] == profile]
        ok, runs = sum(row["ok"] for row in of_profile), len(of_profile)
        # A plan that the verifier refused has figures, too, but they count for nothing.
        solved = [row for row in of_profile if row.get("violations") == 0]
        line: Row = {"scene": scene, "profile": profile, "ok": ok, "runs": runs}
        for column in (*COLUMNS, *BOUND, *DRIVEN):
            line[column.key] = column.value(solved)
        cells = [
            f"{line[column.key]:.{column.digits}f}"
            for column in printed(options)
            if line[column.key] is not None
        ]
        print(" | ".join((name, f"{ok}/{runs}", *cells)), flush=True)
        table.append(line)
    return table


def median_interval(values: list[float]) -> tuple[float | None, float | None]:
    """Return the 95 % percentile bootstrap interval of a median; None of too few."""
    if len(values) < 2:
        return None, None
    found = bootstrap((values,), np.median, method="percentile", random_state=0)
    low, high = found.confidence_interval
    return float(low), float(high)


def print_ratios(
    rows: list[Row], options: argparse.Namespace, profile: str
) -> list[Row]:
    """Print and return how a profile compares with the first one, seed by seed.

    Medians of ratios have 95 % bootstrap intervals over the seeds.
    """
    base = options.profile[0]
    solved = {
        (row["scene"], row["seed"], row["profile"]): row for row in rows if row["ok"]
    }
    print(f"\n{profile} / {base}\nscene | both ok | first plan | cost")
    scenes = sorted({row["scene"] for row in rows})
    table = []
    for names in [*([scene] for scene in scenes), *([scenes] if scenes[1:] else [])]:
        pairs = [
            (solved[scene, seed, profile], solved[scene, seed, base])
            for scene in names
            for seed in options.seeds
            if {(scene, seed, profile), (scene, seed, base)} <= solved.keys()
        ]
        name = names[0] if len(names) == 1 else "all"
        line: Row = {"profile": profile, "base": base, "scene": name}
        line["both_ok"] = len(pairs)
        cells = [name, f"{len(pairs)}"]
        for key, digits, ratios in (
            ("first_plan", 1, [first_s(a) / first_s(b) for a, b in pairs]),
            ("cost", 3, [a["cost_J"] / b["cost_J"] for a, b in pairs]),
        ):
            line[key] = statistics.median(ratios) if ratios else None
            low, high = line[f"{key}_interval"] = median_interval(ratios)
            if ratios:
                text = f"{line[key]:.{digits}f}"
                text += f" [{low:.{digits}f}, {high:.{digits}f}]" if low else ""
                cells.append(text)
        print(" | ".join(cells))
        table.append(line)
    return table
