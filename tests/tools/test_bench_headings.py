"""The bench of headings, in one yard."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bench_headings
import pytest


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
