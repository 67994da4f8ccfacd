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


def test_bounds_are_wider_by_half_the_shorter_side(tmp_path: Path) -> None:
    """A centre at the file's bound is as far from the scene's as a robot can get."""
    (tmp_path / "straight.yaml").write_text(FILE)
    scene = bench_kinodynamic.benchmark_scene(tmp_path / "straight.yaml", tmp_path)
    by_m = 0.125 + bench_kinodynamic.OBSTACLE_MARGIN_M
    assert scene.bounds == pytest.approx((-by_m, -by_m, 6.0 + by_m, 4.0 + by_m))


def test_the_straight_line_ends_where_the_finish_begins(tmp_path: Path) -> None:
    (tmp_path / "straight.yaml").write_text(FILE)
    scene = bench_kinodynamic.benchmark_scene(tmp_path / "straight.yaml", tmp_path)
    assert bench_kinodynamic.straight_line_s(scene) == pytest.approx((3.0 - 0.2) / 0.5)


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
