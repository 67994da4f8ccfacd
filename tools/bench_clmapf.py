"""Plan the CL-MAPF benchmarks of a folder; print a table by cell of maps and cars.

Cars of 3 x 2 m with a smallest turning radius of 3 m, each with a goal pose of its own
(L. Wen, Y. Liu, H. Li: CL-MAPF, Robotics and Autonomous Systems 150, 2022). Protocol:
one process, one thread; the first plan counts as it is found, unrefined, with the
makespan as the objective, and its time is that of `plan_mission`, with all kernels
loaded. Cars are of second order: |v| <= 2.118 m/s, |u1| <= 2 m/s^2, |u2| <= 1 rad/s,
wheelbase 2 m. Every car must be at rest within 0.5 m and 0.2 rad of its goal at the
end, its rear axle must stay within the map, and nothing may overlap at any time, in
between steps and with cars that have arrived included: `mrmg.verify` judges that, with
true rectangles.

Files with a car that overlaps a disc where it starts are listed and do not count. Where
a car starts nearer to a disc than the margin that is asked for, the margin of that file
is what there is.

The figures of CL-CBS, from `reference.csv` in the folder if it is there, are medians
over the files that it solved, and so are ours beside them; its steps count as 1 s.
Exit code 1 if less than 99 % are solved within --limit.

With --draw, seeded missions take the place of files: 50 cars on 100 x 100 m without
discs, 2 m apart where they start and where they end, on ways twice as long as there.

Finished plans are kept in --output FILE: the same command goes on from there after an
interruption. Rows of --json: `cell`, `files`, `solved` of `runs`, `plan_s_median`,
`plan_s_worst`, `makespan_s_median`, and over the files that CL-CBS solved
`reference_solved`, `plan_s`, `reference_plan_s`, `makespan_s`, `reference_makespan_s`;
`overlapping` lists the files that do not count.
"""

from __future__ import annotations

import argparse
import csv
import math
import statistics
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import shapely
import yaml
from protocol import Row, Trials, add_file_options, run, seed_range, write_document

import mrmg
from mrmg import storage
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.parameters import PATH_FOLLOWING
from mrmg.planning.preparation import compile_kernels, load_kernels
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "clmapf"

DISC_M = 0.8
"""Radius of the obstacles [m]."""

FRONT_M, BACK_M, HALF_WIDTH_M = 2.0, 1.0, 1.0
"""How far a car reaches ahead of its rear axle, behind it and to its sides [m]."""

GOAL_M, GOAL_RAD = 0.5, 0.2
"""How near to its goal a car must end [m], [rad]."""

MARGIN_M = 0.05
"""Distance kept from obstacles [m]: with discs as round as these, no car that keeps
0.01 m at two steps of 0.1 s touches one in between."""

PARAMS = PlannerParams(
    samples=100,
    obstacle_margin_m=MARGIN_M,
    robot_margin_m=0.22,
    improvements=0,
    refinements=0,
)

CAR = {
    "format": 1,
    "motion_model": "car",
    "wheelbase": 2.0,
    "footprint": [
        [-BACK_M, -HALF_WIDTH_M], [FRONT_M, -HALF_WIDTH_M],
        [FRONT_M, HALF_WIDTH_M], [-BACK_M, HALF_WIDTH_M],
    ],
    "height": 1.5, "track": 1.6, "mass": 1000.0,
    "wheel": {"radius": 0.3, "inertia": 1.0, "count": 4, "mass": 15.0},
    "planning_share": 1.0, "rolling_coefficient": 0.02, "turning_coefficient": 0.0,
    "friction_coefficient": 1.0, "drive_efficiency": 1.0,
    "regeneration_efficiency": 0.0, "idle_power": 0.0, "battery_capacity": 1e9,
    "limits": {
        "v_min": -2.118, "v_max": 2.118, "w_max": math.atan(2.0 / 3.0),
        "u1_max": 2.0, "u2_max": 1.0,
    },
}  # fmt: skip

DRAWN_CARS, DRAWN_SIDE_M, DRAWN_APART_M = 50, 100, 2.0
"""Of a mission that is drawn: its cars, side of its map, and how far apart they are."""

ENOUGH = 0.99
"""Share of the runs that must be solved."""


