"""Disturbed executions, studies of them and replays, as a user calls them."""

from __future__ import annotations

import json
import shlex
import shutil
from pathlib import Path

import pytest

from mrmg.cli import show_commands
from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.simulation.disturbance import DEFAULT_RANGES
from mrmg.simulation.log import ExecutionLog

SCENE = Path(__file__).parents[1] / "scenes" / "one_goal.yaml"


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "one_goal"
    assert main(["run", str(SCENE), "--no-video", "--out", str(folder)]) == ExitCode.OK
    return folder


@pytest.fixture
def run(planned: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(planned, tmp_path / "run"))


def test_an_execution_is_disturbed_as_asked(run: Path) -> None:
    assert main(["execute", str(run), "--disturb"]) == ExitCode.OK
    log = ExecutionLog.load(run.parent / "run-disturbed-s0")
    assert log.disturbance == DEFAULT_RANGES.draw(0, ["r1"])
    command = ["execute", str(run), "--disturb", "rolling=+30%", "--disturb-seed", "4"]
    assert main(command) == ExitCode.OK
    folder = run.parent / "run-disturbed-rolling+30-s4"
    disturbance = ExecutionLog.load(folder).disturbance
    assert disturbance is not None
    assert (disturbance.seed, disturbance.robots[0].rolling) == (4, 0.3)
    arguments = json.loads((folder / "run.json").read_text())["arguments"]
    assert (arguments["disturb"], arguments["disturb_seed"]) == ("rolling=+30%", 4)


def test_a_disturbed_run_is_driven_undisturbed_beside_it(
    planned: Path, tmp_path: Path
) -> None:
    out = ["--out", str(tmp_path / "run")]
    main(["run", str(SCENE), "--no-video", "--disturb", *out])
    assert main(["execute", str(tmp_path / "run")]) == ExitCode.OK
    assert ExecutionLog.load(tmp_path / "run").disturbance is not None
    own = tmp_path / "run-undisturbed"
    assert (own / "log.npz").read_bytes() == (planned / "log.npz").read_bytes()


@pytest.mark.parametrize("verb", ["execute", "robustness"])
@pytest.mark.parametrize(
    ("spec", "named"),
    [
        ("weight=+5%", "allowed: mass, friction"),
        ("lag=fast", "lag=fast: not a value"),
        ("none,none", "'none' is not key=value"),
    ],
)
def test_a_wrong_disturbance_is_refused(
    verb: str, spec: str, named: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (run / "log.npz").read_bytes()
    assert main([verb, str(run), "--disturb", spec]) == ExitCode.USAGE
    output = capsys.readouterr().err
    assert named in output
    assert output.count("\n") == 1
    assert (run / "log.npz").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["robustness"], "RUN"),
        (["robustness", "runs/x", "--trials", "0"], "--trials"),
        (["robustness", "runs/x", "--workers", "x"], "--workers"),
        (["robustness", "runs/x", "--seed", "-1"], "--seed"),
        (["execute", "runs/x", "--disturb", "--disturb-seed", "x"], "--disturb-seed"),
        (["replay"], "CAPSULE"),
    ],
)
def test_wrong_usage_names_the_argument(
    arguments: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == ExitCode.USAGE
    assert named in capsys.readouterr().err


def test_a_study_is_printed_and_its_worst_case_repeatable(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["robustness", str(run), "--trials", "2", "--disturb", "capacity=-80%"]
    assert main(command) == ExitCode.OK
    output = capsys.readouterr().out
    assert output.startswith("2 of 2 trials feasible: probability 100.0%, 95% interval")
    (worst,) = (line for line in output.splitlines() if "worst case" in line)
    words = shlex.split(worst.split("worst case")[1])
    assert words[:3] == ["mrmg", "execute", str(run)]
    study = json.loads((run / "robustness.json").read_text())["studies"][0]
    assert main(words[1:]) == ExitCode.OK
    (folder,) = run.parent.glob("run-disturbed-*")
    log = ExecutionLog.load(folder)
    assert log.disturbance is not None
    assert log.disturbance.seed == study["worst"]["seed"]
    assert log.digest == study["outcomes"][log.disturbance.seed]["log_digest"]


def test_a_study_shows_in_the_report(run: Path) -> None:
    assert "Robustness" not in (run / "report.html").read_text()
    main(["robustness", str(run), "--trials", "1"])
    assert "<h2>Robustness</h2>" in (run / "report.html").read_text()


def test_a_study_speaks_json(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["robustness", str(run), "--trials", "1", "--json"]) == ExitCode.OK
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((run / "robustness.json").read_text())["studies"][0]


def test_a_failed_execution_is_replayed(
    run: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = ["--out", str(run.parent / "failed")]
    command = ["execute", str(run), "--disturb", "capacity=-90%", *out]
    assert main(command) == ExitCode.MISSION_FAILED
    run = run.parent / "failed"
    assert main(["replay", str(run / "capsule.zip")]) == ExitCode.OK
    output = capsys.readouterr().out
    assert "fails in the same way, bit for bit" in output
    assert "battery ran empty" in output
    assert (run / "replay" / "log.json").exists()
    assert main(["replay", str(run / "capsule.zip"), "--json"]) == ExitCode.OK
    assert json.loads(capsys.readouterr().out)["same_bits"] is True
    monkeypatch.setattr(show_commands, "view", lambda options: print(options.source))
    command = ["replay", str(run / "capsule.zip"), "--json", "--view"]
    assert main(command) == ExitCode.OK
    output = capsys.readouterr()
    assert json.loads(output.out)["same_bits"] is True
    assert str(run / "replay") in output.err


def test_what_is_no_capsule_is_refused(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(run / "plan.json")]) == ExitCode.INVALID_FILE
    assert "no usable capsule" in capsys.readouterr().err
    assert main(["replay", str(run / "capsule.zip")]) == ExitCode.INVALID_FILE
    assert "cannot be read" in capsys.readouterr().err
