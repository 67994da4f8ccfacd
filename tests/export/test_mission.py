"""What exporters write down of drives that did not go as planned."""

from __future__ import annotations

import csv
from pathlib import Path

from mrmg import storage
from mrmg.export.exporting import export_run
from mrmg.plans import Plan
from mrmg.scene.loading import dump_scene
from mrmg.scene.types import Scene
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
