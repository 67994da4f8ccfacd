"""`mrmg calibrate`: from a model folder to a calibrated copy, figures and plot."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from mrmg import shipped
from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.scene.loading.models import load_model

CAR = shipped.models_folder() / "car"


@pytest.fixture
def model_folder(tmp_path: Path) -> Path:
    """A car whose robot.yaml is wrong about its rolling."""
    folder = tmp_path / "buggy"
    shutil.copytree(CAR, folder)
    text = (folder / "robot.yaml").read_text()
    wrong = text.replace("rolling_coefficient: 0.06 ", "rolling_coefficient: 0.04 ")
    assert wrong != text
    (folder / "robot.yaml").write_text(wrong)
    return folder


@pytest.mark.slow
def test_a_wrong_model_is_put_right(model_folder: Path) -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "mrmg", "calibrate", "buggy", "--json", "--in-place"],
        capture_output=True,
        text=True,
        cwd=model_folder.parent,
        check=False,
    )
    assert ended.returncode == ExitCode.OK, ended.stderr
    out = model_folder.parent / "calibrated-buggy"
    assert json.loads(ended.stdout) == json.loads(
        (out / "calibration.json").read_text()
    )
    assert (out / "calibration.png").read_bytes().startswith(b"\x89PNG")
    for folder in (out, model_folder):
        model, _ = load_model(folder)
        assert model.rolling_coefficient == pytest.approx(0.06, rel=1e-3)
        assert "; calibrated in MuJoCo" in (folder / "robot.yaml").read_text()


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["calibrate", "kar"], "unknown model 'kar'"),
        (["calibrate", "no/such/folder"], "no such folder"),
        (["calibrate", "car", "--plot", "fit.bmp"], ".png"),
        (["calibrate", "car", "-o", str(CAR)], "name another folder"),
        (["calibrate", "car", "--in-place"], "mrmg robot new NAME --like car"),
    ],
)
def test_wrong_usage_is_told_before_anything_is_driven(
    arguments: list[str],
    named: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == ExitCode.USAGE
    output = capsys.readouterr()
    assert named in output.err
    assert output.out == ""
    assert list(tmp_path.iterdir()) == []
