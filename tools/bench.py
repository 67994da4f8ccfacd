"""Plan, verify and drive missions over scenes and seeds; print tables, write JSONL.

Protocol: one process, one thread; every scene is planned once before anything is
timed, so that kernels are compiled and caches warm. Times are wall-clock, of planning
in process. The runs of one call are comparable with each other; figures of different
machines are not.

With --bound, costs (the scene's objective: energy, unless it says else) are compared
with a proven lower bound: that of the first plan, and
with --budget S those of the best plans after each of 5 s and 30 s that S reaches. The
quality protocol is `tools/bench --bound --budget 30 --seeds 0-9`.

With --energy paper all robots are charged as in the paper, by distance, terrain and
turning: in the planner, the bound and the verifier alike. The protocol of Table I is
`tools/bench --seeds 0-49 --profile default paper --energy paper`.

With more than one profile each seed is planned with all of them in turn, and a second
table has the ratios to the first profile, seed by seed, where both have a plan: of the
time to the first plan, and of the cost of the final one.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from protocol import seed_range, versions

import mrmg
from mrmg.energy import ENERGY_PRESETS, EnergyPreset
from mrmg.planning import plan_mission, profile_params
from mrmg.planning.planner import bounds_of
from mrmg.planning.statistics import UNKNOWN
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

BOUND_FINER = 7
"""Parts into which the bound's cells are cut: more than planning has time for, which
brings it up to half a percent nearer to the truth."""

MOMENTS_S = (5.0, 30.0)
"""Times after which a budget's plans are compared with the bound."""

TABLE = ("scene1", "scene2", "scene3", "scene4", "scene5", "scene6")


def main() -> int:
    """Run the bench; return 1 if any mission of the first profile failed."""
    options = parse_options()
    print(protocol(options))
    rows = []
    print(header(options))
    for scene in options.scenes:
        of_scene = list(missions(scene, options))
        rows += of_scene
        print_scene(scene, of_scene, options)
    if len(options.scenes) > 1:
        print_scene("all", rows, options)
    for profile in options.profile[1:]:
        print(ratio_table(rows, options, profile))
    if options.output:
        text = "".join(json.dumps(row, sort_keys=True) + "\n" for row in rows)
        options.output.write_text(text)
    of_first = [row for row in rows if row["profile"] == options.profile[0]]
    return 0 if all(row["ok"] for row in of_first) else 1


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench")
    parser.add_argument("--scenes", nargs="+", default=list(TABLE), metavar="SCENE")
    parser.add_argument(
        "--seeds", type=seed_range, default="0-9", help="first-last, default 0-9"
    )
    parser.add_argument(
        "--profile", nargs="+", default=["default"], choices=("default", "paper")
    )
    parser.add_argument(
        "--energy",
        choices=ENERGY_PRESETS,
        help="what counts in all robots' energy models; default: as the scenes say",
    )
    parser.add_argument("--budget", type=float, help="seconds of planning")
    parser.add_argument("--execute", action="store_true", help="drive in MuJoCo too")
    parser.add_argument("--bound", action="store_true", help="compare with a bound")
    parser.add_argument("--output", type=Path, help="JSONL file, one line a mission")
    return parser.parse_args()


def protocol(options: argparse.Namespace) -> str:
    """Return what was measured how and on what."""
    seeds = f"{options.seeds.start}-{options.seeds.stop - 1}"
    chosen = f"profile {', '.join(options.profile)}, seeds {seeds}"
    return f"{__doc__}\n{chosen}\n{conditions(options)}\n"


def conditions(options: argparse.Namespace) -> str:
    """Return what results depend on: energy, budget, versions, machine."""
    budget = f"budget {options.budget:g} s" if options.budget else "no time limit"
    energy = f"energy {options.energy}; " if options.energy else ""
    return f"{energy}{budget}; {versions()}"


def charged(scene: Scene, preset: EnergyPreset | None) -> Scene:
    """Return a scene in which one preset counts in all robots' energy models."""
    if preset is None:
        return scene
    robots = [{**robot, "energy": preset} for robot in scene.document["robots"]]
    return scene_from_document({**scene.document, "robots": robots}, source=scene.name)


