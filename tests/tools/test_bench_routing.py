"""The bench of the routers: what it compares, on fewer missions."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import bench_routing
import numpy as np
import pytest

from mrmg.planning.routing.routing import RouterParams, solve_routing

ROOT = Path(__file__).parents[2]

INSTANCE = """\
ID Type Longitude Latitude
D d 0.0 0.0
F1 f 0.0 1.0
C1 c 0.0 2.0
C2 c 1.0 0.0

Q Vehicle fuel tank capacity /60/
"""
"""A depot on the equator, a station 73 miles north, one customer twice as far."""

DEGREE = np.radians(1.0) * 4182.44949
"""Length of a degree of longitude or latitude at the equator [miles]."""


def test_instances_are_read(tmp_path: Path) -> None:
    path = tmp_path / "instance.txt"
    path.write_text(INSTANCE)
    problem = bench_routing.read_green_vrp(path, vehicles=2)
    assert problem.goals == 2
    assert problem.cost.shape == (2, 4, 3)
    assert problem.cost[0, 3] == pytest.approx([2 * DEGREE, DEGREE, DEGREE])
    assert problem.finish[1, 0] == pytest.approx(2 * DEGREE)
    assert problem.time[0, 3] == pytest.approx(
        [2 * DEGREE / 40 + 0.5, DEGREE / 40 + 0.5, DEGREE / 40 + 0.25]
    )
    routing = solve_routing(problem, RouterParams(rounds=50), 0)
    assert routing.cost_J == pytest.approx(6 * DEGREE)


def test_the_router_is_at_work_before_it_is_timed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Trials of an earlier call may have made that earlier ones do it."""
    path, rounds = tmp_path / "instance.txt", []
    path.write_text(INSTANCE)
    find_router = bench_routing.find_router

    def noted(params: RouterParams) -> Any:
        rounds.append(params.rounds)
        return find_router(params)

    monkeypatch.setattr(bench_routing, "find_router", noted)
    row = bench_routing.green_row(path, 6 * DEGREE, RouterParams(rounds=50))
    assert rounds == [1, 50]
    assert row["found"] == pytest.approx(6 * DEGREE)


@pytest.mark.parametrize("name", ["S1_2i6s", "S1_4i2s", "S1_4i4s", "S1_4i6s"])
def test_proven_optima_are_found(name: str) -> None:
    path = ROOT / ".." / "shared" / "routing" / f"{name}.txt"
    if not path.exists():
        pytest.skip(f"needs {path.name} in ../shared/routing")
    problem = bench_routing.read_green_vrp(path)
    routing = solve_routing(problem, RouterParams(rounds=5000), 0)
    assert round(routing.cost_J, 2) == bench_routing.PROVEN[name]


def test_the_bench_prints_tables_and_writes_rows(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    output = tmp_path / "rows.jsonl"
    options = ["--instances", "5", "--folder", str(tmp_path / "none")]
    options += ["--json", str(tmp_path / "routing.json")]
    monkeypatch.setattr(sys, "argv", ["bench", *options, "--output", str(output)])
    assert bench_routing.main() == 0
    printed = capsys.readouterr().out
    assert all(f"\n{name} | " in printed for name in ("nrpa", "search", "exact"))
    assert "no Green VRP instances" in printed
    rows = [json.loads(line) for line in output.read_text().splitlines()]
    assert len(rows) == 15
    assert all(row["gap"] <= 1e-9 for row in rows if row["router"] == "exact")
    written = json.loads((tmp_path / "routing.json").read_text())
    assert [row["router"] for row in written["rows"]] == ["nrpa", "search", "exact"]
    assert [row["missions"] for row in written["rows"]] == [5, 5, 5]
    assert written["rows"][2]["optimal"] == 5
    assert written["instances"] == []


def test_large_missions_are_compared_with_long_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = tmp_path / "large.json"
    options = ["--large", "--goals", "100", "--seeds", "0", "--seconds", "0.1"]
    options += ["--reference", "0.2", "--references", "1", "--json", str(written)]
    monkeypatch.setattr(sys, "argv", ["bench", *options])
    code = bench_routing.main()
    document = json.loads(written.read_text())
    assert [row["missions"] for row in document["rows"]] == [1, 1]
    assert document["ok"] == (code == 0)
    for row in document["missions"]:
        assert row["best_J"] <= min(row["first_J"], row["found_J"])
        assert row["gap_pct"] == pytest.approx(
            100 * (row["found_J"] / row["best_J"] - 1)
        )
