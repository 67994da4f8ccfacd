"""Missions of scenes and seeds: planned, verified, driven, audited, and judged.

A row is what one mission came to; a line of the table is what those of a scene did.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from importlib import import_module

from protocol import Row, Trials

import mrmg
from mrmg.planning import plan_mission
from mrmg.simulation.controller import controller_maker
from mrmg.studies.engine import Engine
from physics.figures import Figure, verdict

MEDIAN_PCT = {"metered_pct": 1.0, "measured_pct": 2.0}
WORST_PCT = {"metered_pct": 2.0, "measured_pct": 4.0}
TRACKING_M = {"rms_m": 0.03, "max_m": 0.15}
CONTROLLER_MS = {"median": 1.0, "p99": 5.0}
REALTIME = {2: 40.0, 8: 12.0}
"""Least speed of the simulation by the largest fleet it is asked of."""

HEAD = (
    "scene", "robots", "feasible", "metered % median", "worst", "measured % median",
    "worst", "rms m worst", "max m worst", "x real (processor)", "(clock)",
    "control ms median", "p99 worst", "",
)  # fmt: skip

PRINTED = {
    "metered_pct_median": 2, "metered_pct_worst": 2, "measured_pct_median": 2,
    "measured_pct_worst": 2, "rms_m_worst": 4, "max_m_worst": 4, "x_real_processor": 0,
    "x_real_clock": 0, "control_ms_median": 2, "control_ms_p99_worst": 2,
}  # fmt: skip
"""Figures of a line by their keys, and how many decimals are printed."""


def mission(source: str, seed: int) -> Row:
    """Return what came of one mission."""
    scene = mrmg.load_scene(source)
    _warm(source)
    row: Row = {"scene": source, "seed": seed, "fleet": len(scene.robots)}
    result = plan_mission(scene, seed=seed)
    if result.plan is None:
        return row | {"feasible": False, "reasons": [result.reason], "robots": []}
    verified = mrmg.verify(scene, result.plan).ok
    began = time.process_time()
    log = mrmg.execute(scene, result.plan)
    processor_s = time.process_time() - began
    account = mrmg.audit(scene, result.plan, log)
    return row | {
        "feasible": verified and account.mission_ok,
        "reasons": list(account.reasons),
        "robots": [
            {
                "robot": robot.robot,
                "planned_J": robot.planned_J,
                "metered_pct": robot.metered_error_pct,
                "measured_pct": robot.measured_error_pct,
                "rms_m": robot.tracking_rms_m,
                "max_m": robot.tracking_max_m,
                "parts_J": {
                    part: account.planned.total_J(robot=robot.robot, part=part)
                    for part in ("rolling", "turning")
                },
            }
            for robot in account.robots
        ],
        "realtime": float(log.time_s[-1]) / processor_s,
        "realtime_clock": log.timing["realtime_factor"],
        "controller_ms": log.timing["controller_ms"],
        "log_digest": log.digest,
    }


@cache
def _warm(source: str) -> None:
    """Import what drives, and set the controllers of a scene up, once a process."""
    import_module("mrmg.simulation.simulation")
    for robot in mrmg.load_scene(source).robots:
        controller_maker("mpc")(robot.model)


def mission_figures(
    scenes: Sequence[str], seeds: range, trials: Trials, workers: int
) -> tuple[list[Figure], list[Row]]:
    """Drive what is missing, print a line per scene; return figures and lines."""
    digests = {scene: mrmg.load_scene(scene).digest for scene in scenes}

    def finished(scene: str, seed: int) -> Row | None:
        return trials.get(scene=scene, digest=digests[scene], seed=seed)

    jobs = [(scene, seed) for scene in scenes for seed in seeds]
    missing = [job for job in jobs if finished(*job) is None]
    made = Engine(workers=workers).results(mission, missing)
    print("\n" + " | ".join(HEAD))
    rows: list[Row] = []
    lines: list[Row] = []
    for scene in scenes:
        while not all(finished(scene, seed) for seed in seeds):
            _, row = next(made)
            of = row["scene"]
            trials.add(row, scene=of, digest=digests[of], seed=row["seed"])
        own = [row for seed in seeds if (row := finished(scene, seed))]
        rows += own
        lines.append(line_of(scene, own))
        print(" | ".join([*cells(lines[-1]), verdict(faults_of(own))]), flush=True)
    return [*figures_of(rows), _repeated(rows)], lines


def _repeated(rows: Sequence[Row]) -> Figure:
    """Drive the first mission that was driven once more, here."""
    first = next((row for row in rows if row["robots"]), None)
    same = first is not None and (
        mission(first["scene"], first["seed"])["log_digest"] == first["log_digest"]
    )
    output = "same log" if same else "another log"
    return Figure("a mission driven again", output, "same log", same)


def figures_of(rows: Sequence[Row]) -> list[Figure]:
    """Return the figures that all missions together came to."""
    driven = [row for row in rows if row["robots"]]
    feasible = sum(row["feasible"] for row in rows)
    figures = [Figure.count("feasible missions", feasible, len(rows), len(rows))]
    if not driven:
        return figures
    names = sorted({row["scene"] for row in driven})
    by_scene = [[row for row in driven if row["scene"] == name] for name in names]
    for key, bound in MEDIAN_PCT.items():
        found = max(statistics.median(of_robots(own, key)) for own in by_scene)
        worst = max(of_robots(driven, key))
        what = f"{key.removesuffix('_pct')} against planned energy"
        figures += [
            Figure.at_most(f"{what}, median of the worst scene", found, bound, " %"),
            Figure.at_most(f"{what}, worst robot", worst, WORST_PCT[key], " %"),
        ]
    for key, bound in TRACKING_M.items():
        what = f"tracking {key.removesuffix('_m')}, worst robot"
        figures.append(Figure.at_most(what, max(of_robots(driven, key)), bound, " m"))
    for fleet, least in REALTIME.items():
        speeds = [
            typical(own, lambda row: row["realtime"])
            for own in by_scene
            if own[0]["fleet"] == fleet
        ]
        if speeds:
            what = f"x real time with {fleet} robots, slowest scene"
            figures.append(Figure.at_least(what, min(speeds), least))
    for key, bound in CONTROLLER_MS.items():
        slowest = max(_controller_ms(own, key) for own in by_scene)
        what = f"controller {key} a step and robot, slowest scene"
        figures.append(Figure.at_most(what, slowest, bound, " ms"))
    return figures


def _controller_ms(rows: Sequence[Row], key: str) -> float:
    return statistics.median(row["controller_ms"][key] for row in rows)


def faults_of(rows: Sequence[Row]) -> list[str]:
    """Return the figures that the missions of one scene miss, each in a few words."""
    faults = [f"seed {row['seed']} infeasible" for row in rows if not row["feasible"]]
    driven = [row for row in rows if row["robots"]]
    if not driven:
        return faults
    checks: list[tuple[str, float, float]] = [
        (f"median {key}", statistics.median(of_robots(driven, key)), bound)
        for key, bound in MEDIAN_PCT.items()
    ]
    checks += [
        (f"worst {key}", max(of_robots(driven, key)), bound)
        for key, bound in (WORST_PCT | TRACKING_M).items()
    ]
    checks += [
        (f"controller {key} ms", _controller_ms(driven, key), bound)
        for key, bound in CONTROLLER_MS.items()
    ]
    faults += [
        f"{name} {value:.3g} > {bound:g}"
        for name, value, bound in checks
        if value > bound
    ]
    realtime = typical(driven, lambda row: row["realtime"])
    least = slowest_allowed(rows)
    if realtime < least:
        faults.append(f"{realtime:.0f} x real time < {least:g}")
    return faults


def slowest_allowed(rows: Sequence[Row]) -> float:
    """Return the least speed of simulation asked of a fleet of this size."""
    return next(
        (least for size, least in REALTIME.items() if rows[0]["fleet"] <= size), 0.0
    )


def of_robots(rows: Iterable[Row], key: str) -> list[float]:
    """Return the sizes of one figure of all robots of all missions."""
    return [abs(robot[key]) for row in rows for robot in row["robots"]]


def typical(rows: Sequence[Row], figure: Callable[[Row], float]) -> float:
    """Return the median over missions."""
    return statistics.median(figure(row) for row in rows)


def line_of(scene: str, rows: Sequence[Row]) -> Row:
    """Return a scene's line of the table, as numbers; None for what was not driven."""
    line: Row = {"scene": scene, "robots": rows[0]["fleet"]}
    line |= {"feasible": sum(row["feasible"] for row in rows), "missions": len(rows)}
    faults = {"faults": faults_of(rows)}
    driven = [row for row in rows if row["robots"]]
    if not driven:
        return line | dict.fromkeys(PRINTED) | faults
    for key in MEDIAN_PCT:
        line[f"{key}_median"] = statistics.median(of_robots(driven, key))
    for key in (*MEDIAN_PCT, *TRACKING_M):
        line[f"{key}_worst"] = max(of_robots(driven, key))
    return line | {
        "x_real_processor": typical(driven, lambda row: row["realtime"]),
        "x_real_clock": typical(driven, lambda row: row["realtime_clock"]),
        "control_ms_median": _controller_ms(driven, "median"),
        "control_ms_p99_worst": max(row["controller_ms"]["p99"] for row in driven),
        **faults,
    }


def cells(line: Row) -> list[str]:
    """Return a scene's line of the table, as it is printed."""
    start = [line["scene"], str(line["robots"])]
    start.append(f"{line['feasible']}/{line['missions']}")
    if line["x_real_clock"] is None:
        return start
    return start + [f"{line[key]:.{digits}f}" for key, digits in PRINTED.items()]