def problem_of(scene: Any, source: str) -> dict[str, Any]:
    """Return what there is to be planned."""
    robot = scene.robots[0]
    metre_J = robot.model.energy_model.plain_ground_J_per_m()
    return {
        "source": source,
        "robots": len(scene.robots),
        "goals": len(scene.goals),
        "stations": len(scene.stations),
        "terrain_areas": len(scene.terrain),
        "capacity_m": robot.battery.capacity_J / metre_J,
    }


def missions(source: str, options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Yield one row for each seed and profile."""
    scene = charged(mrmg.load_scene(source), options.energy)
    # All profiles run the same kernels, and the default one is the quickest to warm.
    plan_mission(scene, seed=options.seeds.start)
    step_s = profile_params(options.profile[0]).dt_s
    bounds = bounds_of(scene, step_s, finer=BOUND_FINER) if options.bound else UNKNOWN
    bound = bounds.of(scene.objective)
    for seed in options.seeds:
        for profile in options.profile:
            row = planned(source, scene, seed, profile, bound, options)
            if not row["ok"]:
                print(f"FAILED {scene.name} seed {seed}: {row}", file=sys.stderr)
            yield row


def planned(
    source: str,
    scene: Any,
    seed: int,
    profile: str,
    bound: float | None,
    options: argparse.Namespace,
) -> dict[str, Any]:
    """Plan, verify and, if asked to, drive a mission; return its row."""
    params = profile_params(profile, budget_s=options.budget)
    began = time.perf_counter()
    result = plan_mission(scene, seed=seed, params=params)
    row = {
        "scene": scene.name,
        "problem": problem_of(scene, source),
        "conditions": conditions(options),
        "seed": seed,
        "profile": profile,
        "status": result.status.value,
        "reason": result.reason,
        "plan_s": time.perf_counter() - began,
        "statistics": dict(result.statistics),
        "ok": False,
    }
    if result.plan is None:
        return row
    verdict = mrmg.verify(scene, result.plan)
    metre = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    row |= {
        "cost_J": result.plan.cost_J,
        "cost_m": result.plan.cost_J / metre,
        "makespan_s": result.plan.makespan_s,
        "objective": scene.objective.name,
        "value": scene.objective.value(result.plan.cost_J, result.plan.makespan_s),
        "violations": len(verdict.violations),
        "ok": verdict.ok,
    }
    if bound is not None:
        row |= {"bound": bound, "cost_to_bound": row["value"] / bound}
        row["cost_to_bound_after"] = {
            name: value_after(result.statistics, time_s) / bound
            for name, time_s in moments(options).items()
        }
    if options.execute:
        row |= driven(scene, result.plan, verdict.ok)
    return row


def moments(options: argparse.Namespace) -> dict[str, float | None]:
    """Return the times whose best plans are compared with the bound; None: first."""
    reached = [time_s for time_s in MOMENTS_S if time_s <= (options.budget or 0.0)]
    return {"first": None, **{f"{time_s:g} s": time_s for time_s in reached}}


def value_after(statistics: Mapping[str, Any], time_s: float | None) -> float:
    """Return the objective of the best plan by a time, or of the first one."""
    found = statistics["improvements"]
    values = [
        row["objective"]["value"]
        for row in found
        if time_s is not None and row["time_s"] <= time_s
    ]
    return float(min(values, default=found[0]["objective"]["value"]))


def driven(scene: Any, plan: Any, plan_ok: bool) -> dict[str, Any]:
    """Drive a plan and return what came of it."""
    log = mrmg.execute(scene, plan)
    account = mrmg.audit(scene, plan, log)
    robots = account.robots
    return {
        "ok": plan_ok and account.mission_ok,
        "reasons": list(account.reasons),
        "realtime_factor": log.timing["realtime_factor"],
        "contacts": len(log.contacts),
        "tracking_rms_m": max(robot.tracking_rms_m for robot in robots),
        "tracking_max_m": max(robot.tracking_max_m for robot in robots),
        "metered_error_pct": max(abs(robot.metered_error_pct) for robot in robots),
        "measured_error_pct": max(abs(robot.measured_error_pct) for robot in robots),
    }


COLUMNS = (
    "first_s median",
    "first_s p95",
    "plan_s median",
    "solver share median",
    "cost_m median",
)
DRIVEN = ("rms_m worst", "max_m worst", "metered% worst", "measured% worst", "x real")


def header(options: argparse.Namespace) -> str:
    """Return the table's head."""
    driven_names = DRIVEN if options.execute else ()
    bound_names = (
        [f"cost/bound {name}" for name in (*moments(options), "median")]
        if options.bound
        else []
    )
    return " | ".join(("scene", "ok", *COLUMNS, *bound_names, *driven_names))


def print_scene(
    scene: str, rows: list[dict[str, Any]], options: argparse.Namespace
) -> None:
    """Print one line of the table for each profile."""
    for profile in options.profile:
        name = f"{scene} {profile}" if len(options.profile) > 1 else scene
        of_profile = [row for row in rows if row["profile"] == profile]
        print(table_row(name, of_profile, options), flush=True)


def ratio_table(
    rows: list[dict[str, Any]], options: argparse.Namespace, profile: str
) -> str:
    """Return how a profile compares with the first one, seed by seed."""
    base = options.profile[0]
    solved = {
        (row["scene"], row["seed"], row["profile"]): row for row in rows if row["ok"]
    }
    lines = [f"\n{profile} / {base}", "scene | both ok | first plan | cost"]
    scenes = sorted({row["scene"] for row in rows})
    for names in [*([scene] for scene in scenes), scenes]:
        pairs = [
            (solved[scene, seed, profile], solved[scene, seed, base])
            for scene in names
            for seed in options.seeds
            if {(scene, seed, profile), (scene, seed, base)} <= solved.keys()
        ]
        cells = [names[0] if len(names) == 1 else "all", f"{len(pairs)}"]
        if pairs:
            cells += [
                f"{statistics.median(first_s(a) / first_s(b) for a, b in pairs):.1f}",
                f"{statistics.median(a['cost_J'] / b['cost_J'] for a, b in pairs):.3f}",
            ]
        lines.append(" | ".join(cells))
    return "\n".join(lines if len(scenes) > 1 else lines[:-1])


def solver_share(row: Mapping[str, Any]) -> float:
    """Return the share of the discrete solver in the time of planning."""
    time_s = row["statistics"]["time_s"]
    return float(time_s["routing"] / time_s["total"])


def first_s(row: Mapping[str, Any]) -> float:
    """Return the time to the first plan of a solved row [s]."""
    return float(row["statistics"]["time_s"]["first_solution"])


def table_row(
    scene: str, rows: list[dict[str, Any]], options: argparse.Namespace
) -> str:
    """Return one scene's line of the table."""
    solved = [row for row in rows if "cost_m" in row]
    cells = [scene, f"{sum(row['ok'] for row in rows)}/{len(rows)}"]
    if solved:
        first = sorted(first_s(row) for row in solved)
        cells += [
            f"{statistics.median(first):.3f}",
            f"{first[min(len(first) - 1, int(0.95 * len(first)))]:.3f}",
            f"{statistics.median(row['plan_s'] for row in solved):.3f}",
            f"{statistics.median(map(solver_share, solved)):.2f}",
            f"{statistics.median(row['cost_m'] for row in solved):.1f}",
        ]
    if solved and options.bound:
        for name in moments(options):
            of_moment = [row["cost_to_bound_after"][name] for row in solved]
            cells.append(f"{statistics.median(of_moment):.3f}")
        cells.append(f"{statistics.median(row['cost_to_bound'] for row in solved):.3f}")
    if solved and options.execute:
        cells += [
            f"{max(row['tracking_rms_m'] for row in solved):.4f}",
            f"{max(row['tracking_max_m'] for row in solved):.4f}",
            f"{max(row['metered_error_pct'] for row in solved):.2f}",
            f"{max(row['measured_error_pct'] for row in solved):.2f}",
            f"{statistics.median(row['realtime_factor'] for row in solved):.0f}",
        ]
    return " | ".join(cells)


if __name__ == "__main__":
    sys.exit(main())
