"""Plan the kinodynamic multi-robot benchmarks of a folder; print a table.

Protocol: one process, one thread; every file is planned once before anything is timed.
The objective is the makespan, and the first plan counts as it is found, unrefined.
Every robot must be at rest within its own goal at the end (0.5 m; unicycles within
0.2 m and 0.2 rad of the pose), and nothing may overlap at any time, in between steps
and with robots that have arrived included: `mrmg.verify` judges that, with true
headings. As the files bound only the centres of robots, the bounds are wider by half
the shorter side of a robot, so that centres stay within the file's. A file that is
called infeasible must be answered so. `--size` makes all lengths so many times as long,
margins and ways in a second too, and with `--slower` all takes so many times as long.

Finished plans are kept in --output FILE: the same command goes on from there after an
interruption. Rows of --json: `file`, `solved` of `runs`, `plan_s_median`, `plan_s_p95`,
`makespan_s_median`, `to_straight_line`; for a file that is called infeasible `status`
and `reason` of the last answer.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from mission_tables import p95
from protocol import Row, Trials, add_file_options, run, seed_range, write_document

import mrmg
from mrmg import storage
from mrmg.planning import PlannerParams, plan_mission
from mrmg.plans import PlanStatus
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "kinodynamic"

OBSTACLE_MARGIN_M, ROBOT_MARGIN_M = 0.08, 0.15

PARAMS = PlannerParams(
    samples=600,
    obstacle_margin_m=OBSTACLE_MARGIN_M,
    robot_margin_m=ROBOT_MARGIN_M,
    improvements=0,
    refinements=0,
    trees=40,
)

COMMON = {
    "format": 1, "height": 0.3, "track": 0.3, "mass": 20.0,
    "wheel": {"radius": 0.1, "inertia": 0.01, "count": 4, "mass": 0.5},
    "planning_share": 1.0, "rolling_coefficient": 0.03, "turning_coefficient": 0.0,
    "friction_coefficient": 1.0, "drive_efficiency": 1.0,
    "regeneration_efficiency": 0.0, "idle_power": 0.0, "battery_capacity": 1e6,
}  # fmt: skip

LIMITS = {
    "car": {"v_min": -1.0, "v_max": 1.0, "w_max": float(np.pi / 3)},
    "unicycle": {"v_min": -0.5, "v_max": 0.5, "w_max": 0.5},
}

IN_LENGTHS = ("v_min", "v_max", "u1_max")
PER_TIME = {
    "car": {"v_min": 1, "v_max": 1, "w_max": 0, "u1_max": 2, "u2_max": 1},
    "unicycle": {"v_min": 1, "v_max": 1, "w_max": 1, "u1_max": 2, "u2_max": 2},
    "motion.py": {"v_min": 1, "v_max": 1, "w_max": 1, "u1_max": 1, "u2_max": 1},
}
"""Limits that are lengths over powers of time, and these powers by motion model."""

FIRST_ORDER = Path(__file__).with_name("first_order.py").read_text()
"""Motion of the first-order unicycles, as a user would write it."""


def main() -> int:
    """Run the bench; return 1 if any run failed."""
    parser = argparse.ArgumentParser(
        description=__doc__, prog="tools/bench_kinodynamic"
    )
    parser.add_argument("--folder", type=Path, default=FOLDER)
    parser.add_argument("--only", default="", help="part of the file's name")
    parser.add_argument(
        "--seeds", type=seed_range, default="0-9", help="first-last, default 0-9"
    )
    parser.add_argument("--size", type=float, default=1.0, help="of all lengths")
    parser.add_argument("--slower", type=float, default=1.0, help="of all times")
    add_file_options(parser)
    options = parser.parse_args()
    scale = Scale(options.size, options.slower)
    files = sorted(p for p in options.folder.glob("*.yaml") if options.only in p.name)
    if not files:
        print(f"no benchmark files in {options.folder}", file=sys.stderr)
        return 1
    print(__doc__)
    trials = Trials(options.output)
    print("file | solved | plan_s median | p95 | makespan_s median | / straight line")
    with tempfile.TemporaryDirectory() as folder:
        table = [
            bench(path, options.seeds, Path(folder), trials, scale) for path in files
        ]
    ok = all(row["solved"] == row["runs"] for row in table)
    write_document(options, "bench_kinodynamic", table, ok)
    return 0 if ok else 1


@dataclass(frozen=True, slots=True)
class Scale:
    """How much longer a file's lengths are made, and how much slower its robots.

    Attributes:
        size: multiple of all lengths.
        slower: multiple of all times.
    """

    size: float = 1.0
    slower: float = 1.0

    @property
    def params(self) -> PlannerParams:
        """Parameters of planning."""
        return replace(
            PARAMS,
            obstacle_margin_m=self.size * OBSTACLE_MARGIN_M,
            robot_margin_m=self.size * ROBOT_MARGIN_M,
        )


AS_IT_IS = Scale()


def bench(
    path: Path, seeds: range, folder: Path, trials: Trials, scale: Scale = AS_IT_IS
) -> Row:
    """Plan one file for all seeds; print and return its row."""
    scene = benchmark_scene(path, folder, scale)
    ready = cache(partial(plan_mission, scene, seed=seeds.start, params=scale.params))
    digest = storage.bytes_digest(path.read_bytes())
    rows = []
    for seed in seeds:
        make = partial(planned, path.stem, scene, seed, ready, scale)
        asked = {} if scale == AS_IT_IS else asdict(scale)
        row = trials.row(make, file=path.stem, digest=digest, seed=seed, **asked)
        rows.append(row)
        if not rows[-1]["ok"]:
            print(f"seed {seed}: {rows[-1]['fault']}", file=sys.stderr)
    times = [row["plan_s"] for row in rows]
    makespans = [row["makespan_s"] for row in rows if row["makespan_s"] is not None]
    middle_s = statistics.median(makespans) if makespans else None
    infeasible = is_infeasible(path.stem)
    line: Row = {
        "file": path.stem,
        "solved": sum(row["ok"] for row in rows),
        "runs": len(rows),
        "plan_s_median": statistics.median(times),
        "plan_s_p95": p95(times),
        "makespan_s_median": middle_s,
        "to_straight_line": middle_s and middle_s / straight_line_s(scene),
        "status": rows[-1]["status"] if infeasible else None,
        "reason": rows[-1]["reason"] if infeasible else None,
    }
    cells = "{file} | {solved}/{runs} | {plan_s_median:.2f} | {plan_s_p95:.2f}"
    if infeasible:
        cells += " | {status}: {reason}"
    elif makespans:
        cells += " | {makespan_s_median:.1f} | {to_straight_line:.2f}"
    print(cells.format(**line), flush=True)
    return line


def is_infeasible(name: str) -> bool:
    """Return whether a benchmark must be answered by its infeasibility."""
    return name.startswith("infeasible")


def planned(
    name: str, scene: Scene, seed: int, ready: Callable[[], Any], scale: Scale
) -> Row:
    """Plan a file with one seed and judge the answer; return its row."""
    ready()
    began = time.perf_counter()
    result = plan_mission(scene, seed=seed, params=scale.params)
    row: Row = {
        "file": name,
        "seed": seed,
        "status": result.status.value,
        "reason": result.reason,
        "plan_s": time.perf_counter() - began,
        "makespan_s": None,
        "ok": is_infeasible(name) and result.status is PlanStatus.INFEASIBLE,
        "fault": result.reason,
    }
    if result.plan is not None and not is_infeasible(name):
        verdict = mrmg.verify(scene, result.plan)
        fault = verdict.violations[0].message if verdict.violations else ""
        row.update(makespan_s=result.plan.makespan_s, ok=verdict.ok, fault=fault)
    return row


def straight_line_s(scene: Scene) -> float:
    """Return the longest way as the crow flies into a finish at top speed [s]."""
    times = []
    for robot in scene.robots:
        assert robot.finish is not None
        center = np.array(robot.finish.region.center)
        way = np.hypot(*(np.array(robot.pose[:2]) - center))
        (radius_m,) = robot.finish.region.depth(center[None])
        times.append((way - radius_m) / robot.model.limits.v_max_m_s)
    return float(max(times))


def benchmark_scene(path: Path, folder: Path, scale: Scale = AS_IT_IS) -> Scene:
    """Return a benchmark file as a scene; writes robot models into `folder`."""
    size = scale.size
    content = yaml.safe_load(path.read_text())
    world = content["environment"]
    robots, half = [], 0.0
    for number, entry in enumerate(content["robots"]):
        model, width = robot_model(entry, folder, scale)
        half = max(half, 0.5 * width + OBSTACLE_MARGIN_M)
        robots.append(robot_entry(f"r{number}", entry, model, size))
    low, high = world["min"], world["max"]
    document = {
        "format": 1,
        "name": path.stem,
        "bounds": [
            *(size * (x - half) for x in low),
            *(size * (x + half) for x in high),
        ],
        "obstacles": [
            {"box": {"center": [size * x for x in box["center"]],
                     "size": [size * x for x in box["size"]]}}
            for box in world["obstacles"]
        ],
        "robots": robots,
        "objective": "makespan",
    }  # fmt: skip
    return scene_from_document(document, source=str(path), trust_code=True)


def robot_entry(
    name: str, entry: dict[str, Any], model: str, size: float
) -> dict[str, Any]:
    """Return a robot of the scene: where it starts and must end."""
    start, goal = list(map(float, entry["start"])), list(map(float, entry["goal"]))
    # Cars: x y v phi theta; unicycles: x y theta v omega.
    car = "car" in entry["type"]
    yaw = start[4] if car else start[2]
    radius = 0.5 if car else (0.05 if "first" in entry["type"] else 0.2)
    center = [size * x for x in goal[:2]]
    finish: dict[str, Any] = {"circle": {"center": center, "radius": size * radius}}
    if len(goal) > 2:  # of cars only x and y
        finish["heading"] = goal[2]
    pose = [size * start[0], size * start[1], yaw]
    return {"id": name, "model": model, "pose": pose, "finish": finish}


def robot_model(entry: dict[str, Any], folder: Path, scale: Scale) -> tuple[str, float]:
    """Write a robot's model; return its folder and its shorter side in the file."""
    kind = entry["type"]
    length, width = entry.get("size", (0.5, 0.25))
    size, slower = scale.size, scale.slower
    base = folder / f"{kind}_{length}_{width}_{size:g}_{slower:g}"
    base.mkdir(exist_ok=True)
    car = "car" in kind
    limits = {**LIMITS["car" if car else "unicycle"]}
    limits["u1_max"] = limits["u2_max"] = 1.0 if car else 0.25
    document = {
        **COMMON,
        "motion_model": "car" if car else "unicycle",
        "wheelbase": 0.5 * size,
        "footprint": [
            [size * sx * length / 2, size * sy * width / 2]
            for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ],
        "limits": limits,
    }  # fmt: skip
    if "first_order" in kind:
        document["motion_model"] = "motion.py"
        limits |= {"u1_max": 0.5, "u2_max": 0.5}
    for name, power in PER_TIME[str(document["motion_model"])].items():
        limits[name] *= (size if name in IN_LENGTHS else 1.0) / slower**power
        (base / "motion.py").write_text(FIRST_ORDER)
    (base / "robot.yaml").write_text(yaml.safe_dump(document))
    return str(base), float(min(length, width))


if __name__ == "__main__":
    run(main)
