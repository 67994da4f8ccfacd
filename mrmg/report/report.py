"""The report of a run: one self-contained HTML page, as far as the run came."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from mrmg import shipped, storage
from mrmg.energy.battery_curves import shown_curves
from mrmg.energy.by_terrain import energy_by_terrain, planned_interval_J
from mrmg.energy.ledger import EnergyLedger
from mrmg.energy.model import PARTS
from mrmg.plans import Plan, Visit
from mrmg.report.charts import chart_data
from mrmg.report.map import mission_map
from mrmg.report.page import page, rendered
from mrmg.report.planner import cost_chart, planner
from mrmg.report.timeline import timeline
from mrmg.runs.arguments import RunArguments
from mrmg.runs.record import RunRecord, read_record
from mrmg.scene.loading import load_scene
from mrmg.scene.margins import sentences_on_margins
from mrmg.scene.types import Scene
from mrmg.viz import style
from mrmg.viz.activities import (
    breakdowns,
    legs_of_stops,
    lengths_along,
    standing_of,
)

_STILL_M = 0.1
"""Way of a robot that stays where it is."""


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
    """Return the page of a run."""
    scene, plan, log = record.scene, record.plan, record.log
    data = chart_data(scene, plan, log) if plan else None
    cost = cost_chart(record)
    if data and cost:
        data["charts"].append(cost)
    studies = [study.to_json() for study in record.studies]
    body = rendered(
        "report.html.jinja",
        record=record,
        scene=scene,
        plan=plan,
        log=log,
        map=mission_map(scene, plan, log),
        timeline=timeline(scene, plan, log) if plan else "",
        breakdowns=breakdowns(log),
        charts=data["charts"] if data else [],
        has_video=(record.folder / "mission.mp4").exists(),
        planner=planner(record),
        command=command(record),
        infinity=math.inf,
        **(_of_plan(record, plan) if plan else {}),
        studies=studies,
        commands=[
            shlex.join(["mrmg", "execute", "RUN", *study["worst"]["execute"]])
            for study in studies
        ],
    )
    instead = "energy.png and overview.png in the run folder show the same"
    title = f"{scene.name}: mission report"
    return page(title, body, colors=len(scene.robots), data=data, instead=instead)


def _of_plan(record: RunRecord, plan: Plan) -> dict[str, Any]:
    """Return what the page knows of a plan and its drive beside their records."""
    scene, log = record.scene, record.log
    looks, curves = style.terrain_classes(scene), shown_curves(scene, plan, log)
    return {
        "parts": PARTS,
        "by_terrain": energy_by_terrain(scene, plan, log),
        "terrain_colors": {key: look.color for key, look in looks.items()},
        "interval_J": planned_interval_J,
        "stops": _stops,
        "margins": sentences_on_margins(scene.robots, plan.margins),
        "standing": {robot.id: standing_of(robot, plan, log) for robot in scene.robots},
        "staying": {
            curve.robot for curve in curves if lengths_along(curve.state)[-1] < _STILL_M
        },
        "full_J": {curve.robot: curve.battery.capacity_J for curve in curves},
    }


def _stops(
    tour: Sequence[str],
    visits: Sequence[Visit],
    ledger: EnergyLedger,
) -> list[tuple[Visit | None, float | None]]:
    """Return the visit of each stop and the energy of the leg to it [J], if any.

    Args:
        tour: of one robot.
        visits: of the robot.
        ledger: of the fleet.
    """
    energy_J: dict[int | None, float] = {}
    for entry in ledger.entries:
        if visits and entry.robot == visits[0].robot:
            energy_J[entry.leg] = energy_J.get(entry.leg, 0.0) + entry.energy_J
    return [
        (None if leg is None else visits[leg], energy_J.get(leg))
        for leg in legs_of_stops(tour, [visit.target for visit in visits])
    ]


def command(record: RunRecord) -> str:
    """Return the command line that makes the same plan and simulation again."""
    arguments = replace(record.arguments, seed=0)
    words = ["mrmg", "run", _source(record.scene, arguments)]
    words += ["--seed", str(record.summary["seed"]), *arguments.words()]
    words += ["--trust-code"] if record.scene.has_custom_motion else []
    return shlex.join(words)


def _source(scene: Scene, arguments: RunArguments) -> str:
    if scene.name in shipped.scene_names():
        same = arguments.scene(load_scene(scene.name)).digest == scene.digest
        return scene.name if same else "scene.yaml"
    return "scene.yaml"
