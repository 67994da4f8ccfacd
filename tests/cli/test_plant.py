"""A run on another plant says so wherever it says how it was driven."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from mrmg.cli.main import main
from mrmg.errors import ExitCode

SCENE = Path(__file__).parents[1] / "scenes" / "one_goal.yaml"


def test_the_plant_is_an_argument_of_the_drive(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    command = ["run", str(SCENE), "--no-video", "--out", str(run)]
    scrub = ["--plant", "scrub"]
    assert main([*command, *scrub]) == ExitCode.MISSION_FAILED
    assert "mrmg calibrate car --plant scrub" in capsys.readouterr().out
    record = json.loads((run / "run.json").read_text())
    assert record["arguments"]["plant"] == "scrub"
    assert json.loads((run / "log.json").read_text())["plant"] == "scrub"
    assert "--plant scrub" in (run / "report.html").read_text()
    # Another plant is another drive of the same plan, in a folder of its own.
    assert main(["execute", str(run), "--plant", "default"]) == ExitCode.OK
    other = tmp_path / "run-on-default"
    assert (run / "plan.npz").read_bytes() == (other / "plan.npz").read_bytes()
    assert json.loads((other / "log.json").read_text())["plant"] == "default"
    capsys.readouterr()
    trials = ["robustness", str(run), "--trials", "1", "--json", *scrub]
    assert main(trials) == ExitCode.OK
    study = json.loads(capsys.readouterr().out)
    assert study["options"]["plant"] == "scrub"


def test_a_plant_that_there_is_none_of_is_a_mistake(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit) as left:
        main(["run", str(SCENE), "--plant", "ice"])
    assert left.value.code == ExitCode.USAGE
    assert "'default', 'scrub'" in capsys.readouterr().err
