"""The bench of foreign maps, on a map and a mission of a few places."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bench_maps
import numpy as np
import pytest


def test_the_bench_plans_on_a_map_and_writes_rows(
    hall: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    output = tmp_path / "rows.jsonl"
    options = ["--robots", "2", "--goals", "3", "--seeds", "0-1"]
    options += ["--json", str(tmp_path / "maps.json")]
    monkeypatch.setattr(
        sys, "argv", ["bench", str(hall), *options, "--output", str(output)]
    )
    assert bench_maps.main() == 0
    assert "\nhall | 2/2 | " in capsys.readouterr().out
    rows = [json.loads(line) for line in output.read_text().splitlines()]
    assert [row["seed"] for row in rows] == [0, 1]
    for row in rows:
        assert row["problem"]["source"] == str(hall)
        assert (row["problem"]["robots"], row["problem"]["goals"]) == (2, 3)
        assert row["violations"] == 0
    written = json.loads((tmp_path / "maps.json").read_text())
    (line,) = written["rows"]
    assert (line["scene"], line["ok"], line["runs"]) == ("hall", 2, 2)
    assert [Path(one).name for one in written["protocol"]["maps"]] == [hall.name]


def test_robots_may_have_to_end_where_they_start(
    hall: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = [str(hall), "--robots", "2", "--goals", "3"]
    for more, back in (([], False), (["--finish-at-start"], True)):
        monkeypatch.setattr(sys, "argv", ["bench", *options, *more])
        scene = bench_maps.populated(hall, bench_maps.parse_options())
        for robot in scene.robots:
            assert (robot.finish is not None) == back
            if robot.finish:
                assert robot.finish.region.depth(np.array([robot.pose[:2]])) > 0.0


def test_robots_may_be_of_any_model(
    hall: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = [str(hall), "--robots", "1", "--goals", "2"]
    for more, name in (([], "car"), (["--model", "diffdrive"], "diffdrive")):
        monkeypatch.setattr(sys, "argv", ["bench", *options, *more])
        (robot,) = bench_maps.populated(hall, bench_maps.parse_options()).robots
        assert robot.model.origin is not None
        assert robot.model.origin.reference == name


def test_a_map_that_is_not_there_is_named(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys, "argv", ["bench", "nowhere.txt"])
    assert bench_maps.main() == 2
    assert "nowhere.txt" in capsys.readouterr().err
