"""Hold the physics to its figures: energy, tracking, speed of simulation, yaw rates.

Every scene is planned, verified, driven in MuJoCo and audited once per seed, with the
default controller, in one process and one thread. Per robot, metered (the energy model
over the driven motion) and measured (the work of the drives) are compared with planned
energy. Speeds are simulated time over time of this process on its processor, from the
building of the world to the log, and over the time on the clock, which other processes
stretch; the former is judged. Controllers are set up and kernels compiled before
anything is timed. Every circle of the second table is driven alone on plain ground. A
row that misses a figure is marked, and the exit code is 1.

With --disturb, scenes 1 and 4 are planned with ten seeds, and the trials are spread
evenly over these plans: under the default disturbances, and with the rolling resistance
raised by 30 % besides, once by the plans alone and once with replanning. A trial is
feasible when all goals are visited without contact and no battery falls below its
reserve. What replanning gains is judged over both scenes together. Trials are kept in a
folder, and are not made twice; one is driven again in this process, and must give the
same log.
"""

from __future__ import annotations

import argparse
import json
import platform
import statistics
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import mrmg
from mrmg import shipped
from mrmg.calibration.manoeuvres import CRUISE_S, STEP_S, circle
from mrmg.calibration.measurement import drive, yaw_rate
from mrmg.execution.controller import controller_maker
from mrmg.execution.log import ExecutionLog
from mrmg.planning import plan_mission
from mrmg.results.robustness import Study, Trial, wilson_interval
from mrmg.robustness import study_robustness
from mrmg.run_folder import RunFolder, Step
from mrmg.scene.loading.models import load_model
from mrmg.scene.robot_model import Limits, RobotModel
from mrmg.steps import Run, RunArguments
from mrmg.steps import drive as drive_as

Row = dict[str, Any]

MEDIAN_PCT = {"metered_pct": 1.0, "measured_pct": 2.0}
WORST_PCT = {"metered_pct": 2.0, "measured_pct": 4.0}
TRACKING_M = {"rms_m": 0.03, "max_m": 0.15}
CONTROLLER_MS = {"median": 1.0, "p99": 5.0}
REALTIME = {2: 40.0, 8: 12.0}
"""Least speed of the simulation by the largest fleet it is asked of."""
YAW_ERROR_PCT = 0.5

DISTURBED_SCENES = ("scene1", "scene4")
TRIALS = (("", False, 0.95), ("rolling=+30%", False, 0.0), ("rolling=+30%", True, 0.9))
"""Disturbances over the default ones, replanning, least share of feasible trials."""
VISIBLE_GAIN = 0.05
"""By how much replanning must raise that share."""

SPEEDS_M_S = (0.5, 1.0, 2.0, 3.0)
STEERS_RAD = (0.05, 0.2, 0.35, 0.5)
TURN_RATES_RAD_S = (0.2, 0.5, 1.0)


def main() -> int:
    """Run the bench; return 1 if a row missed a figure."""
    options = parse_options()
    print(protocol(options))
    tables = [mission_table(options)] if options.scenes else []
    if not options.no_yaw:
        tables.append(yaw_table())
    if options.disturb:
        tables.append(disturbance_table(options))
    misses = sum(tables)
    print(f"\n{misses} rows miss a figure" if misses else "\nall rows hold")
    return 1 if misses else 0


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_physics")
    parser.add_argument(
        "--scenes", nargs="*", default=shipped.scene_names(), metavar="SCENE"
    )
    parser.add_argument("--seeds", default="0-9", help="first-last, default 0-9")
    parser.add_argument("--no-yaw", action="store_true", help="leave out yaw rates")
    parser.add_argument("--disturb", action="store_true", help="robustness, too")
    parser.add_argument("--trials", type=int, default=100, help="of each row of it")
    parser.add_argument("--workers", type=int, default=2, help="that make the trials")
    parser.add_argument("--plan-seeds", default="0-9", help="of the plans in it")
    parser.add_argument(
        "--runs",
        type=Path,
        default=Path("runs/bench_physics"),
        help="folder of the trials, default runs/bench_physics",
    )
    parser.add_argument("--output", type=Path, help="JSONL file, one line a mission")
    options = parser.parse_args()
    options.seeds, options.plan_seeds = map(
        seeds_of, (options.seeds, options.plan_seeds)
    )
    if options.trials < len(options.plan_seeds):
        parser.error("--trials must not be fewer than the plans of --plan-seeds")
    return options


