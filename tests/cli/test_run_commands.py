"""What the commands print and end with, on real runs."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from mrmg import storage
from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.runs.summary_model import summary_schema
from mrmg.scene.loading import load_scene
from mrmg.scene.objective import Objective


def test_json_stands_alone_on_stdout(own_run: Path) -> None:
    arguments = ["run", "quickstart", "--no-video", "--json", "--out", str(own_run)]
    ended = subprocess.run(
        [sys.executable, "-m", "mrmg", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (ExitCode.OK, "")
    assert ended.stdout == (own_run / "summary.json").read_text()
    jsonschema.validate(json.loads(ended.stdout), summary_schema())


def test_wishes_of_the_command_line_stand_in_the_run_s_scene(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ["--out", str(tmp_path / "run")]
    wishes = ["--objective", "1:50", "--time-limit", "300"]
    assert main(["plan", "quickstart", *wishes, *out]) == ExitCode.OK
    assert "blend" in capsys.readouterr().out
    scene = load_scene(tmp_path / "run" / "scene.yaml")
    assert scene.objective == Objective(energy_weight=1.0, makespan_weight=50.0)
    assert scene.time_limit_s == 300.0
    main(["report", str(tmp_path / "run")])
    summary = storage.read_json(tmp_path / "run" / "summary.json")
    jsonschema.validate(summary, summary_schema())
    plan = summary["plan"]
    assert plan["objective"]["name"] == "blend"
    value = plan["cost_J"] + 50.0 * plan["makespan_s"]
    assert plan["objective"]["value"] == pytest.approx(value)
    bound = plan["bound_J"] + 50.0 * plan["bound_s"]
    assert plan["objective"]["bound"] == pytest.approx(bound)
    assert plan["gap"] == pytest.approx(value / bound - 1.0)


def test_a_run_tells_its_outcome_and_where_the_report_is(
    own_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ["--no-video", "--out", str(own_run)]
    assert main(["run", "quickstart", *out]) == ExitCode.OK
    reported = capsys.readouterr()
    assert "mission done" in reported.out
    assert str(own_run / "report.html") in reported.out
    assert reported.err == ""


def test_the_verbs_do_the_run_step_by_step(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = str(tmp_path / "run")
    assert main(["plan", "quickstart", "--out", run]) == ExitCode.OK
    for verb in ("verify", "execute", "audit"):
        assert main([verb, run]) == ExitCode.OK
    before = (tmp_path / "run" / "plan.json").stat().st_mtime_ns
    capsys.readouterr()
    arguments = ["run", "quickstart", "--no-video", "--json", "--out", run]
    assert main(arguments) == ExitCode.OK
    assert json.loads(capsys.readouterr().out)["mission_ok"]
    assert (tmp_path / "run" / "plan.json").stat().st_mtime_ns == before


@pytest.mark.parametrize(
    ("verb", "output"),
    [
        ("verify", "verdict.json"),
        ("execute", "log.json"),
        ("audit", "audit.json"),
        ("report", "summary.json"),
    ],
)
def test_steps_print_their_file_as_json(
    own_run: Path, verb: str, output: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if verb == "report":
        assert main(["audit", str(own_run)]) == ExitCode.OK
        capsys.readouterr()
    assert main([verb, str(own_run), "--json"]) == ExitCode.OK
    assert capsys.readouterr().out == (own_run / output).read_text()


@pytest.mark.parametrize("verb", ["run", "plan"])
def test_an_infeasible_mission_ends_with_its_code(
    verb: str, walled_scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [verb, str(walled_scene), "--out", str(tmp_path / "run")]
    arguments += ["--no-video"] if verb == "run" else []
    assert main(arguments) == ExitCode.INFEASIBLE
    first = capsys.readouterr().out.splitlines()[0]
    assert "infeasible" in first
    assert "g1 is unreachable" in first
    for later in ("verify", "execute", "audit", "render"):
        assert main([later, str(tmp_path / "run")]) == ExitCode.INVALID_FILE
        refused = capsys.readouterr().err
        assert "no plan; planning ended infeasible: goal g1 is unreachable" in refused


def test_a_run_that_an_older_version_called_a_timeout_is_readable(
    walled_scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It wrote so without a budget, too, and no hints."""
    run = tmp_path / "run"
    assert main(["plan", str(walled_scene), "--out", str(run)]) == ExitCode.INFEASIBLE
    planning = json.loads((run / "planning.json").read_text())
    old = {"status": "timeout", "reason": "no motion tree reached all goals"}
    statistics = dict(planning["statistics"])
    del statistics["coordinated"]
    storage.write_json(run / "planning.json", {**old, "statistics": statistics})
    capsys.readouterr()
    assert main(["report", str(run), "--json"]) == ExitCode.OUT_OF_BUDGET
    summary = json.loads(capsys.readouterr().out)
    assert summary["status"] == "timeout"
    assert summary["hints"] == []
    page = (run / "report.html").read_text()
    assert "Timeout" in page
    assert "First plan after" not in page


