"""Results that cost time are kept unless --overwrite asks to replace them."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.plans import Plan
from mrmg.runs.folder import OUTPUTS, Step
from mrmg.simulation.log import ExecutionLog

SCENE = Path(__file__).parents[1] / "scenes" / "one_goal.yaml"
SQUARE_MAP = "[SCALE]\n1\n[BORDER]\n0 0\n200 0\n200 150\n0 150\n"
WITHOUT_VIDEO = {
    name for step in Step if step is not Step.RENDER for name in OUTPUTS[step]
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run with (a stand-in of) a video and a study."""
    folder = tmp_path_factory.mktemp("runs") / "yard"
    assert main(["run", str(SCENE), "--no-video", "--out", str(folder)]) == ExitCode.OK
    assert main(["robustness", str(folder), "--trials", "1"]) == ExitCode.OK
    record = json.loads((folder / "run.json").read_text())
    # The mark of a video made with other options than those of `run`.
    record["finished"]["render"] = "of a video"
    (folder / "run.json").write_text(json.dumps(record))
    (folder / "mission.mp4").write_bytes(b"a film")
    assert main(["report", str(folder)]) == ExitCode.OK
    return folder


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "yard"))


def content(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.mark.parametrize(
    ("options", "beside"),
    [
        (["--disturb", "--disturb-seed", "4"], "yard-disturbed-s4"),
        (["--disturb", "rolling=+30%"], "yard-disturbed-rolling+30-s0"),
        (["--fault", "r1@2s"], "yard-fault-r1-2s"),
        (["--replan"], "yard-replan"),
        (["--controller", "tvlqr"], "yard-tvlqr"),
    ],
)
def test_another_drive_goes_to_a_run_folder_of_its_own(
    options: list[str], beside: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = content(run)
    code = main(["execute", str(run), *options])
    assert code == (ExitCode.MISSION_FAILED if "--fault" in options else ExitCode.OK)
    assert content(run) == before
    other = run.parent / beside
    assert str(other / "report.html") in capsys.readouterr().out
    assert {path.name for path in other.iterdir()} >= {*WITHOUT_VIDEO, "run.json"}
    assert (other / "plan.npz").read_bytes() == (run / "plan.npz").read_bytes()
    # The other verbs take the folder, and agree with the drive.
    for verb in ("verify", "audit", "report", "execute"):
        expected = ExitCode.OK if verb == "verify" else code
        assert main([verb, str(other), *(options if verb == "execute" else [])]) == (
            expected
        )
    assert content(run) == before


def test_a_drive_goes_where_out_says(run: Path, tmp_path: Path) -> None:
    before = content(run)
    out = ["--out", str(tmp_path / "elsewhere")]
    assert main(["execute", str(run), "--disturb", *out]) == ExitCode.OK
    assert ExecutionLog.load(tmp_path / "elsewhere").disturbance is not None
    assert main(["execute", str(run), "--disturb", *out]) == ExitCode.OK  # as before
    kept = content(tmp_path / "elsewhere")
    assert main(["execute", str(run), "--replan", *out]) == ExitCode.USAGE
    assert content(tmp_path / "elsewhere") == kept
    assert main(["execute", str(run), "--replan", *out, "--overwrite"]) == ExitCode.OK
    assert ExecutionLog.load(tmp_path / "elsewhere").disturbance is None
    assert content(run) == before


def test_the_same_drive_is_kept_and_driven_again_on_request(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = content(run)
    assert main(["execute", str(run)]) == ExitCode.OK
    assert "--overwrite drives again" in capsys.readouterr().out
    assert content(run) == before
    assert main(["execute", str(run), "--overwrite"]) == ExitCode.OK
    after = content(run)
    assert set(before) - set(after) == {"mission.mp4"}  # which had no valid mark
    assert after["log.npz"] == before["log.npz"]
    assert after["report.html"] == before["report.html"]
    (run / "log.npz").write_bytes(b"half a l")
    assert main(["execute", str(run)]) == ExitCode.OK  # damage is no result
    assert content(run)["log.npz"] == before["log.npz"]


@pytest.mark.parametrize("verb", ["run", "plan"])
@pytest.mark.parametrize(
    ("scene", "options", "named"),
    [
        ("quickstart", [], "scene 'one_goal' (now 'quickstart')"),
        (str(SCENE), ["--seed", "1"], "--seed 0 (now 1)"),
        (str(SCENE), ["--objective", "makespan"], "--objective not given"),
        (str(SCENE), ["--soc-margin", "0.3"], "--soc-margin not given (now 0.3)"),
    ],
)
def test_results_of_something_else_are_not_replaced(
    verb: str,
    scene: str,
    options: list[str],
    named: str,
    run: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    before = content(run)
    video = ["--no-video"] if verb == "run" else []
    command = [verb, scene, *options, *video, "--out", str(run)]
    assert main(command) == ExitCode.USAGE
    output = capsys.readouterr()
    for part in (
        named,
        "plan, drive, video, trials under disturbances",
        "--overwrite",
        "--out DIR",
    ):
        assert part in output.err
    assert output.out == ""
    assert content(run) == before


def test_overwrite_replaces_them(run: Path) -> None:
    command = ["run", str(SCENE), "--seed", "1", "--no-video", "--out", str(run)]
    assert main([*command, "--overwrite"]) == ExitCode.OK
    assert Plan.load(run).seed == 1
    assert not (run / "mission.mp4").exists()


def test_an_edited_scene_is_not_run_over_its_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("site.yaml").write_text(SCENE.read_text())
    command = ["plan", "site.yaml"]
    assert main(command) == ExitCode.OK
    before = content(tmp_path / "runs")
    Path("site.yaml").write_text(SCENE.read_text() + "time_limit: 900\n")
    assert main(command) == ExitCode.USAGE
    output = capsys.readouterr().err
    assert "before it was changed" in output
    assert "runs/one_goal-s0" in output
    assert content(tmp_path / "runs") == before
    assert main([*command, "--overwrite"]) == ExitCode.OK
    assert content(tmp_path / "runs") != before


def test_the_same_command_continues_and_keeps_what_is_there(run: Path) -> None:
    before = content(run)
    command = ["run", str(SCENE), "--no-video", "--out", str(run)]
    assert main(command) == ExitCode.OK
    assert main(["plan", str(SCENE), "--out", str(run)]) == ExitCode.OK
    for verb in ("verify", "audit", "report"):
        assert main([verb, str(run)]) == ExitCode.OK
    after = content(run)
    assert {name for name in before if after.get(name) != before[name]} <= {"run.json"}


def test_a_changed_verdict_renews_the_report(run: Path) -> None:
    page = (run / "report.html").read_text()
    from mrmg import storage

    arrays = storage.read_arrays(run / "plan.npz")
    arrays["r1.state"] = arrays["r1.state"] + [0.5, 0.0, 0.0, 0.0, 0.0]
    storage.write_arrays(run / "plan.npz", arrays)
    assert main(["verify", str(run)]) == ExitCode.MISSION_FAILED
    assert (run / "report.html").read_text() != page


def test_a_plan_of_another_scene_leaves_no_folder_for_its_drive(run: Path) -> None:
    plan = json.loads((run / "plan.json").read_text())
    (run / "plan.json").write_text(json.dumps({**plan, "scene_digest": "0" * 16}))
    there = sorted(run.parent.iterdir())
    assert main(["execute", str(run), "--disturb"]) == ExitCode.INVALID_FILE
    assert sorted(run.parent.iterdir()) == there


def test_a_replay_does_not_replace_another_run(run: Path, tmp_path: Path) -> None:
    failed = tmp_path / "failed"
    out = ["--out", str(failed)]
    main(["execute", str(run), "--disturb", "capacity=-90%", *out])
    capsule = str(failed / "capsule.zip")
    before = content(run)
    assert main(["replay", capsule, "--out", str(run)]) == ExitCode.USAGE
    assert content(run) == before
    own = content(failed)
    assert main(["replay", capsule, *out]) == ExitCode.OK  # of itself
    after = content(failed)
    changed = {name for name in own if after.get(name) != own[name]}
    assert changed <= {"timing.json", "run.json"}  # the clock's, and its digest
    assert main(["replay", capsule, "--out", str(run), "--overwrite"]) == ExitCode.OK


@pytest.mark.parametrize(
    "command",
    [
        ["scene", "import", "square.txt"],
        ["calibrate", "car"],
    ],
)
def test_what_may_have_been_edited_is_not_replaced(
    command: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("square.txt").write_text(SQUARE_MAP)
    out = tmp_path / "mine"
    if command[0] == "calibrate":
        out.mkdir()
        (out / "robot.yaml").write_text("mine")
    else:
        out.write_text("mine")
    before = content(tmp_path)
    assert main([*command, "-o", str(out)]) == ExitCode.USAGE
    assert "--overwrite" in capsys.readouterr().err
    assert content(tmp_path) == before
    if command[0] == "scene":
        assert main([*command, "-o", str(out), "--overwrite"]) == ExitCode.OK
        assert content(tmp_path) != before
