"""The router on missions of many goals, beside its own long runs."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from functools import partial
from itertools import product

import numpy as np
from protocol import Row, Trials, seed_range, write_document
from routing_missions import BATTERIES, large_mission

from mrmg.planning.routers import find_router
from mrmg.planning.routing.routing import RouterParams
from mrmg.planning.routing.routing_problem import RoutingProblem, faults_of_tours

ALLOWED_PCT = 2.0
"""Above the best found for a mission."""

FIRST_REFERENCE = 1000
"""Router seed of the first long run; later ones have the next."""


def add_large_options(parser: argparse.ArgumentParser) -> None:
    """Let the bench take the options of large missions."""
    group = parser.add_argument_group("missions of many goals")
    group.add_argument("--large", action="store_true", help="route these alone")
    group.add_argument("--goals", type=int, nargs="+", default=[100, 150, 250])
    group.add_argument(
        "--seeds", type=seed_range, default="0-2", help="first-last, default 0-2"
    )
    group.add_argument("--seconds", type=float, default=30.0, help="default 30")
    group.add_argument("--reference", type=float, default=600.0, help="default 600 s")
    group.add_argument("--references", type=int, default=2, help="default 2")


def against_long_runs(options: argparse.Namespace, trials: Trials) -> int:
    """Compare the router with long runs of its own; return 1 if a mission is missed."""
    print("goals | batteries | seed | first J | first s | found J | best J | gap")
    rows = []
    for goals, batteries, seed in product(options.goals, BATTERIES, options.seeds):
        mission = {"goals": goals, "batteries": batteries, "seed": seed}
        route = partial(_trial, trials, mission)
        first = route(0, None)
        found = route(0, options.seconds)
        seeds = range(FIRST_REFERENCE, FIRST_REFERENCE + options.references)
        known = [route(each, options.reference) for each in seeds]
        best_J = min(row["cost_J"] for row in (first, found, *known))
        if not np.isfinite(best_J):
            print(f"{goals} | {batteries} | {seed} | left out: no tours are known")
            continue
        row = mission | {
            "first_J": first["cost_J"],
            "first_s": first["seconds"],
            "found_J": found["cost_J"],
            "best_J": best_J,
            "first_gap_pct": 100.0 * (first["cost_J"] / best_J - 1.0),
            "gap_pct": 100.0 * (found["cost_J"] / best_J - 1.0),
        }
        rows.append(row)
        print(
            "{goals} | {batteries} | {seed} | {first_J:.0f} | {first_s:.2f} | "
            "{found_J:.0f} | {best_J:.0f} | {gap_pct:.2f} %".format(**row),
            flush=True,
        )
    kinds = dict.fromkeys((row["goals"], row["batteries"]) for row in rows)
    table = [
        _summary([row for row in rows if (row["goals"], row["batteries"]) == kind])
        for kind in kinds
    ]
    print("\ngoals | batteries | within 2 % | median, worst gap | first: gap, s")
    for row in table:
        print(
            "{goals} | {batteries} | {within_2_pct}/{missions} | {median_gap_pct:.2f}, "
            "{worst_gap_pct:.2f} % | {first_gap_pct:.2f} %, {first_s:.2f}".format(**row)
        )
    ok = bool(rows) and all(row["gap_pct"] <= ALLOWED_PCT for row in rows)
    write_document(options, "bench_routing", table, ok, missions=rows)
    return 0 if ok else 1


def _trial(trials: Trials, mission: Row, seed: int, limit_s: float | None) -> Row:
    """Return the row of one run of the router, in limited time or by rounds."""
    return trials.row(
        partial(_routed, mission, seed, limit_s),
        mission=mission,
        router_seed=seed,
        limit_s=limit_s,
    )


def _routed(mission: Row, seed: int, limit_s: float | None) -> Row:
    arrays = large_mission(mission["seed"], mission["goals"], mission["batteries"])
    problem = RoutingProblem.of(arrays)
    find_router(RouterParams(rounds=1))(problem, seed)  # compiled and loaded
    began = time.process_time()
    routing = find_router(RouterParams(limit_s=limit_s))(problem, seed)
    seconds = time.process_time() - began
    faults = list(faults_of_tours(problem, routing))
    if faults:
        raise RuntimeError(f"{mission}: {faults}")
    return {"cost_J": routing.cost_J, "seconds": seconds}


def _summary(rows: Sequence[Row]) -> Row:
    """Return the table's row of missions of one kind."""
    gap = np.array([row["gap_pct"] for row in rows])
    return {
        "goals": rows[0]["goals"],
        "batteries": rows[0]["batteries"],
        "missions": len(rows),
        "within_2_pct": int((gap <= ALLOWED_PCT).sum()),
        "median_gap_pct": float(np.median(gap)),
        "worst_gap_pct": float(gap.max()),
        "first_gap_pct": float(np.median([row["first_gap_pct"] for row in rows])),
        "first_s": float(np.median([row["first_s"] for row in rows])),
    }