@pytest.mark.slow
def test_a_budget_too_small_ends_with_its_code_and_is_tried_again(
    tmp_path: Path,
) -> None:
    out = str(tmp_path / "run")
    arguments = ["run", "quickstart", "--no-video", "--out", out]
    assert main([*arguments, "--budget", "1e-6"]) == ExitCode.OUT_OF_BUDGET
    assert main([*arguments, "--budget", "1e-6"]) == ExitCode.OUT_OF_BUDGET
    assert json.loads((tmp_path / "run/planning.json").read_text())["status"] == (
        "timeout"
    )
    assert main(arguments) == ExitCode.OK


def test_a_plan_that_was_tampered_with_is_refused(
    own_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arrays = storage.read_arrays(own_run / "plan.npz")
    name = next(name for name in sorted(arrays) if name.endswith(".state"))
    moved = arrays[name] + np.array([0.5, 0.0, 0.0, 0.0, 0.0])
    storage.write_arrays(own_run / "plan.npz", {**arrays, name: moved})
    assert main(["verify", str(own_run)]) == ExitCode.MISSION_FAILED
    assert capsys.readouterr().out.startswith("not valid: r1: ")


@pytest.mark.parametrize("verb", ["verify", "execute", "audit"])
def test_a_plan_that_breaks_a_rule_is_no_mission_done(
    own_run: Path, verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """No robot keeps 5 m from obstacles; the drive itself is as it was."""
    plan = storage.read_json(own_run / "plan.json")
    plan["margins"]["r1"]["obstacle"] = 5.0
    storage.write_json(own_run / "plan.json", plan)
    assert main([verb, str(own_run)]) == ExitCode.MISSION_FAILED
    reported = capsys.readouterr().out
    assert "its margin there is 5.000 m" in reported
    assert "mission done" not in reported


def test_a_log_with_a_contact_fails_the_mission(
    own_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = storage.read_json(own_run / "log.json")
    touch = {"time_s": 1.0, "robot": log["robots"][0], "other": "wall"}
    log["contacts"] = [{**touch, "x_m": 0.0, "y_m": 0.0}]
    storage.write_json(own_run / "log.json", log)
    assert main(["audit", str(own_run)]) == ExitCode.MISSION_FAILED
    robot = touch["robot"]
    first, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith(f"mission failed: {robot} touched wall")
    assert main(["report", str(own_run)]) in {
        ExitCode.MISSION_FAILED,
        ExitCode.INVALID_FILE,
    }


@pytest.mark.parametrize("name", ["plan.npz", "plan.json", "log.npz", "log.json"])
def test_a_damaged_file_is_named(
    own_run: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (own_run / name).write_bytes((own_run / name).read_bytes()[:50])
    assert main(["audit", str(own_run)]) == ExitCode.INVALID_FILE
    reported = capsys.readouterr()
    assert str(own_run) in reported.err
    assert reported.out == ""


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["execute", "--controller", "mpcc"], "mpc"),
        (["render", "--size", "321x241"], "321x241"),
        (["render", "--fps", "100000"], "fps"),
    ],
)
def test_a_wrong_argument_leaves_the_run_as_it_was(
    own_run: Path,
    arguments: list[str],
    named: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    before = {path.name: path.read_bytes() for path in own_run.iterdir()}
    verb, *options = arguments
    assert main([verb, str(own_run), *options]) == ExitCode.USAGE
    assert named in capsys.readouterr().err
    after = {path.name: path.read_bytes() for path in own_run.iterdir()}
    redrawn = {"overview.png", "energy.png", "run.json", "report.html", "summary.json"}
    changed = {name for name in before if after.get(name) != before[name]}
    assert changed <= (redrawn if verb == "render" else set())


@pytest.mark.slow
def test_render_leaves_a_video_as_asked(own_run: Path) -> None:
    import av

    arguments = ["--size", "320x240", "--fps", "10", "--speed", "20"]
    assert main(["render", str(own_run), *arguments]) == ExitCode.OK
    with av.open(str(own_run / "mission.mp4")) as video:
        stream = video.streams.video[0]
        assert (stream.width, stream.height) == (320, 240)
        assert stream.average_rate == 10
    assert "mission.mp4" in (own_run / "report.html").read_text()


def test_a_run_that_is_refused_leaves_no_folder(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    arguments = ["--planner", "guided_tree", "--router", "exact", "--out", str(folder)]
    assert main(["plan", "quickstart", *arguments]) == ExitCode.USAGE
    assert not folder.exists()
