"""Compare the routers with exact tours and proven optima; print tables, write JSONL.

Protocol: one process, one thread, kernels compiled before anything is timed. The first
table is of generated missions on 100 x 100 m of uneven ground whose lowest-cost tours
recharge at least once, against exact tours. The second is of Green VRP instances
(closed routes of any number of vehicles, dwell and route time limits, stations
revisited freely) against proven optima; it needs their folder.

With --large only generated missions of --goals 100-250 are routed: with the default
router, which has the number of rounds that first plans have, and for --seconds of
processor time. Both are compared with the best that was found for the mission, also by
the router itself in --reference seconds from each of --references other seeds.
Batteries are recharged several times, or suffice.

Finished missions are kept in --output FILE: the same command goes on from there after
an interruption. Rows of --json: `router`, `within_1_pct` and `optimal` of `missions`,
`worst_gap_pct`, `median_s`, `slowest_s`. `instances` has the second table: `instance`,
`proven`, `found` [miles], `routes`, `seconds`. Rows of --large: `goals`, `batteries`,
`missions`, `within_2_pct`, `median_gap_pct`, `worst_gap_pct`, `first_gap_pct`,
`first_s` (medians); `missions` has each of them.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from large_routing import add_large_options, against_long_runs
from protocol import Row, Trials, add_file_options, run, write_document
from routing_missions import uneven_mission

from mrmg import storage
from mrmg.planning.bound.exact_tours import exact_routing
from mrmg.planning.routers import find_router
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.planning.routing.routing import RouterParams
from mrmg.planning.routing.routing_problem import RoutingProblem

PROVEN = {
    "S1_2i6s": 1578.12,
    "S1_4i2s": 1582.21,
    "S1_4i4s": 1460.09,
    "S1_4i6s": 1397.27,
}
"""Least distances of the Green VRP instances [miles]."""

COMPARED = (
    RouterParams(method="nrpa", levels=2),
    RouterParams(method="search"),
    RouterParams(method="exact"),
)
"""Routers of the first table."""

EARTH_RADIUS = 4182.44949
"""As the instances' authors have it [miles]."""

TANK, SPEED = 300.0, 40.0
"""Range of a full tank [miles] and speed [miles/h]."""

CUSTOMER_STOP, STATION_STOP, LONGEST_ROUTE = 0.5, 0.25, 10.75
"""Hours."""

VEHICLES = 10
"""More than any of the optima uses."""

FOLDER = Path(__file__).resolve().parents[1] / ".." / "shared" / "routing"


def main() -> int:
    """Run the bench; return 1 if a target is missed."""
    options = parse_options()
    print(f"{__doc__}\n")
    trials = Trials(options.output)
    if options.large:
        return against_long_runs(options, trials)
    rows, table = against_exact(options.instances, trials)
    instances: list[Row] = []
    if options.folder.is_dir():
        params = RouterParams(rounds=options.rounds)
        instances = against_proven(options.folder, params, trials)
    else:
        print(f"\nno Green VRP instances: {options.folder} is not there")
    held = [row for row in rows + instances if row["router"] != "nrpa"]
    ok = all(row["gap"] <= row["allowed"] for row in held)
    keys = ("instance", "proven", "found", "routes", "seconds")
    shown = [{key: row[key] for key in keys} for row in instances]
    write_document(options, "bench_routing", table, ok, instances=shown)
    return 0 if ok else 1


def against_exact(instances: int, trials: Trials) -> tuple[list[Row], list[Row]]:
    """Compare the routers on generated missions; return all rows, and the table's."""
    cases = list(generated(instances))
    rows, table = [], []
    print("router | within 1 % | optimal | worst gap | median s | slowest s")
    for params in COMPARED:
        ready = cache(partial(find_router(params), RoutingProblem.of(cases[0][1]), 0))
        of_router = [
            trials.row(
                partial(compared, ready, params, *case),
                router=params.method,
                mission=case[0],
            )
            for case in cases
        ]
        rows += of_router
        table.append(generated_row(params.method, of_router))
        print(
            "{router} | {within_1_pct}/{missions} | {optimal} | {worst_gap_pct:.2f} % "
            "| {median_s:.4f} | {slowest_s:.4f}".format(**table[-1]),
            flush=True,
        )
    return rows, table


def against_proven(folder: Path, params: RouterParams, trials: Trials) -> list[Row]:
    """Solve the Green VRP instances; print and return their rows."""
    rows = []
    print("\ninstance | proven | found | routes | s")
    for name, optimum in PROVEN.items():
        path = folder / f"{name}.txt"
        row = trials.row(
            partial(green_row, path, optimum, params),
            instance=name,
            digest=storage.bytes_digest(path.read_bytes()),
            rounds=params.rounds,
        )
        rows.append(row)
        print(
            f"{name} | {optimum} | {row['found']:.2f} | {row['routes']} | "
            f"{row['seconds']:.2f}",
            flush=True,
        )
    return rows


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_routing")
    parser.add_argument("--instances", type=int, default=100, help="default 100")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="of Green VRP")
    parser.add_argument(
        "--rounds", type=int, default=10_000, help="of the search on Green VRP"
    )
    add_large_options(parser)
    add_file_options(parser)
    return parser.parse_args()


