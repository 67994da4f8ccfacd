"""The bench of goals beside walls, in one hall."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bench_docks
import pytest


def test_the_bench_plans_in_halls_and_writes_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output, table = tmp_path / "rows.jsonl", tmp_path / "docks.json"
    options = ["--halls", "3-3", "--output", str(output), "--json", str(table)]
    monkeypatch.setattr(sys, "argv", ["bench", *options])
    assert bench_docks.main() == 0
    (row,) = [json.loads(line) for line in output.read_text().splitlines()]
    assert (row["scene"], row["violations"]) == ("hall3", 0)
    assert (row["problem"]["robots"], row["problem"]["goals"]) == (2, 7)
    (line,) = json.loads(table.read_text())["rows"]
    assert (line["scene"], line["ok"], line["runs"]) == ("hall3", 1, 1)


@pytest.mark.parametrize("model", ["diffdrive", "car"])
def test_halls_are_the_same_again_and_all_differ(model: str) -> None:
    halls = [bench_docks.hall(model, number).digest for number in range(4)]
    assert halls == [bench_docks.hall(model, number).digest for number in range(4)]
    assert len(set(halls)) == 4