def seeds_of(text: str) -> range:
    """Return the seeds `first-last`, or the single one."""
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def protocol(options: argparse.Namespace) -> str:
    """Return what was measured how and on what."""
    names = ("mrmg", "mujoco", "casadi", "numpy", "scipy")
    versions = ", ".join(f"{name} {version(name)}" for name in names)
    seeds = f"seeds {options.seeds.start}-{options.seeds.stop - 1}"
    return (
        f"{__doc__}\n{seeds}; {versions}, Python {platform.python_version()}, {cpu()}"
    )


def cpu() -> str:
    """Return the processor's name."""
    info = Path("/proc/cpuinfo")
    if not info.exists():
        return platform.processor()
    lines = info.read_text().splitlines()
    names = [line.partition(":")[2].strip() for line in lines if "model name" in line]
    return f"{names[0]} x {len(names)}" if names else platform.machine()


def mission_table(options: argparse.Namespace) -> int:
    """Drive all missions and print a row per scene; return how many rows miss."""
    head = (
        "scene", "robots", "feasible", "metered % median", "worst",
        "measured % median", "worst", "rms m worst", "max m worst",
        "x real (processor)", "(clock)", "control ms median", "p99 worst", "",
    )  # fmt: skip
    print("\n" + " | ".join(head))
    misses = 0
    if options.output:
        options.output.write_text("")
    for scene in options.scenes:
        rows = []
        for row in missions(scene, options.seeds):
            rows.append(row)
            if options.output:
                with options.output.open("a") as file:
                    file.write(json.dumps(row, sort_keys=True) + "\n")
        faults = faults_of(rows)
        misses += bool(faults)
        print(" | ".join([*cells(scene, rows), verdict(faults)]), flush=True)
    return misses


def missions(source: str, seeds: range) -> Iterator[Row]:
    """Yield what came of each seed's mission."""
    scene = mrmg.load_scene(source)
    for robot in scene.robots:
        controller_maker("mpc")(robot.model)
    for seed in seeds:
        row: Row = {"scene": scene.name, "seed": seed, "fleet": len(scene.robots)}
        result = plan_mission(scene, seed=seed)
        if result.plan is None:
            yield row | {"feasible": False, "reasons": [result.reason], "robots": []}
            continue
        verdict_ok = mrmg.verify(scene, result.plan).ok
        began = time.process_time()
        log = mrmg.execute(scene, result.plan)
        processor_s = time.process_time() - began
        account = mrmg.audit(scene, result.plan, log)
        yield row | {
            "feasible": verdict_ok and account.mission_ok,
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
        }


def of_robots(rows: list[Row], key: str) -> list[float]:
    """Return the sizes of one figure of all robots of all missions."""
    return [abs(robot[key]) for row in rows for robot in row["robots"]]


def slowest_allowed(rows: list[Row]) -> float:
    """Return the least speed of simulation asked of a fleet of this size."""
    return next(
        (least for size, least in REALTIME.items() if rows[0]["fleet"] <= size), 0.0
    )


def faults_of(rows: list[Row]) -> list[str]:
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
    for key, bound in CONTROLLER_MS.items():
        times_ms = [row["controller_ms"][key] for row in driven]
        checks.append((f"controller {key} ms", statistics.median(times_ms), bound))
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


def typical(rows: list[Row], figure: Callable[[Row], float]) -> float:
    """Return the median over missions."""
    return statistics.median(figure(row) for row in rows)


