"""Measure how the time of planning grows with a mission; draw it, write JSONL.

Protocol: one process, one thread, kernels compiled and loaded before anything is timed.
A map is a square with boxes at drawn places and headings; `mrmg scene populate` places
robots, goals and stations on it, and the mission is planned until there is a first
plan, with one seed for map, places and planner. One number grows at a time, the others
stay: 4 robots, 20 goals, 6 stations and 50 boxes on 100 x 100 m. The boxes of a map
cover 12 % of it, however many there are, and stations grow with the goals, one for each
4. Large fleets (16 robots with 64 goals and 20 stations, 32 with 128 and 40) are placed
on the map of scene6, 100 x 100 m as well. In the series `fleets` all grows together: 4
goals and a station for each robot, ground and boxes with them (50 boxes on 100 x 100 m
for 16 robots). Times are wall-clock, of planning in process; a plan counts if the
verifier finds nothing wrong with it. With --drive it is driven in MuJoCo, too, and must
end as planned: how many times faster than real time comes last in its line. Memory is
the process's peak so far. The last table has one line for the missions of one size,
with the times of those whose plan counts. The exponent of growth is the slope of a line
through the logarithms of the sizes and of the median times to the first plan.

Finished missions are kept in --output FILE: the same command goes on from there after
an interruption. Rows of --json are those of the last table: `series`, `size`, `robots`,
`goals`, `obstacles`, `ok` of `missions`, `first_plan_s_median`, `first_plan_s_worst`,
`plan_s_median` (until planning returns), `routing_s_median`, `populate_s_median`,
`memory_MB`, with --drive `x_real_time_least`.
`exponents`: `series`, `exponent`.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from math import sqrt
from pathlib import Path

import numpy as np
from bench import conditions
from growth_figure import GrowthPoint, draw_growth, exponent
from growth_map import SIDE_M, drawn_map
from protocol import Row, Trials, add_file_options, run, write_document

import mrmg
from mrmg.errors import UsageError
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.parameters import PATH_FOLLOWING
from mrmg.planning.preparation import compile_kernels
from mrmg.scene.loading import scene_from_document
from mrmg.scene.populating.populate import populate
from mrmg.scene.types import Scene

GOALS_PER_STATION = 4
"""Where goals grow; the others' missions have 20 goals and 6 stations."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A mission to be generated.

    Attributes:
        series: what grows.
        size: of it.
        robots, goals, stations: how many.
        boxes: of a drawn map; None for the map of scene6.
        side_m: of a drawn map.
    """

    series: str
    size: int
    robots: int = 4
    goals: int = 20
    stations: int = 6
    boxes: int | None = 50
    side_m: float = SIDE_M

    @staticmethod
    def of_fleet(robots: int) -> Case:
        """Return a mission on a map that grows with its fleet."""
        boxes, side_m = round(50 * robots / 16), round(SIDE_M * sqrt(robots / 16), 1)
        numbers = {"robots": robots, "goals": 4 * robots, "stations": robots}
        fleet = Case(series="fleets", size=robots, boxes=boxes, **numbers)
        return replace(fleet, side_m=side_m)


SERIES = {
    "robots": [Case(series="robots", size=n, robots=n) for n in (1, 2, 4, 8, 16)],
    "goals": [
        Case(series="goals", size=n, goals=n, stations=max(4, n // GOALS_PER_STATION))
        for n in (5, 10, 20, 40, 80)
    ],
    "obstacles": [
        Case(series="obstacles", size=n, boxes=n) for n in (12, 25, 50, 100, 200)
    ],
    "large": [
        Case(series="large", size=r, robots=r, goals=g, stations=s, boxes=None)
        for r, g, s in ((16, 64, 20), (32, 128, 40))
    ],
    "fleets": [Case.of_fleet(n) for n in (4, 8, 16, 32, 64, 128, 256)],
}


def main() -> int:
    """Measure all chosen series; return 1 if a mission has no verified plan."""
    options = parse_options()
    chosen = [case for name in options.series for case in SERIES[name]]
    chosen = [case for case in chosen if is_chosen(case, options.sizes, options.most)]
    options.seeds = range(options.seeds)
    trials = Trials(options.output)
    rows = measure(chosen, options.seeds, trials, options.drive)
    table = sizes_of(rows)
    powers = {name: exponent(points) for name, points in points_of(rows).items()}
    print(f"\n{summary(table)}\n")
    for name, power in powers.items():
        print(f"time to the first plan by {name}: size to the power of {power:.2f}")
    ok = all(row["ok"] for row in rows)
    exponents = [{"series": name, "exponent": x} for name, x in powers.items()]
    write_document(options, "bench_growth", table, ok, exponents=exponents)
    if options.figure:
        draw(rows, options.figure)
    return 0 if ok else 1


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_growth")
    parser.add_argument("--series", nargs="+", default=list(SERIES), choices=SERIES)
    parser.add_argument("--seeds", type=int, default=3, help="default 3: 0, 1 and 2")
    parser.add_argument("--most", type=int, help="leave out larger sizes")
    parser.add_argument("--sizes", type=int, nargs="+", help="only these sizes")
    parser.add_argument("--drive", action="store_true", help="drive plans in MuJoCo")
    add_file_options(parser)
    parser.add_argument("--figure", type=Path, help="PDF, SVG or PNG")
    return parser.parse_args()


def is_chosen(case: Case, sizes: Sequence[int] | None, most: int | None) -> bool:
    """Return whether a mission's size is among those that are asked for."""
    if sizes is not None:
        return case.size in sizes
    return most is None or case.size <= most