def main() -> int:
    """Run the bench; return 1 if too few runs were solved."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_clmapf")
    parser.add_argument("--folder", type=Path, default=FOLDER)
    parser.add_argument("--only", default="", help="part of the file's name")
    parser.add_argument(
        "--seeds", type=seed_range, default="0-2", help="first-last, default 0-2"
    )
    parser.add_argument(
        "--limit", type=float, default=60.0, metavar="S", help="of a plan, default 60"
    )
    parser.add_argument("--draw", type=seed_range, help="first-last of drawn missions")
    add_file_options(parser)
    options = parser.parse_args()
    if options.draw:
        contents = {f"map_drawn_ex{number}": drawn(number) for number in options.draw}
    else:
        files = sorted(options.folder.glob("*.yaml"))
        contents = {path.stem: yaml.safe_load(path.read_text()) for path in files}
    contents = {name: one for name, one in contents.items() if options.only in name}
    if not contents:
        print(f"no benchmark files in {options.folder}", file=sys.stderr)
        return 1
    print(__doc__)
    overlapping = [name for name, one in contents.items() if overlap_m(one) > 0.0]
    for name in overlapping:
        print(f"not counted, a car overlaps a disc where it starts: {name}")
    counted = [name for name in contents if name not in overlapping]
    compile_kernels(PATH_FOLLOWING)
    load_kernels(PATH_FOLLOWING)
    trials = Trials(options.output, limit=options.limit)
    with tempfile.TemporaryDirectory() as folder:
        model = write_model(Path(folder))
        rows = [
            trials.row(
                partial(planned, name, contents[name], model, seed, options.limit),
                file=name,
                digest=storage.bytes_digest(yaml.safe_dump(contents[name]).encode()),
                seed=seed,
            )
            for name in counted
            for seed in options.seeds
        ]
    table = tabulate(rows, read_reference(options.folder))
    solved = sum(row["ok"] for row in rows)
    ok = bool(rows) and solved >= ENOUGH * len(rows)
    print(f"solved {solved} of {len(rows)}")
    listed = [{"file": name} for name in overlapping]
    write_document(options, "bench_clmapf", table, ok, overlapping=listed)
    return 0 if ok else 1


def body(pose: Sequence[float]) -> shapely.Polygon:
    """Return a car's rectangle at a pose of a file, whose yaw is clockwise."""
    x, y, yaw = pose
    corners = np.array(CAR["footprint"])
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    return shapely.Polygon(corners @ turn + (x, y))


def drawn(number: int) -> dict[str, Any]:
    """Return a mission as a file would have it."""
    rng = np.random.default_rng(number)
    cars = enumerate(zip(drawn_poses(rng), drawn_poses(rng), strict=True))
    agents = [{"name": f"agent{i}", "start": a, "goal": b} for i, (a, b) in cars]
    size = [DRAWN_SIDE_M, DRAWN_SIDE_M]
    return {"agents": agents, "map": {"dimensions": size, "obstacles": []}}


def drawn_poses(rng: np.random.Generator) -> list[list[float]]:
    """Return poses of all cars, (x, y, yaw), which stay clear of each other."""
    poses, bodies = list[list[float]](), list[shapely.Polygon]()
    while len(poses) < DRAWN_CARS:
        x, y = rng.integers(2, DRAWN_SIDE_M - 1, 2)
        pose = [float(x), float(y), float(rng.choice((-1.57, 0.0, 1.57, 3.14)))]
        if all(body(pose).distance(one) >= DRAWN_APART_M for one in bodies):
            poses.append(pose)
            bodies.append(body(pose))
    return poses


def start_clearance_m(content: Mapping[str, Any]) -> float:
    """Return how near to a disc any car starts [m], negative where they overlap."""
    centers = np.array(content["map"]["obstacles"] or [], float).reshape(-1, 2)
    discs = shapely.points(centers)
    if not len(discs):
        return math.inf
    bodies = [body(agent["start"]) for agent in content["agents"]]
    return float(min(shapely.distance(discs, one).min() for one in bodies)) - DISC_M


def overlap_m(content: Mapping[str, Any]) -> float:
    """Return how deep a car starts in a disc [m]; 0 if none does."""
    return max(0.0, -start_clearance_m(content))


def margin_of(content: Mapping[str, Any]) -> float:
    """Return the distance that is kept from obstacles [m]."""
    return min(MARGIN_M, max(0.0, 0.5 * start_clearance_m(content)))


def write_model(folder: Path) -> str:
    """Write the car's model; return its folder."""
    base = folder / "clmapf_car"
    base.mkdir(exist_ok=True)
    (base / "robot.yaml").write_text(yaml.safe_dump(CAR))
    return str(base)


