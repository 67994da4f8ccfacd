"""The bench of logs, on a few that follow a law."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bench_logs
import numpy as np
import pytest


def write_run(path: Path, number: int, factor: float) -> None:
    """Half a minute at a few speeds, rolling 100 W s/m and turning 200 W s/rad."""
    rng = np.random.default_rng(number)
    speed, yaw_rate = (np.repeat(rng.uniform(0.1, 0.8, 8), 20) for _ in range(2))
    power = factor * (100.0 * speed + 200.0 * yaw_rate + 20.0)
    rows = zip(0.2 * np.arange(160), speed, yaw_rate, power, strict=True)
    lines = [",".join(map(str, row)) for row in rows]
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join(["time,v,yaw_rate,power", *lines]))


@pytest.mark.parametrize(("stray", "code"), [(0.02, 0), (0.9, 1)])
def test_laws_are_compared_and_judged(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    stray: float,
    code: int,
) -> None:
    """Runs that differ by much from each other cannot be predicted well."""
    for number in range(10):
        factor = float(np.exp(stray * (number - 4.5) / 3.0))
        folder = tmp_path / ("soil" if number % 2 else "gravel")
        write_run(folder / f"{number}.csv", number, factor)
    document = tmp_path / "bench.json"
    arguments = ["--folder", str(tmp_path), "--json", str(document)]
    monkeypatch.setattr(sys, "argv", ["bench", *arguments])
    assert bench_logs.main() == code
    assert ("PASS" if code == 0 else "FAIL") in capsys.readouterr().out
    written = json.loads(document.read_text())
    assert written["ok"] is (code == 0)
    assert len(written["rows"]) == 4
    assert [item["terrain"] for item in written["terrains"]] == ["gravel", "soil"]
    assert len(written["runs"]) == 10


def test_a_folder_without_logs_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["bench", "--folder", str(tmp_path)])
    assert bench_logs.main() == 1
    assert str(tmp_path) in capsys.readouterr().err