def generated(number: int) -> Iterator[tuple[int, RoutingArrays, float]]:
    """Yield (seed, mission, least cost) of missions that cannot do without stations."""
    seed = found = 0
    while found < number:
        seed += 1
        problem = generate(seed)
        best = exact_routing(problem)
        if best is None or not best.feasible:
            continue
        if any(target >= problem.goals for tour in best.tours for target in tour):
            found += 1
            yield seed, problem, best.cost_J


def generate(seed: int) -> RoutingArrays:
    """Return a mission of 6-10 goals, 1-3 robots and 2-4 stations."""
    rng = np.random.default_rng(seed)
    goals, robots, stations = (int(rng.integers(*n)) for n in ((6, 11), (1, 4), (2, 5)))
    return uneven_mission(
        rng, goals=goals, stations=stations, robots=robots, range_m=(90.0, 200.0)
    )


def compared(
    ready: Callable[[], Any],
    params: RouterParams,
    seed: int,
    problem: RoutingArrays,
    optimum: float,
) -> Row:
    """Solve one mission, with a router that has been at work before."""
    ready()
    began = time.perf_counter()
    routing = find_router(params)(RoutingProblem.of(problem), seed)
    return {
        "router": params.method,
        "seed": seed,
        "seconds": time.perf_counter() - began,
        "gap": routing.cost_J / optimum - 1.0,
        "allowed": 0.01,
    }


def generated_row(name: str, rows: list[Row]) -> Row:
    """Return one router's row of the table."""
    gap = np.array([row["gap"] for row in rows])
    seconds = np.array([row["seconds"] for row in rows])
    return {
        "router": name,
        "missions": len(gap),
        "within_1_pct": (gap <= 0.01).sum(),
        "optimal": (gap <= 1e-9).sum(),
        "worst_gap_pct": 100.0 * gap.max(),
        "median_s": np.median(seconds),
        "slowest_s": seconds.max(),
    }


def green_row(path: Path, optimum: float, params: RouterParams) -> Row:
    """Solve a Green VRP instance, with a router that has been at work before."""
    problem = read_green_vrp(path)
    find_router(replace(params, rounds=1))(RoutingProblem.of(problem), 0)
    began = time.perf_counter()
    routing = find_router(params)(RoutingProblem.of(problem), 0)
    return {
        "router": params.method,
        "instance": path.stem,
        "proven": optimum,
        "gap": routing.cost_J / optimum - 1.0,
        "allowed": 0.005 / optimum,
        "found": routing.cost_J,
        "routes": sum(bool(tour) for tour in routing.tours),
        "seconds": time.perf_counter() - began,
    }


def read_green_vrp(path: Path, *, vehicles: int = VEHICLES) -> RoutingArrays:
    """Read a Green VRP instance: distances [miles] are energies, times are hours."""
    rows = [line.split() for line in path.read_text().splitlines()]
    places = [row for row in rows if len(row) == 4 and row[1] in ("d", "f", "c")]
    of_kind = {
        kind: [(float(x), float(y)) for _, k, x, y in places if k == kind]
        for kind in ("d", "f", "c")
    }
    customers, stations = of_kind["c"], of_kind["f"]
    way = haversine(np.radians(np.array(customers + stations + of_kind["d"])))
    targets = len(customers) + len(stations)
    stop = np.repeat([CUSTOMER_STOP, STATION_STOP], [len(customers), len(stations)])
    hours = way[:, :targets] / SPEED + stop
    fleet = np.ones(vehicles)
    return RoutingInstance(
        goals=len(customers),
        distance=np.tile(way[:targets, :targets], (vehicles, 1, 1)),
        start_distance=np.tile(way[targets, :targets], (vehicles, 1)),
        plain=fleet,
        energy=TANK * fleet,
        capacity=TANK * fleet,
        reserve=0.0 * fleet,
        finish_distance=np.tile(way[:, targets], (vehicles, 1)),
        time=np.tile(hours, (vehicles, 1, 1)),
        finish_time=np.tile(way[:, targets] / SPEED, (vehicles, 1)),
        limit=LONGEST_ROUTE * fleet,
    ).arrays


def haversine(point: np.ndarray) -> np.ndarray:
    """Return great-circle distances [miles] of (longitude, latitude) [rad], (n, n)."""
    east, north = np.sin((point[:, None] - point[None]) / 2.0).transpose(2, 0, 1) ** 2
    across = np.cos(point[:, 1])
    arc = north + across[:, None] * across[None] * east
    return np.asarray(2.0 * EARTH_RADIUS * np.arcsin(np.sqrt(arc)))


if __name__ == "__main__":
    run(main)