def benchmark_scene(name: str, content: Mapping[str, Any], model: str) -> Scene:
    """Return a file as a scene.

    Bodies may reach over the map's edge as far as a car reaches beside its rear axle,
    which therefore stays on the map.
    """
    width, height = (float(x) for x in content["map"]["dimensions"])
    rim = HALF_WIDTH_M + margin_of(content)
    document = {
        "format": 1,
        "name": name,
        "bounds": [-rim, -rim, width + rim, height + rim],
        "obstacles": [
            {"circle": {"center": list(map(float, center)), "radius": DISC_M}}
            for center in content["map"]["obstacles"] or []
        ],
        "robots": [
            {
                "id": agent["name"],
                "model": model,
                "pose": [*map(float, agent["start"][:2]), -float(agent["start"][2])],
                "finish": {
                    "circle": {
                        "center": [float(x) for x in agent["goal"][:2]],
                        "radius": GOAL_M,
                    },
                    "heading": -float(agent["goal"][2]),
                    "heading_tolerance": GOAL_RAD,
                },
            }
            for agent in content["agents"]
        ],
        "objective": "makespan",
    }
    return scene_from_document(document, source=name)


def planned(
    name: str, content: Mapping[str, Any], model: str, seed: int, limit_s: float
) -> Row:
    """Plan a file with one seed and judge the answer; return its row."""
    scene = benchmark_scene(name, content, model)
    params = replace(PARAMS, obstacle_margin_m=margin_of(content))
    began = time.perf_counter()
    result = plan_mission(scene, seed=seed, params=params)
    plan_s = time.perf_counter() - began
    row: Row = {
        "file": name,
        "cell": name.rpartition("_ex")[0].removeprefix("map_"),
        "seed": seed,
        "plan_s": plan_s,
        "makespan_s": None,
        "ok": False,
        "fault": result.reason,
    }
    if result.plan is not None:
        verdict = mrmg.verify(scene, result.plan)
        fault = f"took {plan_s:.1f} s" if plan_s > limit_s else ""
        if verdict.violations:
            fault = verdict.violations[0].message
        ok = verdict.ok and plan_s <= limit_s
        row.update(makespan_s=result.plan.makespan_s, ok=ok, fault=fault)
    if not row["ok"]:
        print(f"{name}, seed {seed}: {row['fault']}", file=sys.stderr)
    return row


def read_reference(folder: Path) -> dict[str, tuple[float, float]]:
    """Return time [s] and makespan [steps] of CL-CBS by file that it solved."""
    path = folder / "reference.csv"
    if not path.exists():
        return {}
    with path.open(newline="") as file:
        return {
            row["file"].removesuffix(".yaml"): (
                float(row["wall_s"]),
                float(row["makespan_steps"]),
            )
            for row in csv.DictReader(file)
            if row["solved"] == "1"
        }


def tabulate(
    rows: Sequence[Row], reference: Mapping[str, tuple[float, float]]
) -> list[Row]:
    """Print and return a line for each cell."""
    print(
        "cell | solved | plan_s median | worst | makespan_s median | of files that "
        "CL-CBS solved: plan_s, its | makespan_s, its steps"
    )
    table = []
    for cell in dict.fromkeys(row["cell"] for row in rows):
        own = [row for row in rows if row["cell"] == cell]
        done = [row for row in own if row["ok"]]
        both = [row for row in done if row["file"] in reference]
        known = [reference[name] for name in sorted({row["file"] for row in both})]
        line: Row = {
            "cell": cell,
            "files": len({row["file"] for row in own}),
            "solved": len(done),
            "runs": len(own),
            "plan_s_median": median(row["plan_s"] for row in own),
            "plan_s_worst": max(row["plan_s"] for row in own),
            "makespan_s_median": median(row["makespan_s"] for row in done),
            "reference_solved": len(known),
            "plan_s": median(row["plan_s"] for row in both),
            "reference_plan_s": median(one[0] for one in known),
            "makespan_s": median(row["makespan_s"] for row in both),
            "reference_makespan_s": median(one[1] for one in known),
        }
        table.append(line)
        print(
            f"{cell} | {line['solved']}/{line['runs']} | {shown(line['plan_s_median'])}"
            f" | {shown(line['plan_s_worst'])} | {shown(line['makespan_s_median'])} | "
            f"{shown(line['plan_s'])}, {shown(line['reference_plan_s'])} | "
            f"{shown(line['makespan_s'])}, {shown(line['reference_makespan_s'])}"
        )
    return table


def median(values: Any) -> float | None:
    """Return the median, None of nothing."""
    found = list(values)
    return float(statistics.median(found)) if found else None


def shown(value: float | None) -> str:
    """Return a number with two decimals, a dash for None."""
    return "-" if value is None else f"{value:.2f}"


if __name__ == "__main__":
    run(main)
