"""Plan, verify and drive missions over scenes and seeds; print tables, write JSONL.

Protocol: one process, one thread; every scene is planned once before anything is
timed, so that kernels are compiled and caches warm. Times are wall-clock, of planning
in process. The runs of one call are comparable with each other; figures of different
machines are not.

With --bound, costs (the scene's objective: energy, unless it has another) are compared
with a proven lower bound: that of the first plan, and with --budget S those of the best
plans after each of 5 s and 30 s that S reaches. The quality protocol is
`tools/bench --bound --budget 30 --seeds 0-9`.

With --energy paper all robots are charged as in the paper, by distance, terrain and
turning: in the planner, the bound and the verifier alike. The protocol of Table I is
`tools/bench --seeds 0-49 --profile default paper --energy paper`.

With more than one profile each seed is planned with all of them in turn, and a second
table has the ratios to the first profile, seed by seed, where both have a plan: of the
time to the first plan, and of the cost of the final one. Profile paper takes NRPA of
another depth by --nrpa, such as `--profile paper --nrpa 2x50`.

Finished missions are kept in --output FILE: the same command goes on from there after
an interruption. Rows of --json: `scene`, `profile`, `ok` of `runs`, then the table's
columns: times [s], costs as metres of plain ground, `cost_to_bound_...`, tracking [m],
errors [%]. `ratios` has the second table: `profile`, `base`, `scene`, `both_ok`,
`first_plan`, `cost`, and 95 % bootstrap intervals of these medians over the seeds,
`first_plan_interval`, `cost_interval`.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, get_args

from mission_tables import header, moments, print_ratios, print_scene
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
from mrmg.energy.model import EnergyPreset
from mrmg.planning import plan_mission, profile_params
from mrmg.planning.bounding import bounds_of
from mrmg.planning.statistics import UNKNOWN
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

BOUND_FINER = 10
"""Parts into which the bound's cells are cut: more than planning has time for, which
brings it up to half a percent nearer to the truth."""

TABLE = ("scene1", "scene2", "scene3", "scene4", "scene5", "scene6")


def main() -> int:
    """Run the bench; return 1 if any mission of the first profile failed."""
    options = parse_options()
    print(protocol(options))
    trials = Trials(options.output, **deciding(options))
    rows, table = [], []
    print(header(options))
    for source in options.scenes:
        scene = charged(mrmg.load_scene(source), options.energy)
        of_scene = list(missions(scene, source, options, trials))
        rows += of_scene
        table += print_scene(source, of_scene, options)
    if len(options.scenes) > 1:
        table += print_scene("all", rows, options)
    ratios: list[Row] = []
    for profile in options.profile[1:]:
        ratios += print_ratios(rows, options, profile)
    ok = all(row["ok"] for row in rows if row["profile"] == options.profile[0])
    write_document(options, "bench", table, ok, ratios=ratios)
    return 0 if ok else 1


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
        choices=get_args(EnergyPreset),
        help="what counts in all robots' energy models; default: as the scenes say",
    )
    parser.add_argument(
        "--nrpa",
        type=nrpa_depth,
        metavar="LEVELSxITERATIONS",
        help="depth of NRPA in profile paper, such as 2x25; default the profile's",
    )
    parser.add_argument("--budget", type=float, help="seconds of planning")
    parser.add_argument("--execute", action="store_true", help="drive in MuJoCo too")
    parser.add_argument("--bound", action="store_true", help="compare with a bound")
    add_file_options(parser)
    return parser.parse_args()


def nrpa_depth(text: str) -> tuple[int, int]:
    """Return levels and iterations of a text such as 2x25."""
    levels, iterations = map(int, text.split("x"))
    return levels, iterations


def protocol(options: argparse.Namespace) -> str:
    """Return what was measured how and on what."""
    seeds = f"{options.seeds.start}-{options.seeds.stop - 1}"
    chosen = f"profile {', '.join(options.profile)}, seeds {seeds}"
    measured = conditions(options.budget, options.energy)
    return f"{__doc__}\n{chosen}\n{measured}\n"


def conditions(budget_s: float | None = None, preset: str | None = None) -> str:
    """Return what results depend on: energy, budget, versions, machine."""
    budget = f"budget {budget_s:g} s" if budget_s else "no time limit"
    energy = f"energy {preset}; " if preset else ""
    return f"{energy}{budget}; {versions()}"


def deciding(options: argparse.Namespace) -> dict[str, Any]:
    """Return the options that decide what comes of every mission."""
    step_s = profile_params(options.profile[0]).dt_s if options.bound else None
    return {
        "energy": options.energy,
        "nrpa": options.nrpa,
        "budget_s": options.budget,
        "execute": options.execute,
        "bound_step_s": step_s,
    }


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


def missions(
    scene: Scene, source: str, options: argparse.Namespace, trials: Trials
) -> Iterator[Row]:
    """Yield one row for each seed and profile, made where it is not finished."""
    ready = cache(partial(warmed, scene, options))
    for seed in options.seeds:
        for profile in options.profile:
            row = trials.row(
                partial(planned, source, scene, seed, profile, ready, options),
                source=source,
                digest=scene.digest,
                seed=seed,
                profile=profile,
            )
            if not row["ok"]:
                print(f"FAILED {scene.name} seed {seed}: {row}", file=sys.stderr)
            yield row


def add_mission_options(parser: argparse.ArgumentParser, seeds: str) -> None:
    """Let a bench of other missions take the options that `plan_each` reads.

    Args:
        parser: of its command line.
        seeds: first and last one by default.
    """
    parser.add_argument(
        "--seeds", type=seed_range, default=seeds, help=f"first-last, default {seeds}"
    )
    parser.add_argument("--budget", type=float, help="seconds of planning")
    parser.add_argument("--execute", action="store_true", help="drive in MuJoCo too")
    parser.add_argument("--bound", action="store_true", help="compare with a bound")
    add_file_options(parser)
    parser.set_defaults(profile=["default"], energy=None, nrpa=None)


def plan_each(
    scenes: Iterable[tuple[str, Scene]], options: argparse.Namespace, command: str
) -> int:
    """Plan scenes, each with its source, a table's row each; return the exit code."""
    trials = Trials(options.output, **deciding(options))
    ok, table = True, list[Row]()
    print(header(options))
    for source, scene in scenes:
        of_scene = list(missions(scene, source, options, trials))
        ok &= all(row["ok"] for row in of_scene)
        table += print_scene(Path(source).stem, of_scene, options)
    write_document(options, command, table, ok)
    return 0 if ok else 1


