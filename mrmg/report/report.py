"""The report of a run: one self-contained HTML page, as far as the run came."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from mrmg import shipped, storage
from mrmg.counted import counted
from mrmg.plans import Plan
from mrmg.report import sections
from mrmg.report.charts import chart_data
from mrmg.report.map import mission_map
from mrmg.report.page import elements as html
from mrmg.report.page import page
from mrmg.report.planner import cost_chart, planner
from mrmg.report.robustness import robustness
from mrmg.report.timeline import events, timeline
from mrmg.runs.arguments import RunArguments
from mrmg.runs.record import RunRecord, read_record
from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene
from mrmg.viz import style
from mrmg.viz.activities import breakdowns, standing_of

_STATUS_WORDS = {
    "model_mismatch": "Model mismatch",
    "energy_imbalance": "Energy imbalance",
}


def write_report(run_folder: Path, *, trust_code: bool = False) -> None:
    """Write `report.html` into a run folder, from the files that are there.

    Args:
        run_folder: holds at least `scene.yaml`, `planning.json` and `summary.json`.
        trust_code: whether robot models may bring Python code (`loading.trust`).

    Raises:
        RunFolderError: if a file is missing or cannot be read.
    """
    record = read_record(run_folder, trust_code=trust_code)
    storage.write_text(run_folder / "report.html", report_html(record))


def report_html(record: RunRecord) -> str:
    """Return the report as HTML."""
    scene, plan, log = record.scene, record.plan, record.log
    ids = [robot.id for robot in scene.robots]
    light, dark = style.robot_colors(ids), style.robot_colors_on_dark(ids)
    data = chart_data(scene, plan, log) if plan else None
    cost = cost_chart(record)
    if data and cost:
        data["charts"].append(cost)
    places: dict[str, list[tuple[str, str]]] = {}
    for chart in data["charts"] if data else ():
        places.setdefault(chart["group"], []).append((chart["id"], chart["title"]))
    return page(
        f"{scene.name}: mission report",
        [
            html.heading(scene.name),
            _verdict_line(record),
            html.tiles(_main_figures(record)),
            html.section("Map", *_map(record)),
            html.section(
                "Timeline",
                timeline(scene, plan, log) if plan else "",
                html.bullets(events(log)),
            ),
            html.section("Video", _video(record.folder / "mission.mp4")),
            html.section(
                "State of charge", html.charts(places.get("charge", ()), columns=2)
            ),
            html.section("Energy", *sections.energy(record)),
            html.section("Energy by terrain", *sections.terrain(record)),
            html.section("Tours", *sections.tours(record)),
            html.section("Tracking error", html.charts(places.get("tracking", ()))),
            html.section(
                "Distances", html.charts(places.get("distance", ()), columns=2)
            ),
            html.section("Checks", *sections.checks(record)),
            html.section("Robustness", *robustness(record)),
            html.section("Planner", *planner(record)),
            html.section("Reproduce", *_reproduce(record)),
        ],
        colors=[(light[name], dark[name]) for name in ids],
        data=data,
    )


def _map(record: RunRecord) -> list[str]:
    boxes = [html.toggle("layer", "targets", "goals and stations")]
    if record.plan is not None:
        boxes.append(html.toggle("layer", "planned", "planned paths"))
    if record.log is not None:
        boxes.append(html.toggle("layer", "driven", "driven paths"))
    if record.plan is not None:
        boxes += [
            html.toggle(
                "owner", robot.id, html.robot_dot(index, _named(record, robot.id))
            )
            for index, robot in enumerate(record.scene.robots)
        ]
    lines = "Wide line: planned. Thin line: driven. " if record.plan else ""
    some = any(obstacle.blocks is not None for obstacle in record.scene.barriers)
    partial = "Pale and dashed: an obstacle for some robots only. " if some else ""
    return [
        html.player() if record.plan else "",
        html.controls(*boxes),
        mission_map(record.scene, record.plan, record.log),
        html.note(
            f"{lines}Circle: goal, filled with its robot's colour once visited. "
            "⚡: recharging station. ×: the energy of driving there against plain "
            f"ground. {partial}Point at anything for its name."
        ),
    ]


def _video(path: Path) -> str:
    return html.video(path.name) if path.exists() else ""


def _named(record: RunRecord, robot: str) -> str:
    """Return a robot's id, and its standing."""
    assert record.plan is not None
    standing = standing_of(robot, record.plan, record.log)
    return f"{robot} ({standing})" if standing else robot


