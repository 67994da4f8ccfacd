"""Robots with a motion of their own change places where there is little room."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import bench_kinodynamic
import generate_traffic
import numpy as np
import pytest
import yaml
from bench_kinodynamic import OBSTACLE_MARGIN_M, ROBOT_MARGIN_M
from shapely import LineString, union_all

import mrmg
from mrmg.planning import plan_mission
from mrmg.scene.types import Scene


@pytest.mark.parametrize(
    ("name", "seed"),
    [("window", 302), ("window", 1002), ("alcove", 1000), ("alcove", 30004)],
)
def test_robots_change_places(tmp_path: Path, name: str, seed: int) -> None:
    """In window 302 one robot would be first if it could turn in no time.

    In window 1002 one has to turn round before it can set out.
    """
    scene = _generated(tmp_path, name, seed)
    result = plan_mission(scene, params=bench_kinodynamic.PARAMS)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).ok


def test_a_corridor_with_an_alcove_is_too_narrow_for_two(tmp_path: Path) -> None:
    scene = _generated(tmp_path, "alcove", 1000)
    _, low, _, high = scene.bounds
    line = LineString([(0.6, low), (0.6, high)])
    free = line.difference(union_all([wall.shape for wall in scene.obstacles]))
    margins_m = 2.0 * OBSTACLE_MARGIN_M + ROBOT_MARGIN_M
    widths_m = [2.0 * robot.model.half_width_m for robot in scene.robots]
    parts = getattr(free, "geoms", [free])
    assert max(part.length for part in parts) < sum(widths_m) + margins_m


def test_cars_of_a_dense_yard_get_through_in_the_second_attempt(tmp_path: Path) -> None:
    """Over priorities this yard is searched for a minute, and more."""
    scene = _generated(tmp_path, "yard7", 7009)
    params = replace(bench_kinodynamic.PARAMS, trees=2)
    result = plan_mission(scene, params=params)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).ok


def _generated(folder: Path, name: str, seed: int) -> Scene:
    """Return the scene that `tools/generate_traffic` makes of a class and a seed."""
    rng = np.random.default_rng((list(generate_traffic.CLASSES).index(name), seed))
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(generate_traffic.CLASSES[name](rng)))
    return bench_kinodynamic.benchmark_scene(path, folder)
