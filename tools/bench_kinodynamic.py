"""Plan the kinodynamic multi-robot benchmarks of a folder; print a table.

Protocol: one process, one thread; every file is planned once before anything is timed.
The objective is the makespan, and the first plan counts as it is found, unrefined.
Every robot must be at rest within its own goal at the end (0.5 m; unicycles within
0.2 m and 0.2 rad of the pose), and nothing may overlap at any time, in between steps
and with robots that have arrived included: `mrmg.verify` judges that, with true
headings. As the files bound only the centres of robots, the bounds are wider by half a
robot, so that centres stay within the file's. A file that is called infeasible must be
answered so.

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
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from protocol import Row, Trials, add_file_options, run, seed_range, write_document

import mrmg
from mrmg import storage
from mrmg.planning import PlannerParams, plan_mission
from mrmg.plans import PlanStatus
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "kinodynamic"

PARAMS = PlannerParams(
    samples=600,
    obstacle_margin_m=0.08,
    robot_margin_m=0.15,
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
    add_file_options(parser)
    options = parser.parse_args()
    files = sorted(p for p in options.folder.glob("*.yaml") if options.only in p.name)
    if not files:
        print(f"no benchmark files in {options.folder}", file=sys.stderr)
        return 1
    print(__doc__)
    trials = Trials(options.output)
    print("file | solved | plan_s median | p95 | makespan_s median | / straight line")
    with tempfile.TemporaryDirectory() as folder:
        table = [bench(path, options.seeds, Path(folder), trials) for path in files]
    ok = all(row["solved"] == row["runs"] for row in table)
    write_document(options, "bench_kinodynamic", table, ok)
    return 0 if ok else 1


def bench(path: Path, seeds: range, folder: Path, trials: Trials) -> Row:
    """Plan one file for all seeds; print and return its row."""
    scene = benchmark_scene(path, folder)
    ready = cache(partial(plan_mission, scene, seed=seeds.start, params=PARAMS))
    digest = storage.bytes_digest(path.read_bytes())
    rows = []
    for seed in seeds:
        make = partial(planned, path.stem, scene, seed, ready)
        rows.append(trials.row(make, file=path.stem, digest=digest, seed=seed))
        if not rows[-1]["ok"]:
            print(f"seed {seed}: {rows[-1]['fault']}", file=sys.stderr)
    times = sorted(row["plan_s"] for row in rows)
    makespans = [row["makespan_s"] for row in rows if row["makespan_s"] is not None]
    middle_s = statistics.median(makespans) if makespans else None
    infeasible = is_infeasible(path.stem)
    line: Row = {
        "file": path.stem,
        "solved": sum(row["ok"] for row in rows),
        "runs": len(rows),
        "plan_s_median": statistics.median(times),
        "plan_s_p95": times[int(0.95 * (len(times) - 1))],
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


def planned(name: str, scene: Scene, seed: int, ready: Callable[[], Any]) -> Row:
    """Plan a file with one seed and judge the answer; return its row."""
    ready()
    began = time.perf_counter()
    result = plan_mission(scene, seed=seed, params=PARAMS)
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
    """Return the longest way as the crow flies at top speed [s]."""
    times = []
    for robot in scene.robots:
        assert robot.finish is not None
        way = np.hypot(*(np.array(robot.pose[:2]) - robot.finish.region.center))
        times.append((way - 0.5) / robot.model.limits.v_max_m_s)
    return float(max(times))


def benchmark_scene(path: Path, folder: Path) -> Scene:
    """Return a benchmark file as a scene; writes robot models into `folder`."""
    content = yaml.safe_load(path.read_text())
    world = content["environment"]
    robots, half = [], 0.0
    for number, entry in enumerate(content["robots"]):
        model, width = robot_model(entry, folder)
        half = max(half, 0.5 * width + PARAMS.obstacle_margin_m)
        robots.append(robot_entry(f"r{number}", entry, model))
    low, high = world["min"], world["max"]
    document = {
        "format": 1,
        "name": path.stem,
        "bounds": [*(float(x) - half for x in low), *(float(x) + half for x in high)],
        "obstacles": [
            {"box": {"center": list(map(float, box["center"])),
                     "size": list(map(float, box["size"]))}}
            for box in world["obstacles"]
        ],
        "robots": robots,
        "objective": "makespan",
    }  # fmt: skip
    return scene_from_document(document, source=str(path), trust_code=True)


def robot_entry(name: str, entry: dict[str, Any], model: str) -> dict[str, Any]:
    """Return a robot of the scene: where it starts and must end."""
    start, goal = list(map(float, entry["start"])), list(map(float, entry["goal"]))
    # Cars: x y v phi theta; unicycles: x y theta v omega.
    car = "car" in entry["type"]
    yaw = start[4] if car else start[2]
    radius = 0.5 if car else (0.05 if "first" in entry["type"] else 0.2)
    finish: dict[str, Any] = {"circle": {"center": goal[:2], "radius": radius}}
    if not car:
        finish["heading"] = goal[2]
    return {"id": name, "model": model, "pose": [*start[:2], yaw], "finish": finish}


def robot_model(entry: dict[str, Any], folder: Path) -> tuple[str, float]:
    """Write a robot's model; return its folder and its longer side [m]."""
    kind = entry["type"]
    length, width = entry.get("size", (0.5, 0.25))
    base = folder / f"{kind}_{length}_{width}"
    base.mkdir(exist_ok=True)
    car = "car" in kind
    rate = 1.0 if car else 0.25
    document = {
        **COMMON,
        "motion_model": "car" if car else "unicycle",
        "wheelbase": 0.5,
        "footprint": [
            [sx * length / 2, sy * width / 2]
            for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ],
        "limits": {
            **LIMITS["car" if car else "unicycle"], "u1_max": rate, "u2_max": rate,
        },
    }  # fmt: skip
    if "first_order" in kind:
        document["motion_model"] = "motion.py"
        document["limits"] |= {"u1_max": 0.5, "u2_max": 0.5}
        (base / "motion.py").write_text(FIRST_ORDER)
    (base / "robot.yaml").write_text(yaml.safe_dump(document))
    return str(base), float(max(length, width))


if __name__ == "__main__":
    run(main)