@cache
def warm(*profiles: str) -> None:
    """Plan once with each profile, so that the kernels of all are loaded."""
    for profile in profiles:
        plan_mission(mrmg.load_scene("quickstart"), params=profile_params(profile))


def warmed(scene: Scene, options: argparse.Namespace) -> float | None:
    """Plan a scene once before anything is timed; return its bound, if asked for."""
    warm(*options.profile)
    plan_mission(scene, seed=options.seeds.start)
    step_s = profile_params(options.profile[0]).dt_s
    bounds = bounds_of(scene, step_s, finer=BOUND_FINER) if options.bound else UNKNOWN
    return bounds.of(scene.objective)


def planned(
    source: str,
    scene: Any,
    seed: int,
    profile: str,
    ready: Callable[[], float | None],
    options: argparse.Namespace,
) -> Row:
    """Plan, verify and, if asked to, drive a mission; return its row."""
    bound = ready()
    params = profile_params(profile, budget_s=options.budget)
    if options.nrpa and profile == "paper":
        levels, iterations = options.nrpa
        deeper = replace(params.router, levels=levels, iterations=iterations)
        params = replace(params, router=deeper)
    began = time.perf_counter()
    result = plan_mission(scene, seed=seed, params=params)
    row = {
        "scene": scene.name,
        "problem": problem_of(scene, source),
        "conditions": conditions(options.budget, options.energy),
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


def value_after(statistics: Mapping[str, Any], time_s: float | None) -> float:
    """Return the objective of the best plan by a time, or of the first one.

    The last is the best: one that keeps more of its margins may cost more.
    """
    first, *later = statistics["improvements"]
    in_time = [one for one in later if time_s is not None and one["time_s"] <= time_s]
    return float([first, *in_time][-1]["objective"]["value"])


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


if __name__ == "__main__":
    run(main)
