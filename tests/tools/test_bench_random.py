"""The bench of missions drawn at random."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bench_random
import maze
import networkx as nx
import numpy as np
import pytest
import shapely


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


def test_mazes_join_all_cells_and_have_robots_without_goals(tmp_path: Path) -> None:
    for number in range(20):
        drawn = maze.drawn_maze(np.random.default_rng(number), 2.0)
        graph = nx.Graph(drawn.joined.tolist())
        assert sorted(graph) == [*range(len(drawn.middle))]
        assert nx.is_connected(graph)
        pairs = 2 * maze.SIDE * (maze.SIDE - 1)
        assert len(drawn.wall) == pairs - len(drawn.joined)
        walls = shapely.union_all([shapely.box(*box) for box in corners(drawn.wall)])
        ways = shapely.linestrings(drawn.middle[drawn.joined])
        assert not shapely.intersects(walls, ways).any()
        assert shapely.distance(walls, shapely.points(drawn.middle)).min() > 0.8
    scenes = [bench_random.mission(n, tmp_path, maze=True) for n in range(20)]
    assert any(len(one.robots) > len(one.goals) for one in scenes)
    assert scenes[0].digest != bench_random.mission(0, tmp_path).digest


def corners(wall: np.ndarray) -> np.ndarray:
    at, half = wall[:, :2], 0.5 * wall[:, 2:]
    return np.hstack([at - half, at + half])


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
