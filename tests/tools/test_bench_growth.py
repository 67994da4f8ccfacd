"""The bench of growth, on a tiny series."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import bench_growth
import growth_map
import numpy as np
import pytest
import shapely
from bench_growth import Case

from mrmg.scene.loading import scene_from_document

SMALL = {"goals": 3, "stations": 3, "boxes": 8, "side_m": 40.0}
TINY = [Case(series="robots", size=n, robots=n, **SMALL) for n in (1, 2)]


@pytest.mark.parametrize("boxes", [12, 200])
def test_maps_cover_the_same_share(boxes: int) -> None:
    drawn = growth_map.drawn_map(boxes, 0)
    scene = scene_from_document(drawn, source="test")
    shapes = [shapely.Polygon(wall.shape.exterior) for wall in scene.obstacles]
    assert len(shapes) == boxes
    share = sum(shape.area for shape in shapes) / growth_map.SIDE_M**2
    assert share == pytest.approx(growth_map.COVERED, rel=0.01)
    assert shapely.unary_union(shapes).area == pytest.approx(share * 1e4)


def test_maps_are_those_of_their_seeds() -> None:
    drawn = growth_map.drawn_map(12, 0)
    assert drawn == growth_map.drawn_map(12, 0)
    assert drawn != growth_map.drawn_map(12, 1)


def test_ground_grows_with_a_fleet() -> None:
    case = Case.of_fleet(4)
    assert (case.robots, case.goals, case.stations, case.side_m) == (4, 16, 4, 50.0)
    scene = bench_growth.scene_of(case, 0)
    assert scene.bounds == (0.0, 0.0, 50.0, 50.0)
    assert len(scene.goals) == 16


def test_sizes_are_chosen() -> None:
    usual, large = Case.of_fleet(32), Case.of_fleet(64)
    for sizes, most, chosen in (
        (None, None, (True, True)),
        (None, 32, (True, False)),
        ([64], None, (False, True)),
    ):
        found = tuple(bench_growth.is_chosen(x, sizes, most) for x in (usual, large))
        assert found == chosen


def test_every_case_has_its_numbers() -> None:
    for case in TINY:
        scene = bench_growth.scene_of(case, 0)
        placed = [len(part) for part in (scene.robots, scene.goals, scene.stations)]
        assert placed == [case.robots, case.goals, case.stations]


@pytest.mark.slow
def test_rows_and_figure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    output, figure = tmp_path / "rows.jsonl", tmp_path / "growth.svg"
    arguments = ["bench_growth", "--series", "robots", "--seeds", "1", "--drive"]
    arguments += ["--output", str(output), "--figure", str(figure)]
    document = tmp_path / "growth.json"
    arguments += ["--json", str(document)]
    monkeypatch.setattr(sys, "argv", arguments)
    monkeypatch.setattr(bench_growth, "SERIES", {"robots": TINY})
    assert bench_growth.main() == 0
    rows = [json.loads(line) for line in output.read_text().splitlines()]
    assert [row["size"] for row in rows] == [1, 2]
    assert all(row["ok"] and row["time_s"]["first_solution"] > 0.0 for row in rows)
    assert "time to the first plan" in figure.read_text()
    assert "robots | 2 | 0 | yes" in capsys.readouterr().out
    written = json.loads(document.read_text())
    assert [(row["size"], row["ok"]) for row in written["rows"]] == [(1, 1), (2, 1)]
    assert all(row["x_real_time_least"] > 0.0 for row in written["rows"])
    assert written["ok"] is True
    (power,) = written["exponents"]
    assert power["series"] == "robots"
    assert np.isfinite(power["exponent"])


def test_the_summary_has_a_line_for_the_missions_of_one_size() -> None:
    def row(size: int, first_s: float, ok: bool = True) -> dict[str, Any]:
        return {
            "series": "robots", "size": size, "robots": size, "goals": 20,
            "obstacles": 50, "ok": ok, "memory_MB": 250.4, "populate_s": 0.5,
            "plan_s": 2.0 * first_s,
            "time_s": {"first_solution": first_s, "routing": 0.25},
        }  # fmt: skip

    rows = [
        row(2, 0.5),
        row(2, 0.7),
        row(2, 1.5, ok=False),
        row(4, 2.0),
        row(8, 3.0, ok=False),
    ]
    lines = bench_growth.summary(bench_growth.sizes_of(rows)).splitlines()
    assert (
        lines[2] == "| robots | 2 | 20 | 50 | 2 of 3 | 0.60, 0.70 | 1.20 | 0.25 | 250 |"
    )
    assert (
        lines[3] == "| robots | 4 | 20 | 50 | 1 of 1 | 2.00, 2.00 | 4.00 | 0.25 | 250 |"
    )
    assert lines[4] == "| robots | 8 | 20 | 50 | 0 of 1 | nan, nan | nan | nan | 250 |"
    assert {line.count("|") for line in lines} == {10}