def _verdict_line(record: RunRecord) -> str:
    summary, scene = record.summary, record.scene
    if record.plan is None:
        word = record.planning["status"].replace("_", " ").capitalize() + ": "
        return html.verdict_line(False, word, record.planning["reason"])
    if record.audit is None or record.verdict is None:
        return html.verdict_line(
            False, "Not finished:", " the plan was not driven yet."
        )
    broken = _breakdowns(record)
    if not summary["mission_ok"]:
        reasons = [item.message for item in record.verdict.violations]
        reasons += record.audit.reasons
        more = f" (and {len(reasons) - 1} more, see Checks)" if len(reasons) > 1 else ""
        first = reasons[0] if reasons else "see Checks"
        word = f"{_STATUS_WORDS.get(summary['status'], 'Mission failed')}: "
        return html.verdict_line(False, word, first + more + broken)
    energy = summary["energy"]
    fleet = _fleet(record.plan, len(scene.robots))
    number = len(scene.goals)
    all_goals = "the goal" if number == 1 else f"all {number} goals"
    return html.verdict_line(
        True,
        "Mission accomplished: ",
        f"{fleet} visited {all_goals} without contact, used "
        f"{energy['measured_J'] / 1000:.1f} kJ "
        f"({sections.signed(energy['measured_error_pct'], 1)} % against plan for the "
        f"worst robot) and never fell below "
        f"{100 * energy['min_charge_fraction']:.0f} % charge"
        f"{broken}{_on_the_way(summary)}.",
    )


def _fleet(plan: Plan, robots: int) -> str:
    """Return how many robots have a tour, of how many."""
    used = sum(bool(tour) for tour in plan.tours.values())
    fleet = counted(robots, "robot")
    return fleet if used == robots else f"{used} of {fleet}"


def _breakdowns(record: RunRecord) -> str:
    """Return which robots broke down, and when."""
    return "".join(
        f"; {robot} broke down at {time_s:.1f} s"
        for robot, time_s in breakdowns(record.log).items()
    )


def _on_the_way(summary: Mapping[str, Any]) -> str:
    replans = summary["execution"].get("replans", 0)
    return f"; planned anew {_times(replans)}, see Timeline" if replans else ""


def _times(number: int) -> str:
    return "once" if number == 1 else f"{number} times"


def _main_figures(record: RunRecord) -> list[tuple[str, str, str]]:
    summary, scene = record.summary, record.scene
    kinds = f"{counted(len(scene.robots), 'robot')}, seed {summary['seed']}"
    if record.plan is None:
        return [("Goals", str(len(scene.goals)), kinds)]
    execution, energy = summary["execution"], summary["energy"]
    done = f"{execution['goals_visited']} / " if execution else ""
    figures = [
        ("Goals visited", f"{done}{len(scene.goals)}", kinds),
        ("Planned energy", sections.kJ(record.plan.cost_J), _above_bound(record)),
        ("Planned duration", f"{record.plan.makespan_s:.0f} s", _how_soon(record)),
    ]
    if execution and energy:
        figures += [
            (
                "Simulated energy",
                sections.kJ(energy["measured_J"]),
                "work of the drives",
            ),
            (
                "Lowest charge",
                f"{100 * energy['min_charge_fraction']:.1f} %",
                counted(energy["recharges"], "recharge"),
            ),
            (
                "Tracking error",
                f"{100 * execution['tracking']['rms_m']:.1f} cm",
                f"rms; at most {100 * execution['tracking']['max_m']:.1f} cm",
            ),
            (
                "Simulation speed",
                f"{execution['realtime_factor']:.0f} ×",
                f"real time; control {execution['controller_ms']['median']:.2f} ms",
            ),
        ]
    return figures


def _above_bound(record: RunRecord) -> str:
    figures = record.summary["plan"]
    gap = figures.get("gap") if record.scene.objective.name == "energy" else None
    # Where the fleet was planned for anew, the bound is not one of what was driven.
    planned_anew = record.plan is None or record.plan.cost_J != figures["cost_J"]
    if gap is None or planned_anew:
        return "whole fleet"
    return f"whole fleet; at most {100 * gap:.0f} % above the least"


def _how_soon(record: RunRecord) -> str:
    """Return what is known or required of the makespan."""
    figures = record.summary["plan"]
    words = ["last robot at rest"]
    if math.isfinite(record.scene.time_limit_s):
        words.append(f"limit {record.scene.time_limit_s:g} s")
    if record.scene.objective.name == "makespan" and figures["gap"] is not None:
        words.append(f"at most {100 * figures['gap']:.0f} % above the least")
    return "; ".join(words)


def _reproduce(record: RunRecord) -> list[str]:
    versions = ", ".join(
        f"{name} {number}"
        for name, number in sorted(record.summary["versions"].items())
    )
    return [
        html.code(command(record)),
        html.note(f"Scene {record.scene.digest}. Versions: {versions}."),
    ]


def command(record: RunRecord) -> str:
    """Return the command line that makes the same plan and simulation again."""
    arguments = replace(RunArguments.from_json(record.arguments), seed=0)
    words = ["mrmg", "run", _source(record.scene, arguments)]
    words += ["--seed", str(record.summary["seed"]), *arguments.words()]
    words += ["--trust-code"] if record.scene.has_custom_motion else []
    return shlex.join(words)


def _source(scene: Scene, arguments: RunArguments) -> str:
    if scene.name in shipped.scene_names():
        same = arguments.scene(load_scene(scene.name)).digest == scene.digest
        return scene.name if same else "scene.yaml"
    return "scene.yaml"
