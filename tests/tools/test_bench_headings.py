"""The bench of headings, in one yard."""

from __future__ import annotations

import json
import sys
from math import atan2, sin
from pathlib import Path

import bench_headings
import numpy as np
import pytest
from shapely.geometry import Point


def test_the_bench_plans_in_yards_and_writes_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output, table = tmp_path / "rows.jsonl", tmp_path / "headings.json"
    options = ["--yards", "1-1", "--output", str(output), "--json", str(table)]
    monkeypatch.setattr(sys, "argv", ["bench", *options])
    assert bench_headings.main() == 0
    (row,) = [json.loads(line) for line in output.read_text().splitlines()]
    assert (row["scene"], row["violations"]) == ("yard1", 0)
    assert (row["problem"]["robots"], row["problem"]["goals"]) == (3, 7)
    (line,) = json.loads(table.read_text())["rows"]
    assert (line["scene"], line["ok"], line["runs"]) == ("yard1", 1, 1)


def test_yards_are_the_same_again_and_all_differ() -> None:
    yards = [bench_headings.yard("car", number, 2) for number in range(4)]
    again = [bench_headings.yard("car", number, 2) for number in range(4)]
    assert [one.digest for one in yards] == [one.digest for one in again]
    assert len({one.digest for one in yards}) == 4
    aimed = [goal.heading_rad is not None for goal in yards[0].goals]
    assert aimed == [True] * 2 + [False] * 5


def test_robots_end_in_bays() -> None:
    """A bay's walls stand 8 cm beside a robot, which heads along them at its end."""
    scene = bench_headings.yard("car", 3, 0, 2)
    assert len(scene.obstacles) == 2 * 2
    for i, robot in enumerate(scene.robots[:2]):
        low, high = (one.shape for one in scene.obstacles[2 * i : 2 * i + 2])
        assert low.distance(high) == pytest.approx(1.1 + 2 * 0.08)
        assert robot.finish is not None
        end = Point(robot.finish.region.center)
        assert abs(low.distance(end) - high.distance(end)) <= 2 * 0.15
        assert robot.finish.heading_rad is not None
        across = np.subtract(high.centroid.coords, low.centroid.coords)[0]
        off = sin(robot.finish.heading_rad - atan2(across[1], across[0]))
        assert abs(abs(off) - 1.0) < 0.01
