"""The bench of benchmarks with assigned goals, on a file of one robot."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bench_kinodynamic
import pytest

FILE = """\
environment:
  min: [0, 0]
  max: [6, 4]
  obstacles: []
robots:
  - type: unicycle_second_order_0
    start: [1, 2, 0, 0, 0]
    goal: [4, 2, 0, 0, 0]
"""


def test_trials_are_kept_and_the_document_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "straight.yaml").write_text(FILE)
    output, document = tmp_path / "rows.jsonl", tmp_path / "bench.json"
    arguments = ["--folder", str(tmp_path), "--output", str(output)]
    arguments += ["--json", str(document), "--seeds"]
    monkeypatch.setattr(sys, "argv", ["bench", *arguments, "0"])
    assert bench_kinodynamic.main() == 0
    first = output.read_text()
    assert "\nstraight | 1/1 | " in capsys.readouterr().out
    monkeypatch.setattr(sys, "argv", ["bench", *arguments, "0-1"])
    assert bench_kinodynamic.main() == 0
    assert output.read_text().startswith(first)
    rows = [json.loads(line) for line in output.read_text().splitlines()]
    assert [row["seed"] for row in rows] == [0, 1]
    written = json.loads(document.read_text())
    (line,) = written["rows"]
    assert (line["file"], line["solved"], line["runs"]) == ("straight", 2, 2)
    assert line["to_straight_line"] > 1.0
    assert line["status"] is None
    assert written["ok"] is True
