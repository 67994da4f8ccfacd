"""Faults and replanning from the command line, and what the run folder then holds."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.plans import Plan, plan_in_force
from mrmg.report.compare import compare_runs
from mrmg.runs import pipeline
from mrmg.runs.arguments import RunArguments
from mrmg.runs.summary_model import summary_schema
from mrmg.scene.loading import scene_from_document
from mrmg.simulation.log import ExecutionLog
from mrmg.viz.figure import draw_figure
from mrmg.viz.replay import replay_of

CONTROL_FILES = ("driven_plan.json", "driven_plan.npz", "replans.json")


@pytest.fixture(scope="module")
def replanned(
    quickstart_run: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, pipeline.RunResult]:
    """A quickstart in which a robot breaks down."""
    folder = tmp_path_factory.mktemp("runs") / "replanned"
    result = pipeline.run(
        "quickstart", out=folder, video=None, replan=True, faults=["r2@4s"]
    )
    return folder, result


def test_a_replanned_mission_is_done(
    replanned: tuple[Path, pipeline.RunResult],
) -> None:
    folder, result = replanned
    assert result.exit_code == ExitCode.OK
    jsonschema.validate(result.summary, summary_schema())
    execution = result.summary["execution"]
    assert execution["goals_visited"] == 4
    assert execution["replans"] == 1
    assert [event["action"] for event in execution["events"]] == ["stop", "replan"]
    assert abs(result.summary["energy"]["measured_error_pct"]) < 2.0
    assert all((folder / name).exists() for name in CONTROL_FILES)


def test_judges_and_pictures_take_the_plan_in_force(
    replanned: tuple[Path, pipeline.RunResult], quickstart_run: Path, tmp_path: Path
) -> None:
    folder, _ = replanned
    plan, log = plan_in_force(folder), ExecutionLog.load(folder)
    assert plan.digest == log.plan_digest
    first = Plan.load(folder)
    assert first.digest == Plan.load(quickstart_run).digest != plan.digest
    assert plan_in_force(quickstart_run).digest == first.digest
    for robot, content_J in plan.content_J.items():
        assert len(content_J) == len(plan.trajectory(robot).state)
        assert (content_J > 0.0).all()
    page = (folder / "report.html").read_text()
    assert "r2 has broken down; the fleet stops" in page
    assert page.count('class="event" style') == 2 * 2
    assert "--fault r2@4s --replan" in page
    assert replay_of(folder).end_s == log.time_s[-1]
    draw_figure(folder, "timeline", tmp_path / "timeline.png")
    rows = {row.name: row.values for row in compare_runs([folder, quickstart_run]).rows}
    assert rows["new plans on the way"] == (1.0, 0.0)


def test_each_new_planning_is_kept(
    replanned: tuple[Path, pipeline.RunResult],
) -> None:
    folder, result = replanned
    (replan,) = json.loads((folder / "replans.json").read_text())
    rest = scene_from_document(replan["scene"], source="rest")
    assert [robot.id for robot in rest.robots] == ["r1"]
    assert [obstacle.id for obstacle in rest.obstacles][-1] == "r2"
    assert replan["time_s"] == result.summary["execution"]["events"][-1]["time_s"]
    assert replan["plan"]["cost_J"] > 0.0
    assert set(replan["rolling_factor"]) == {"r1", "r2"}
    np.testing.assert_allclose(list(replan["rolling_factor"].values()), 1.0, atol=0.03)


def test_a_fault_alone_ends_the_mission(
    own_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    failed = ["execute", str(own_run), "--fault", "r1@2s"]
    assert main(failed) == ExitCode.MISSION_FAILED
    output = capsys.readouterr().out
    assert "given up on the way" in output
    assert "r1 has broken down" in output
    assert "replanning is off; goals left: " in output
    folder = own_run.parent / "run-fault-r1-2s"
    assert all((folder / name).exists() for name in CONTROL_FILES)
    assert main(["audit", str(folder)]) == ExitCode.MISSION_FAILED
    assert "the mission was ended at" in capsys.readouterr().out
    assert main(["report", str(folder)]) == ExitCode.MISSION_FAILED
    assert not any((own_run / name).exists() for name in CONTROL_FILES)


def test_wrong_faults_are_refused_before_planning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    for fault, named in (("r9@4s", "allowed: r1, r2"), ("r1", "r2@40s")):
        arguments = ["run", "quickstart", "--out", str(out), "--fault", fault]
        assert main(arguments) == ExitCode.USAGE
        assert named in capsys.readouterr().err
    assert not out.exists()


def test_the_arguments_survive_the_folder() -> None:
    arguments = RunArguments(replan=True, faults=("r1@3s", "r2@5s"))
    stored = json.loads(json.dumps(arguments.to_json()))
    assert RunArguments.from_json(stored) == arguments