def cells(scene: str, rows: list[Row]) -> list[str]:
    """Return a scene's row of the table."""
    feasible = f"{sum(row['feasible'] for row in rows)}/{len(rows)}"
    start = [scene, str(rows[0]["fleet"]), feasible]
    driven = [row for row in rows if row["robots"]]
    if not driven:
        return start
    for key in MEDIAN_PCT:
        sizes = of_robots(driven, key)
        start += [f"{statistics.median(sizes):.2f}", f"{max(sizes):.2f}"]
    start += [f"{max(of_robots(driven, key)):.4f}" for key in TRACKING_M]
    return [
        *start,
        f"{typical(driven, lambda row: row['realtime']):.0f}",
        f"{typical(driven, lambda row: row['realtime_clock']):.0f}",
        f"{typical(driven, lambda row: row['controller_ms']['median']):.2f}",
        f"{max(row['controller_ms']['p99'] for row in driven):.2f}",
    ]


def yaw_table() -> int:
    """Print the error of the yaw rate over speed and turn; return how many rows miss.

    Robots get the limits that the table's speeds and angles take.
    """
    speeds = " | ".join(f"{speed:g} m/s" for speed in SPEEDS_M_S)
    print(f"\nyaw rate against the kinematic model [%] | {speeds} | ")
    misses = 0
    for name in shipped.model_names():
        model, _ = load_model(shipped.models_folder() / name)
        spins = model.motion_model == "unicycle"
        for turn in TURN_RATES_RAD_S if spins else STEERS_RAD:
            errors = [yaw_error_pct(model, speed, turn) for speed in SPEEDS_M_S]
            worst = max(map(abs, errors))
            faults = [f"{worst:.2f} > {YAW_ERROR_PCT}"] if worst > YAW_ERROR_PCT else []
            misses += bool(faults)
            unit = "rad/s" if spins else "rad"
            shown = [f"{name} {turn:g} {unit}", *(f"{item:+.3f}" for item in errors)]
            print(" | ".join([*shown, verdict(faults)]), flush=True)
    return misses


def yaw_error_pct(model: RobotModel, speed_m_s: float, turn: float) -> float:
    """Return by how much a robot turns faster than its wheels say, on a circle."""
    limits = Limits(
        v_min_m_s=0.0,
        v_max_m_s=1.2 * speed_m_s,
        w_max=max(1.2 * turn, model.limits.w_max),
        u1_max_m_s2=model.limits.u1_max_m_s2,
        u2_max=model.limits.u2_max,
    )
    ready = replace(model, limits=limits)
    course = circle(ready, limits, speed_m_s, turn)
    log = drive(ready, course)
    before = [piece.name for piece in course.pieces].index("cruise")
    start_s = STEP_S * sum(piece.steps for piece in course.pieces[:before])
    late_s = start_s + CRUISE_S * np.array([0.5, 1.0])
    first, last = np.searchsorted(log.clock_s, late_s)
    turned = float(log.state[0, last, 2] - log.state[0, first, 2])
    return 100.0 * (turned / rolled_rad(ready, log, first, last) - 1.0)


def rolled_rad(model: RobotModel, log: ExecutionLog, first: int, last: int) -> float:
    """Return the angle the robot turned between two ticks, by what its wheels did."""
    if model.motion_model == "unicycle":
        mjcf = mujoco.MjModel.from_xml_path(str(model.mjcf))
        left, right = (
            np.ptp(log.qpos[[first, last], mjcf.joint(f"spin_{side}").qposadr[0]])
            for side in "lr"
        )
        return float((right - left) * model.wheel_radius_m / model.track_m)
    rate = yaw_rate(model, log.state[0, first : last + 1])
    return float(np.trapezoid(rate, log.time_s[first : last + 1]))


