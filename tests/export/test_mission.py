"""What exporters write down of drives that did not go as planned."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from mrmg import storage
from mrmg.energy.audit import audit
from mrmg.export.exporting import export_run
from mrmg.plans import Plan
from mrmg.scene.loading import dump_scene
from mrmg.scene.types import Scene
from mrmg.simulation.disturbance import Disturbance, RobotDisturbance
from mrmg.simulation.log import ExecutionLog


def rows(folder: Path, scene: Scene, plan: Plan, log: ExecutionLog) -> list[dict]:
    """Return the rows of the table of a drive."""
    storage.write_text(folder / "scene.yaml", dump_scene(scene))
    storage.write_json(folder / "planning.json", {"status": "solved"})
    storage.write_json(folder / "run.json", {"format": 1, "arguments": {}})
    storage.write_json(folder / "summary.json", {})
    plan.save(folder)
    log.save(folder)
    (path,) = export_run(folder, "csv")
    return list(csv.DictReader(path.open()))


def test_after_a_missed_goal_the_target_is_what_follows_the_last_visit(
    missing, make_log, tmp_path: Path
) -> None:
    scene, plan = missing()
    found = rows(tmp_path, scene, plan, make_log(scene, plan))
    targets = list(dict.fromkeys(row["target"] for row in found))
    assert targets == ["h", ""]  # it never was at h, and is done after g


def test_charge_is_that_of_the_battery_a_robot_really_has(
    missing, make_log, tmp_path: Path
) -> None:
    scene, plan = missing()
    half = RobotDisturbance(robot="r1", capacity=-0.5)
    disturbance = Disturbance(seed=0, robots=(half,))
    log = replace(make_log(scene, plan), disturbance=disturbance)
    charges = [float(row["charge"]) for row in rows(tmp_path, scene, plan, log)]
    assert charges[0] == 1.0
    least = audit(scene, plan, log).robot("r1").min_charge_fraction
    assert min(charges) == pytest.approx(least, abs=1e-6)
