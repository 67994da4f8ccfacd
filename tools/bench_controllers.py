"""Whether the tracking controller matters: the same plans under all of them.

Each scene is planned once, and driven by each controller without disturbance, with the
default one, and with a harsh one (grip -40 %, delay 0.1 s, position noise 5 cm), the
latter two with a seed a trial, the same for all controllers. A trial is feasible when
all goals are visited without contact and no battery falls below its reserve. Tracking
is the distance from the plan at the fleet's shared clock: rms over robots and the worst
moment, as medians over the trials; clearance the least distance to an obstacle and
between robots, worst of the trials; energy measured over planned; time that of a call
on its processor and how much longer than planned the mission took; the share of the
MPC's calls in which a bound was active shows how often it did more than an unbounded
(LQR-like) solve.

Rows of --json: `scene`, `disturbance`, `controller`, `trials`, `feasible`, `rms_m`,
`max_m`, `obstacle_m`, `robots_m`, `energy_pct`, `call_ms`, `late_s`, `bounded_pct`,
`failures` by cause. `totals` has one row a disturbance and controller, over all scenes.
"""

from __future__ import annotations

import argparse
import statistics
from collections import Counter
from collections.abc import Sequence
from functools import partial
from itertools import product

import numpy as np
from protocol import Row, Trials, add_file_options, run, versions, write_document

import mrmg
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.controller import controller_names
from mrmg.simulation.disturbance_spec import parse_disturbance
from mrmg.verification.distances import obstacle_distance, robot_distance

SCENES = ("scene1", "scene4", "scene6", "hills")
DISTURBANCES = {
    "none": None,
    "default": "",
    "harsh": "none,friction=-40%,delay=100ms,position_noise=5cm",
}
COLUMNS = (
    ("rms_m", 4), ("max_m", 3), ("obstacle_m", 3), ("robots_m", 3), ("energy_pct", 2),
    ("call_ms", 3), ("late_s", 2), ("bounded_pct", 2),
)  # fmt: skip
"""Figures of a line, and how many decimals are printed."""

WORST = {"obstacle_m": min, "robots_m": min}
"""What is taken of a figure over trials where it is not the median."""


def main() -> int:
    """Run the bench; return 1 if an undisturbed mission fails under the default."""
    options = parse_options()
    print(f"{__doc__}\n{versions()}", flush=True)
    finished = Trials(options.output, plan_seed=options.plan_seed)
    print(
        " | ".join(["scene", "disturbance", "controller", "feasible", *dict(COLUMNS)])
    )
    trials: list[Row] = []
    for name in options.scenes:
        scene = mrmg.load_scene(name)
        plan = mrmg.plan(scene, seed=options.plan_seed).plan
        if plan is None:
            raise SystemExit(f"{name}: no plan found")
        for kind, controller in product(DISTURBANCES, options.controllers):
            own = []
            for seed in range(1 if kind == "none" else options.trials):
                drive = partial(driven, scene, plan, controller, kind, seed)
                key = {"scene": name, "kind": kind, "controller": controller}
                row = finished.row(drive, **key, digest=scene.digest, seed=seed)
                own.append({**row, **key})
            print_row(summary(own))
            trials += own
    rows, totals = [], []
    for kind, controller in product(DISTURBANCES, options.controllers):
        own = [
            item
            for item in trials
            if (item["kind"], item["controller"]) == (kind, controller)
        ]
        rows += [
            summary([item for item in own if item["scene"] == name])
            for name in options.scenes
        ]
        totals.append({**summary(own), "scene": "all"})
    print()
    for row in totals:
        print_row(row)
    calm = [row for row in totals if row["disturbance"] == "none"]
    ok = all(row["feasible"] == row["trials"] for row in calm)
    write_document(options, "bench_controllers", rows, ok, totals=totals)
    return 0 if ok else 1


def driven(scene: Scene, plan: Plan, controller: str, kind: str, seed: int) -> Row:
    """Return what one drive came to."""
    spec = DISTURBANCES[kind]
    disturbance = None
    if spec is not None:
        robots = [robot.id for robot in scene.robots]
        disturbance = parse_disturbance(spec).draw(seed, robots)
    log = mrmg.execute(scene, plan, controller=controller, disturbance=disturbance)
    account = mrmg.audit(scene, plan, log)
    offset_m = np.linalg.norm(log.state[..., :2] - log.reference[..., :2], axis=-1)
    clearances = [
        obstacle_distance(scene, robot, poses).min()
        for robot, poses in zip(scene.robots, log.state, strict=True)
    ]
    branches = [log.timing["controller_ms"][name] for name in ("riccati", "qp")]
    calls = [branch["calls"] if branch else 0 for branch in branches]
    planned_J, measured_J = account.planned.total_J(), account.measured.total_J()
    return {
        "feasible": account.mission_ok,
        "causes": list(account.causes),
        "rms_m": float(np.sqrt(np.mean(offset_m**2))),
        "max_m": float(offset_m.max()),
        "obstacle_m": float(min(clearances)),
        "robots_m": float(robot_distance(scene.robots, list(log.state)).min()),
        "energy_pct": 100.0 * (measured_J - planned_J) / planned_J,
        "call_ms": log.timing["controller_ms"]["median"],
        "late_s": float(log.time_s[-1]) - plan.makespan_s,
        "bounded_pct": 100.0 * calls[1] / sum(calls) if any(calls) else None,
    }


def summary(trials: Sequence[Row]) -> Row:
    """Return one line of the table."""
    causes = Counter(cause for item in trials for cause in item["causes"])
    row: Row = {
        "scene": trials[0]["scene"],
        "disturbance": trials[0]["kind"],
        "controller": trials[0]["controller"],
        "trials": len(trials),
        "feasible": sum(item["feasible"] for item in trials),
        "failures": dict(causes),
    }
    for name, _ in COLUMNS:
        values = [item[name] for item in trials if item[name] is not None]
        row[name] = WORST.get(name, statistics.median)(values) if values else None
    return row


def print_row(row: Row) -> None:
    """Print one line of the table."""
    cells = [row["scene"], row["disturbance"], row["controller"]]
    cells.append(f"{row['feasible']}/{row['trials']}")
    for name, digits in COLUMNS:
        cells.append("-" if row[name] is None else f"{row[name]:.{digits}f}")
    failures = (f"{count} x {cause}" for cause, count in row["failures"].items())
    print(" | ".join([*cells, ", ".join(failures)]), flush=True)


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        prog="tools/bench_controllers",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--scenes", nargs="*", default=list(SCENES), metavar="SCENE")
    names = controller_names()
    parser.add_argument(
        "--controllers", nargs="*", default=names, choices=names, metavar="NAME"
    )
    parser.add_argument(
        "--trials", type=int, default=10, help="of each disturbance, default 10"
    )
    parser.add_argument("--plan-seed", type=int, default=0, help="default 0")
    add_file_options(parser)
    return parser.parse_args()


if __name__ == "__main__":
    run(main)