def disturbance_table(options: argparse.Namespace) -> int:
    """Print a row per scene and kind of disturbance; return how many rows miss."""
    head = (
        "scene", "disturbance", "replanning", "feasible", "95 % interval",
        "least charge: worst, median", "failures", "",
    )  # fmt: skip
    print("\n" + " | ".join(head))
    misses = 0
    stressed: dict[bool, list[Study]] = {False: [], True: []}
    for source in DISTURBED_SCENES:
        for disturb, replan, least in TRIALS:
            study = study_of(source, disturb, replan, options)
            if disturb:
                stressed[replan].append(study)
            found = share([study])
            faults = [f"{found:.0%} < {least:.0%}"] if found < least else []
            low, high = wilson_interval(study.feasible, len(study.trials))
            charges = [trial.charge_fraction for trial in study.trials]
            misses += bool(faults)
            shown = (
                source,
                f"default, {disturb}" if disturb else "default",
                "yes" if replan else "no",
                f"{study.feasible}/{len(study.trials)}",
                f"{low:.3f}-{high:.3f}",
                f"{min(charges):.2f}, {statistics.median(charges):.2f}",
                ", ".join(f"{n} {cause}" for cause, n in causes(study).items()),
                verdict(faults),
            )
            print(" | ".join(shown), flush=True)
    faults = gain_faults(stressed[False], stressed[True])
    gain = share(stressed[True]) - share(stressed[False])
    print(f"both | gain by replanning | {gain:+.1%} | {verdict(faults)}")
    same = repeats_here(options)
    faults = [] if same else ["another log"]
    print(f"{DISTURBED_SCENES[0]} | by a worker and here | {verdict(faults)}")
    return misses + (gain < VISIBLE_GAIN) + (not same)


def share(studies: list[Study]) -> float:
    """Return the share of feasible trials of all studies."""
    trials = sum(len(study.trials) for study in studies)
    return sum(study.feasible for study in studies) / trials


def gain_faults(alone: list[Study], replanned: list[Study]) -> list[str]:
    """Return what is wrong with what replanning gains over all scenes.

    A scene whose plans carry more resistance anyway leaves nothing to be gained.
    """
    gain = share(replanned) - share(alone)
    return [f"{gain:+.0%} by replanning"] if gain < VISIBLE_GAIN else []


def study_of(
    source: str, disturb: str, replan: bool, options: argparse.Namespace
) -> Study:
    """Return all trials of one row, making those that are missing.

    They are spread evenly over the plans; no two have the same disturbance.
    """
    per_plan = options.trials // len(options.plan_seeds)
    trials: list[Trial] = []
    for number, seed in enumerate(options.plan_seeds):
        with planned_run(source, seed, options) as run:
            driven = replace(run, arguments=replace(run.arguments, replan=replan))
            study = study_robustness(
                driven,
                trials=per_plan,
                seed=number * per_plan,
                disturb=disturb,
                workers=options.workers,
            )
        trials += study.trials
    return Study(options=study.options, trials=tuple(trials))


@contextmanager
def planned_run(source: str, seed: int, options: argparse.Namespace) -> Iterator[Run]:
    """Open the run folder of one plan, made if it is missing."""
    scene = mrmg.load_scene(source)
    folder = RunFolder(options.runs / f"{source}-s{seed}")
    with folder.opened_for_writing():
        run = Run(scene=scene, arguments=RunArguments(seed=seed), folder=folder)
        run.ensure(Step.PLAN)
        yield run


def repeats_here(options: argparse.Namespace) -> bool:
    """Tell whether this process drives a worker's first trial to the last bit."""
    source = DISTURBED_SCENES[0]
    trial = study_of(source, "", False, options).trials[0]
    with planned_run(source, options.plan_seeds[0], options) as run:
        arguments = replace(run.arguments, disturb="", disturb_seed=trial.seed)
        again = drive_as(run.scene, run.plan(), arguments)
    return again.log.digest == trial.log_digest


def causes(study: Study) -> dict[str, int]:
    """Return how many trials failed by each cause; one may fail by several."""
    return Counter(cause for trial in study.trials for cause in trial.causes)


def verdict(faults: list[str]) -> str:
    """Return the last cell of a row."""
    return f"MISSES: {', '.join(faults)}" if faults else "holds"


if __name__ == "__main__":
    sys.exit(main())
