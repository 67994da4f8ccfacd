"""A robot whose model does not describe it is reported as such, with the remedy."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.report.compare import compare_runs
from mrmg.shipped import models_folder
from mrmg.simulation.log import ExecutionLog

SCENE = Path(__file__).parents[1] / "scenes" / "one_goal.yaml"
ROLLING = 'name="rolling_coefficient" data="0.06"'


@pytest.fixture
def heavy_going(tmp_path: Path) -> Path:
    """A scene whose car rolls with half as much resistance again as it is said to."""
    own = shutil.copytree(models_folder() / "car", tmp_path / "mycar")
    text = (own / "car.xml").read_text()
    assert ROLLING in text
    (own / "car.xml").write_text(text.replace(ROLLING, ROLLING.replace("6", "9")))
    scene = tmp_path / "heavy.yaml"
    text = SCENE.read_text()
    assert "model: car" in text
    scene.write_text(text.replace("model: car", "model: ./mycar"))
    return scene


def test_a_mismatch_is_no_mission_done(
    heavy_going: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    command = ["run", str(heavy_going), "--no-video", "--out", str(run)]
    assert main(command) == ExitCode.MISSION_FAILED
    said = capsys.readouterr().out
    assert "model_mismatch" in said
    assert "'mycar' does not describe r1" in said
    assert "mrmg calibrate" in said
    summary = json.loads((run / "summary.json").read_text())
    assert summary["status"] == "model_mismatch"
    assert summary["mission_ok"] is False
    assert "Model mismatch" in (run / "report.html").read_text()
    assert not (run / "capsule.zip").exists()
    kept = shutil.copytree(run, tmp_path / "kept")
    outcomes = {row.name: row.values for row in compare_runs([run, kept]).rows}
    assert outcomes["outcome"] == ("model mismatch", "model mismatch")
    # The tolerance is an argument of every verb that judges, and of nothing else.
    digest = ExecutionLog.load(run).digest
    for verb in ("audit", "execute"):
        assert main([verb, str(run), "--energy-tolerance", "60"]) == ExitCode.OK
        strict = [verb, str(run), "--energy-tolerance", "5"]
        assert main(strict) == ExitCode.MISSION_FAILED
        assert "does not describe r1" in capsys.readouterr().out
    assert main([*command, "--energy-tolerance", "60"]) == ExitCode.OK
    assert ExecutionLog.load(run).digest == digest
    assert json.loads((run / "summary.json").read_text())["status"] == "solved"
    assert main(["execute", str(run), "--disturb"]) == ExitCode.OK


def test_work_that_goes_nowhere_is_no_mission_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    assert main(["run", str(SCENE), "--no-video", "--out", str(run)]) == ExitCode.OK
    assert "account for all but 0.00 % of the drives' work" in capsys.readouterr().out
    assert "Energy balance" in (run / "report.html").read_text()
    log = ExecutionLog.load(run)
    replace(log, work_J=1.03 * log.work_J).save(run)
    assert main(["audit", str(run)]) == ExitCode.MISSION_FAILED
    assert "the energy of r1 does not balance" in capsys.readouterr().out
    main(["report", str(run)])
    summary = json.loads((run / "summary.json").read_text())
    assert summary["status"] == "energy_imbalance"
    assert summary["mission_ok"] is False
    assert "Energy imbalance" in (run / "report.html").read_text()
    balance = json.loads((run / "audit.json").read_text())["robots"][0]["balance"]
    assert balance["residual_pct"] == pytest.approx(3.0 / 1.03, rel=0.01)
    assert balance["residual_J"] == pytest.approx(0.03 / 1.03 * balance["work_J"], 0.01)
