"""The bench of car-like robots, and the generator of traffic."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bench_clmapf
import bench_kinodynamic
import generate_traffic
import pytest
import yaml

FREE = """\
agents:
  - {start: [10, 10, 0], name: agent0, goal: [30, 24, 1.57]}
  - {start: [30, 10, 3.14], name: agent1, goal: [12, 14, 3.14]}
map:
  dimensions: [40, 40]
  obstacles:
    - [20, 30]
"""


def test_files_are_planned_and_those_with_overlaps_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "map_40by40_obst1_agents2_ex1.yaml").write_text(FREE)
    onto = FREE.replace("[20, 30]", "[12.5, 10]")  # 0.3 m into the first car's front
    (tmp_path / "map_40by40_obst1_agents2_ex2.yaml").write_text(onto)
    document = tmp_path / "bench.json"
    arguments = ["--folder", str(tmp_path), "--seeds", "0", "--json", str(document)]
    monkeypatch.setattr(sys, "argv", ["bench", *arguments])
    assert bench_clmapf.main() == 0
    assert "overlaps a disc where it starts: map_40by40_obst1_agents2_ex2" in (
        capsys.readouterr().out
    )
    written = json.loads(document.read_text())
    (line,) = written["rows"]
    assert (line["cell"], line["solved"], line["runs"]) == (
        "40by40_obst1_agents2",
        1,
        1,
    )
    assert written["overlapping"] == [{"file": "map_40by40_obst1_agents2_ex2"}]


@pytest.mark.parametrize("obstacles", [None, []])
def test_files_may_have_no_obstacle(obstacles: list[list[float]] | None) -> None:
    content = {**yaml.safe_load(FREE), "map": {"obstacles": obstacles}}
    assert bench_clmapf.overlap_m(content) == 0.0


@pytest.mark.parametrize(("disc_x", "margin_m"), [(20.0, 0.05), (12.86, 0.03)])
def test_bodies_reach_over_the_edge_by_the_margin_of_the_file(
    disc_x: float, margin_m: float, tmp_path: Path
) -> None:
    """The first car's front is at x = 12, a disc's edge 0.8 m from its centre."""
    content = yaml.safe_load(FREE)
    content["map"]["obstacles"] = [[disc_x, 10.0]]
    model = bench_clmapf.write_model(tmp_path)
    west = bench_clmapf.benchmark_scene("map", content, model).bounds[0]
    assert west == pytest.approx(-1.0 - margin_m)


def test_missions_are_drawn_with_room_between_the_cars() -> None:
    content = bench_clmapf.drawn(3)
    assert content == bench_clmapf.drawn(3) != bench_clmapf.drawn(4)
    for place in ("start", "goal"):
        bodies = [bench_clmapf.body(agent[place]) for agent in content["agents"]]
        assert len(bodies) == bench_clmapf.DRAWN_CARS
        near = [a.distance(b) for a in bodies for b in bodies if a is not b]
        assert min(near) >= bench_clmapf.DRAWN_APART_M


def test_yaw_is_clockwise_in_the_files() -> None:
    west, south, east, north = bench_clmapf.body([5.0, 5.0, 1.5708]).bounds
    assert [west, south, east, north] == pytest.approx([4, 3, 6, 6], abs=1e-3)


def test_traffic_is_the_same_for_the_same_seed_and_readable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("first", "second"):
        arguments = [str(tmp_path / folder), "--seeds", "3"]
        monkeypatch.setattr(sys, "argv", ["generate", *arguments])
        assert generate_traffic.main() == 0
    files = sorted((tmp_path / "first").iterdir())
    assert len(files) == len(generate_traffic.CLASSES)
    for path in files:
        assert path.read_bytes() == (tmp_path / "second" / path.name).read_bytes()
        scene = bench_kinodynamic.benchmark_scene(path, tmp_path)
        assert len(scene.robots) == len(yaml.safe_load(path.read_text())["robots"])
