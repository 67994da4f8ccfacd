"""The bench of missions drawn at random."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bench_random
import pytest


def test_the_bench_plans_missions_and_writes_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "rows.jsonl"
    options = ["--missions", "98-98", "--output", str(output)]
    monkeypatch.setattr(sys, "argv", ["bench", *options])
    assert bench_random.main() == 0
    (row,) = [json.loads(line) for line in output.read_text().splitlines()]
    assert (row["scene"], row["violations"]) == ("mission98", 0)


def test_a_number_makes_the_same_mission_again(tmp_path: Path) -> None:
    drawn = [bench_random.mission(number, tmp_path) for number in (7, 7, 8)]
    assert drawn[0].digest == drawn[1].digest != drawn[2].digest


def test_each_want_is_drawn_by_turns(tmp_path: Path) -> None:
    drawn = [bench_random.mission(number, tmp_path) for number in range(40)]
    wants = {
        "robots that turn on the spot": [
            any(robot.model.motion_model == "unicycle" for robot in one.robots)
            for one in drawn
        ],
        "several models": [
            len({robot.model.mass_kg for robot in one.robots}) > 1 for one in drawn
        ],
        "finishes": [any(robot.finish for robot in one.robots) for one in drawn],
        "headings": [
            any(goal.heading_rad is not None for goal in one.goals) for one in drawn
        ],
        "stays": [any(goal.dwell_s for goal in one.goals) for one in drawn],
        "stations": [bool(one.stations) for one in drawn],
        "terrain": [bool(one.terrain) for one in drawn],
        "makespan": [one.objective.energy_weight == 0.0 for one in drawn],
    }
    for what, is_wanted in wants.items():
        assert 2 < sum(is_wanted) < 38, what
