"""How far planned energy is off on a foreign plant, and what calibration mends.

Every scene is planned with the robots' own parameters and driven on the plant; then
every robot model is calibrated on it, as `mrmg calibrate MODEL --plant NAME` does, and
the scenes are planned and driven again with what was found. Errors are those of
measured against planned energy, robot by robot. A mission is feasible when all goals
are visited without contact and no battery falls below its reserve; how far planned
energy is off does not count for that. Plans keep the default state-of-charge margin.

A line of the table has, before and after calibration, the median and the worst error of
a scene's robots, and the feasible missions; the last line is of all scenes. The exit
code is 1 unless, after calibration, the median is at most 3 %, the worst robot at most
6 % and at least 95 % of the missions are feasible.

Rows of --json: `scene`, `robots`, `missions`, and for `before_` and `after_`:
`median_pct`, `worst_pct`, `signed_median_pct`, `feasible`. `models` has the calibrated
parameters: `model`, `parameter`, `was`, `found`, `low`, `high`.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial

from protocol import (
    Row,
    Trials,
    add_file_options,
    run,
    seed_range,
    versions,
    write_document,
)

import mrmg
from mrmg.energy.audit_record import MODEL_MISMATCH
from mrmg.scene.content import content_digest
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.simulation.plants import PLANTS
from mrmg.studies.calibration.calibrate import calibrate

SCENES = ("scene1", "scene2", "scene3", "scene4", "scene5", "scene6", "hills")
PARAMETERS = ("rolling_coefficient", "turning_coefficient", "wheel_inertia_kg_m2")
MEDIAN_PCT, WORST_PCT, FEASIBLE = 3.0, 6.0, 0.95


def main() -> int:
    """Run the bench; return 1 if a target is missed."""
    options = parse_options()
    print(f"{__doc__}\nplant {options.plant}; {versions()}", flush=True)
    trials = Trials(options.output, plant=options.plant)
    models: dict[str, Row] = {}
    missions: list[Row] = []
    print("\nscene | robots | before: median %, worst % | feasible | after | feasible")
    for name in options.scenes:
        scene = mrmg.load_scene(name)
        for model in {robot.model.name: robot.model for robot in scene.robots}.values():
            if model.name not in models:
                models[model.name] = trials.row(
                    partial(calibrated, model, options.plant),
                    calibrated=model.name,
                    digest=content_digest(model),
                )
        found = with_found(scene, models)
        own = []
        for seed in options.seeds:
            for stage, as_modelled in (("before", scene), ("after", found)):
                row = trials.row(
                    partial(mission, as_modelled, seed, options.plant),
                    scene=name,
                    digest=as_modelled.digest,
                    seed=seed,
                    stage=stage,
                )
                own.append({**row, "scene": name, "stage": stage})
        print_row(summary(name, own))
        missions += own
    rows = [
        summary(name, [row for row in missions if row["scene"] == name])
        for name in options.scenes
    ]
    total = summary("all", missions)
    print_row(total)
    parameters = [
        {"model": name, **item} for name, row in models.items() for item in row["found"]
    ]
    print("\nmodel | parameter | was | calibrated | 95 % interval")
    for item in parameters:
        print(
            f"{item['model']} | {item['parameter']} | {item['was']:.4g} | "
            f"{item['value']:.4g} | {item['low']:.4g} .. {item['high']:.4g}"
        )
    ok = holds(total)
    print("\nall targets hold" if ok else "\na target is MISSED")
    write_document(options, "bench_plant", [*rows, total], ok, models=parameters)
    return 0 if ok else 1


def calibrated(model: RobotModel, plant: str) -> Row:
    """Return what calibration on a plant finds of a model."""
    estimates = calibrate(model, plant=plant).estimates
    found = []
    for name in PARAMETERS:
        item = estimates[name]
        low, high = item.interval
        found.append(
            {
                "parameter": name,
                "was": item.was,
                "value": float(item.rounded()),
                "low": low,
                "high": high,
            }
        )
    return {"found": found}


def with_found(scene: Scene, models: dict[str, Row]) -> Scene:
    """Return a scene whose robots have calibrated parameters."""
    robots = []
    for robot in scene.robots:
        values = models[robot.model.name]["found"]
        changes = {item["parameter"]: item["value"] for item in values}
        model = replace(robot.model, **changes)
        robots.append(replace(robot, model=model))
    return replace(scene, robots=tuple(robots))


def mission(scene: Scene, seed: int, plant: str) -> Row:
    """Return what one mission came to: each robot's error, and whether it was done."""
    result = planned(scene, seed)
    if result.plan is None:
        return {"feasible": False, "errors_pct": [], "why": [result.reason]}
    log = mrmg.execute(scene, result.plan, plant=plant)
    account = mrmg.audit(scene, result.plan, log)
    return {
        "feasible": not set(account.causes) - {MODEL_MISMATCH},
        "errors_pct": [robot.measured_error_pct for robot in account.robots],
        "why": sorted(set(account.causes) - {MODEL_MISMATCH}),
    }


def planned(scene: Scene, seed: int) -> mrmg.PlanResult:
    """Return the plan of a scene."""
    return mrmg.plan(scene, seed=seed)


def summary(name: str, missions: Sequence[Row]) -> Row:
    """Return one line of the table."""
    row: Row = {"scene": name}
    for stage in ("before", "after"):
        own = [item for item in missions if item["stage"] == stage]
        errors = [error for item in own for error in item["errors_pct"]]
        row |= {"robots": len(errors), "missions": len(own)} | {
            f"{stage}_median_pct": middle(map(abs, errors)),
            f"{stage}_worst_pct": max(map(abs, errors), default=float("nan")),
            f"{stage}_signed_median_pct": middle(errors),
            f"{stage}_feasible": sum(item["feasible"] for item in own),
        }
    return row


def middle(values: Iterable[float]) -> float:
    """Return the median, nan of nothing."""
    found = list(values)
    return statistics.median(found) if found else float("nan")


def holds(row: Row) -> bool:
    """Return whether the targets hold after calibration."""
    return bool(
        row["after_median_pct"] <= MEDIAN_PCT
        and row["after_worst_pct"] <= WORST_PCT
        and row["after_feasible"] >= FEASIBLE * row["missions"]
    )


def print_row(row: Row) -> None:
    """Print one line of the table."""
    cells = [row["scene"], str(row["robots"])]
    for stage in ("before", "after"):
        median, worst = row[f"{stage}_median_pct"], row[f"{stage}_worst_pct"]
        cells += [f"{median:.2f}, {worst:.2f}", f"{row[f'{stage}_feasible']}"]
    print(" | ".join(cells), f"of {row['missions']}", flush=True)


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        prog="tools/bench_plant",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--scenes", nargs="*", default=list(SCENES), metavar="SCENE")
    parser.add_argument("--plant", choices=PLANTS, default="scrub")
    parser.add_argument(
        "--seeds", type=seed_range, default="0-2", help="first-last, default 0-2"
    )
    add_file_options(parser)
    return parser.parse_args()


if __name__ == "__main__":
    run(main)