def measure(
    cases: Sequence[Case], seeds: range, trials: Trials, drive: bool = False
) -> list[Row]:
    """Plan what is not finished; print a table of all and return its rows."""
    print(f"{__doc__}\n{conditions()}\n")
    print("grows | size | seed | ok | init s | router s | first plan s | cost J | MB")
    rows = []
    for case in cases:
        for seed in seeds:
            make = partial(planned, case, seed, drive)
            driven = {"driven": True} if drive else {}
            rows.append(trials.row(make, **asdict(case), seed=seed, **driven))
            print(table_row(rows[-1]), flush=True)
    return rows


@cache
def warm() -> None:
    """Compile kernels, and plan the first mission, which loads much."""
    compile_kernels(PATH_FOLLOWING)
    plan_mission(mrmg.load_scene("quickstart"))


def planned(case: Case, seed: int, drive: bool = False) -> Row:
    """Generate, plan, verify and perhaps drive one mission; return its row."""
    warm()
    populating = time.perf_counter()
    scene = scene_of(case, seed)
    params = replace(PlannerParams(), improvements=0)
    began = time.perf_counter()
    result = plan_mission(scene, seed=seed, params=params)
    row = {
        "series": case.series,
        "size": case.size,
        "seed": seed,
        "robots": case.robots,
        "goals": case.goals,
        "stations": case.stations,
        "obstacles": len(scene.obstacles),
        "populate_s": began - populating,
        "status": result.status.value,
        "reason": result.reason,
        "plan_s": time.perf_counter() - began,
        "time_s": dict(result.statistics["time_s"]),
        "conditions": conditions(),
        "ok": False,
    }
    if result.plan is not None:
        row["ok"] = mrmg.verify(scene, result.plan).ok
        row["cost_J"] = result.plan.cost_J
    if drive and result.plan is not None:
        began = time.perf_counter()
        log = mrmg.execute(scene, result.plan)
        row["x_real_time"] = float(log.time_s[-1]) / (time.perf_counter() - began)
        row["ok"] &= mrmg.audit(scene, result.plan, log).mission_ok
    row["memory_MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return row


def table_row(row: Row) -> str:
    """Return one line of the table."""
    first_s = row["time_s"].get("first_solution", np.nan)
    driven = f" | {row['x_real_time']:.1f}" if "x_real_time" in row else ""
    return (
        f"{row['series']} | {row['size']} | {row['seed']} | "
        f"{'yes' if row['ok'] else row['status']} | {row['time_s']['init']:.3f} | "
        f"{row['time_s'].get('routing', np.nan):.3f} | {first_s:.3f} | "
        f"{row.get('cost_J', np.nan):.0f} | {row['memory_MB']:.0f}{driven}"
    )


def sizes_of(rows: Sequence[Row]) -> list[Row]:
    """Return what the missions of each size came to."""
    sizes: dict[tuple[str, int], list[Row]] = {}
    for row in rows:
        sizes.setdefault((row["series"], row["size"]), []).append(row)
    table = []
    for same in sizes.values():
        done = [row for row in same if row["ok"]]
        first_s = [row["time_s"]["first_solution"] for row in done] or [np.nan]
        routing_s = [row["time_s"]["routing"] for row in done] or [np.nan]
        plan_s = [row["plan_s"] for row in done] or [np.nan]
        of_all = ("series", "size", "robots", "goals", "obstacles")
        line: Row = {key: same[0][key] for key in of_all}
        speeds = [row["x_real_time"] for row in done if "x_real_time" in row]
        line |= {"x_real_time_least": min(speeds)} if speeds else {}
        table.append(
            line
            | {
                "ok": sum(row["ok"] for row in same),
                "missions": len(same),
                "first_plan_s_median": np.median(first_s),
                "first_plan_s_worst": np.max(first_s),
                "plan_s_median": np.median(plan_s),
                "routing_s_median": np.median(routing_s),
                "populate_s_median": np.median([row["populate_s"] for row in same]),
                "memory_MB": max(row["memory_MB"] for row in same),
            }
        )
    return table


def summary(table: Sequence[Row]) -> str:
    """Return a table for documents: the missions of one size in a line."""
    lines = [
        "| grows | robots | goals | obstacles | ok | first plan: median, worst [s] "
        "| all planning [s] | routing [s] | memory [MB] |",
        "|---" * 9 + "|",
    ]
    lines += [
        f"| {row['series']} | {row['robots']} | {row['goals']} | {row['obstacles']} "
        f"| {row['ok']} of {row['missions']} "
        f"| {row['first_plan_s_median']:.2f}, {row['first_plan_s_worst']:.2f} "
        f"| {row['plan_s_median']:.2f} | {row['routing_s_median']:.2f} "
        f"| {row['memory_MB']:.0f} |"
        for row in table
    ]
    return "\n".join(lines)


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the series that grow."""
    if series := points_of(rows):
        draw_growth(series, path)
        print(path)


def points_of(rows: Sequence[Row]) -> dict[str, list[GrowthPoint]]:
    """Return the missions of the series that grow, by their names."""
    series: dict[str, list[GrowthPoint]] = {}
    for row in rows:
        if row["series"] != "large":
            first_s = row["time_s"]["first_solution"] if row["ok"] else None
            points = series.setdefault(row["series"], [])
            points.append(GrowthPoint(row["size"], first_s))
    return series


def scene_of(case: Case, seed: int) -> Scene:
    """Return the scene of a case: a map, populated.

    Places are drawn anew, with other seeds, while a mission cannot do with them.
    """
    if case.boxes is None:
        bare = mrmg.load_scene("scene6")
    else:
        drawn = drawn_map(case.boxes, seed, case.side_m)
        bare = scene_from_document(drawn, source=f"{case}")
    for again in range(20):
        try:
            return populate(
                bare,
                robots=case.robots,
                goals=case.goals,
                stations=case.stations,
                seed=seed + 1000 * again,
            )
        except UsageError as error:
            refused = error
    raise refused


if __name__ == "__main__":
    run(main)
