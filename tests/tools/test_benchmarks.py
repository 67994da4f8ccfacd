"""BENCHMARKS.md is what `tools/benchmarks` makes of stored results."""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path

import benchmarks
import pytest
from benchmark_history import HISTORY

ROOT = benchmarks.TOOLS.parent
STORED = sorted(benchmarks.RESULTS.rglob("*.json"))


def test_the_page_is_made_of_the_stored_results() -> None:
    assert benchmarks.PAGE.read_text() == benchmarks.page(), "run tools/benchmarks"


def test_the_page_follows_the_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copied = tmp_path / "results"
    shutil.copytree(benchmarks.RESULTS, copied)
    monkeypatch.setattr(benchmarks, "RESULTS", copied)
    logs = copied / benchmarks.versions()[0] / "energy_logs.json"
    document = json.loads(logs.read_text())
    document["rows"][0]["median_error_pct"] = 77.7
    logs.write_text(json.dumps(document))
    assert benchmarks.page().count("77.7") == 2  # in its table, and in the history
    logs.unlink()
    title = "## Energy of a real robot\n\nNot measured yet."
    assert title in benchmarks.page()


def test_a_release_keeps_its_row_when_the_next_one_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copied = tmp_path / "results"
    shutil.copytree(benchmarks.RESULTS, copied)
    for name in ("0.9.0", "0.10.0"):
        shutil.copytree(copied / benchmarks.versions()[0], copied / name)
    monkeypatch.setattr(benchmarks, "RESULTS", copied)
    newest = benchmarks.versions()
    assert newest.index("0.10.0") < newest.index("0.9.0") < newest.index("0.1.0")
    rows = tables(benchmarks.page())[0][2:]
    assert [row[0] for row in rows] == newest
    assert rows[newest.index("0.9.0")][1:] == rows[0][1:]
    assert rows[0][1:] != rows[newest.index("0.1.0")][1:]


def test_every_table_has_rows_with_as_many_cells_as_heads() -> None:
    found = tables(benchmarks.PAGE.read_text())
    assert len(found[0][0]) == len(HISTORY) + 2
    for table in found:
        assert len(table) > 2, table[0]
        assert {len(row) for row in table} == {len(table[0])}, table[0]


def tables(page: str) -> list[list[list[str]]]:
    parts = re.findall(r"(?:^\|.*\|\n)+", page, re.MULTILINE)
    return [
        [
            [cell.strip() for cell in line.strip("|").split("|")]
            for line in part.split("\n")[:-1]
        ]
        for part in parts
    ]


@pytest.mark.parametrize("path", STORED, ids=lambda path: path.stem)
def test_results_name_where_they_come_from_and_no_place_of_a_machine(
    path: Path,
) -> None:
    text = path.read_text()
    assert not re.search(r'": "/|"/(?:home|root|tmp|work|Users)/', text)
    assert len(text) < 60_000
    if path.stem != "published":
        protocol = json.loads(text)["protocol"]
        assert {"command", "commit", "date", "machine"} <= protocol.keys()
        assert not str(protocol["commit"]).endswith("-changed")


def test_every_result_has_a_command_that_exists() -> None:
    by_hand = {"ablations", "published"}
    for path in STORED:
        assert path.stem in benchmarks.COMMANDS.keys() | by_hand
    for line in benchmarks.COMMANDS.values():
        tool = ROOT / "tools" / line.split()[0]
        assert os.access(tool, os.X_OK), tool
