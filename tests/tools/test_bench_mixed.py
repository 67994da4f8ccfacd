"""The bench of missions that want many things at once, on a map of its own."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bench_mixed
import numpy as np
import pytest


def test_the_bench_plans_missions_and_writes_rows(
    hall: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = hall.with_name("rows.jsonl")
    options = [str(hall), "--missions", "0-0", "--output", str(output)]
    monkeypatch.setattr(sys, "argv", ["bench", *options])
    assert bench_mixed.main() == 0
    (row,) = [json.loads(line) for line in output.read_text().splitlines()]
    assert (row["scene"], row["violations"]) == ("mission0", 0)


def test_a_number_makes_the_same_mission_again(hall: Path) -> None:
    drawn = [bench_mixed.mission(number, [hall]) for number in (7, 7, 8)]
    assert drawn[0].digest == drawn[1].digest != drawn[2].digest


def test_each_want_is_drawn_by_turns() -> None:
    drawn = []
    for number in range(60):
        document: dict[str, Any] = {
            "robots": [{"model": "hauler", "pose": [x, 0.0, 0.0]} for x in range(4)],
            "goals": [{} for _ in range(6)],
            "stations": [{}],
        }
        bench_mixed.add_wants(document, np.random.default_rng(number))
        drawn.append(document)
    wants: dict[str, Callable[[dict[str, Any]], bool]] = {
        "several models": lambda one: len({r["model"] for r in one["robots"]}) > 1,
        "finishes": lambda one: any("finish" in r for r in one["robots"]),
        "final headings": lambda one: any(
            "heading" in r.get("finish", ()) for r in one["robots"]
        ),
        "headings": lambda one: any("heading" in goal for goal in one["goals"]),
        "stays": lambda one: any("dwell" in goal for goal in one["goals"]),
        "one robot at a time": lambda one: "capacity" in one["stations"][0],
        "makespan": lambda one: "objective" in one,
    }
    for what, is_wanted in wants.items():
        assert 2 < sum(map(is_wanted, drawn)) < 58, what


def test_no_map_is_said(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    monkeypatch.setattr(bench_mixed, "FOLDER", tmp_path)
    monkeypatch.setattr(sys, "argv", ["bench"])
    assert bench_mixed.main() == 2
    assert "name some" in capsys.readouterr().err
