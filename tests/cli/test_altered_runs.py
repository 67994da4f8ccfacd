"""A run folder whose files were changed ends a command with one message."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from mrmg import storage
from mrmg.cli.main import main
from mrmg.errors import ExitCode

SCENE = Path(__file__).parents[1] / "scenes" / "one_goal.yaml"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "r"
    assert main(["run", str(SCENE), "--no-video", "--out", str(folder)]) == 0
    return folder


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "r"))


@pytest.mark.slow
def test_files_that_contradict_each_other_are_named(
    run: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = storage.read_arrays(run / "plan.npz")
    storage.write_arrays(run / "plan.npz", {**plan, "r1.state": np.zeros((2, 1))})
    assert main(["figure", str(run), "-o", str(run / "a.svg")]) == ExitCode.INVALID_FILE
    message = capsys.readouterr().err
    assert message.startswith(f"mrmg: {run / 'plan.npz'}: not as this version")
    assert "IndexError" in message
    assert "--overwrite" in message
    assert message.count("\n") == 1
    # What goes wrong with the files that mrmg wrote is a fault of mrmg.
    storage.write_arrays(run / "plan.npz", plan)
    monkeypatch.setattr("mrmg.viz.figure.draw_figure", lambda *a, **k: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["figure", str(run)])


def test_messages_are_lines_to_be_read(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scene", "check", "\x1b[31m" + "9" * 5000]) != ExitCode.OK
    message = capsys.readouterr().err
    assert "\x1b" not in message
    assert "x1b[31m999" in message
    assert max(map(len, message.splitlines())) < 450


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        {"format": 9},
        {"arguments": 3},
        {"arguments": {"video": {"seed": 1}}},
        {"arguments": {"unknown": 1}},
        {"finished": {"plan": []}},
        {"files": {"plan": 1}},
    ],
)
def test_a_damaged_record_is_named(
    change: dict[str, object], run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = json.loads((run / "run.json").read_text()) | change
    (run / "run.json").write_text(json.dumps(record))
    assert main(["audit", str(run)]) == ExitCode.INVALID_FILE
    assert "run.json: " in capsys.readouterr().err
