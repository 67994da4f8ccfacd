"""Figures and tables say what the bench wrote."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_figure import HEAD, draw_runtimes, table_rows
from bench_record import read_rows
from matplotlib.figure import Figure

from mrmg.errors import FileError, UsageError


def row(scene: str = "scene1", **changes: Any) -> dict[str, Any]:
    """Return a row as the bench writes it; `changes` are of its own or its times."""
    times = {"init": 0.1, "routing": 0.2, "first_solution": 0.4, "total": 0.8}
    data: dict[str, Any] = {
        "scene": scene,
        "seed": 0,
        "profile": "default",
        "status": "solved",
        "violations": 0,
        "conditions": "no time limit; some machine",
        "problem": {
            "source": scene,
            "robots": 2,
            "goals": 14,
            "stations": 5,
            "terrain_areas": 4,
            "capacity_m": 240.0,
        },
        "statistics": {"path_following_plans": 0, "expansions": 300, "time_s": times},
    }
    for name, value in changes.items():
        parts = (times, data["problem"], data["statistics"], data)
        next(part for part in parts if name in part)[name] = value
    return data


def written(path: Path, rows: list[dict[str, Any]]) -> Path:
    path.write_text("".join(json.dumps(item) + "\n" for item in rows))
    return path


def test_the_table_has_medians_shares_and_timeouts(tmp_path: Path) -> None:
    rows = [
        row(seed=0, first_solution=0.4, total=0.8, routing=0.2),
        row(seed=1, first_solution=0.5, total=1.0, routing=0.5),
        row(seed=2, status="timeout", first_solution=0.0, total=9.0, routing=0.9),
        row(seed=3, violations=2, first_solution=0.3),
        row("scene2", first_solution=0.2, capacity_m=199.6),
    ]
    table = [
        dict(zip(HEAD, line, strict=True))
        for line in table_rows(read_rows([written(tmp_path / "b.jsonl", rows)]))
    ]
    assert [line["scene"] for line in table] == ["scene1", "scene2"]
    first = table[0]
    assert (first["runs"], first["timeouts"]) == ("4", "2")
    assert first["first plan [s]"] == "0.450"
    assert first["total [s]"] == "0.900"
    assert first["solver [%]"] == "25"
    assert table[1]["capacity [m]"] == "200"


@pytest.mark.parametrize(
    ("plans", "expansions", "cells"),
    [
        ((3, 1, 2), (0, 0, 0), ("2", "–")),
        ((3, 1, 2), (0, 0, 80), ("2", "80 in 1")),
        ((0, 0, 0), (50, 70, 80), ("–", "70")),
    ],
)
def test_counts_are_of_the_runs_that_did_such_a_thing(
    tmp_path: Path,
    plans: tuple[int, ...],
    expansions: tuple[int, ...],
    cells: tuple[str, str],
) -> None:
    rows = [
        row(seed=seed, path_following_plans=plans[seed], expansions=expansions[seed])
        for seed in range(3)
    ]
    (line,) = table_rows(read_rows([written(tmp_path / "b.jsonl", rows)]))
    assert (
        line[HEAD.index("path-following plans")],
        line[HEAD.index("iterations")],
    ) == cells


def test_profiles_have_lines_of_their_own(tmp_path: Path) -> None:
    rows = [row(), row(profile="paper", status="timeout")]
    table = table_rows(read_rows([written(tmp_path / "b.jsonl", rows)]))
    profiles = [line[HEAD.index("profile")] for line in table]
    assert profiles == ["default", "paper"]
    assert table[1][HEAD.index("first plan [s]")] == "–"


def test_boxes_stand_at_the_medians_of_the_first_plans(
    tmp_path: Path, drawn: list[Figure]
) -> None:
    fleets = (1, 2, 4)
    rows = [row(seed=at, first_solution=0.1 * (at + 1)) for at in range(5)]
    rows += [
        row("scene6" if n == 4 else f"scene6_r{n}", robots=n, first_solution=0.1 * n)
        for n in fleets
    ]
    rows += [row(profile="paper", status="timeout", seed=7)]
    path = tmp_path / "f.svg"
    draw_runtimes(read_rows([written(tmp_path / "b.jsonl", rows)]), path)
    by_scene, by_fleet = drawn[0].axes
    assert labels(by_scene) == ["scene1", "scene6"]
    assert labels(by_fleet) == ["1", "2", "4"]
    assert by_fleet.get_xlabel() == "robots in scene6"
    assert medians(by_scene) == pytest.approx([0.3, 0.4])
    assert medians(by_fleet) == pytest.approx([0.1, 0.2, 0.4])
    assert [note.get_text() for note in by_scene.texts] == ["1/1\nfailed"]
    assert "time to the first plan" in path.read_text()


def labels(axes: Any) -> list[str]:
    return [label.get_text() for label in axes.get_xticklabels()]


def medians(axes: Any) -> list[float]:
    """Return the heights of the widest level lines, which are the boxes' medians."""
    return [
        float(line.get_ydata()[0])
        for line in axes.lines
        if line.get_linewidth() > 1.0 and np.ptp(line.get_ydata()) == 0.0
    ]


def test_one_fleet_needs_one_panel(tmp_path: Path, drawn: list[Figure]) -> None:
    path = written(tmp_path / "b.jsonl", [row()])
    draw_runtimes(read_rows([path]), tmp_path / "f.pdf")
    assert len(drawn[0].axes) == 1
    assert (tmp_path / "f.pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(UsageError, match="must end in one of"):
        draw_runtimes(read_rows([path]), tmp_path / "f.txt")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no rows; 'tools/bench --output' makes some"),
        ("{}\n", "line 1: no row of 'tools/bench --output'"),
        (json.dumps(row()) + "\n[]\n", "line 2: no row"),
        ("nonsense", "line 1: no row"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "b.jsonl"
    path.write_text(text)
    with pytest.raises(FileError, match=words):
        read_rows([path])
    with pytest.raises(FileError, match="cannot be read"):
        read_rows([tmp_path / "absent.jsonl"])
