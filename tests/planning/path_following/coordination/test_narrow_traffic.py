"""Robots with a motion of their own change places where there is little room."""

from __future__ import annotations

import json
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
    [
        ("window", 302),
        ("window", 1002),
        ("alcove", 1000),
        ("alcove", 30004),
        ("crowd4", 26),
        ("crowd4", 27),
        ("crowd8", 10),
    ],
)
def test_robots_change_places(tmp_path: Path, name: str, seed: int) -> None:
    """In window 302 one robot would be first if it could turn in no time.

    In window 1002 one has to turn round before it can set out. In crowds some have no
    room to turn where they start or end, and are steered forwards only.
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


SECOND_ORDER = """\
from math import atan2, cos, hypot, pi, sin


def step(state, control, length, dt):
    x, y, theta, v, w = state
    u1, u2 = control
    speed, turn = v + 0.5 * dt * u1, theta + 0.5 * dt * w
    after = x + dt * speed * cos(turn), y + dt * speed * sin(turn)
    return *after, theta + dt * (w + 0.5 * dt * u2), v + dt * u1, w + dt * u2


def steer(state, waypoint, share, limits, length, dt):
    x, y, theta, v, w = state
    dx, dy = waypoint[0] - x, waypoint[1] - y
    off = atan2(dy, dx) - theta
    off -= 2.0 * pi * round(off / (2.0 * pi))
    far, turn = share * hypot(dx, dy), off if share > 0.0 else 0.0
    speed = min(share * limits[1], 0.5 * far) * max(0.0, cos(off)) ** 3
    rate = max(-limits[2], min(limits[2], 0.5 * turn))
    u1 = max(-limits[3], min(limits[3], (speed - v) / dt))
    return u1, max(-limits[4], min(limits[4], (rate - w) / dt))
"""
"""Motion of a unicycle that accelerates, and whose steering knows only forwards."""


@pytest.mark.parametrize("kind", ["unicycle_first_order_0", "own"])
def test_who_stands_in_the_way_comes_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """Out of the mouth of a blind alley and, backwards, into it again.

    Both are steered forwards only, and there is no room to turn in the alley.
    """
    if kind == "own":
        monkeypatch.setattr(bench_kinodynamic, "FIRST_ORDER", SECOND_ORDER)
    walls = [(0.8, 0.3, 1.6, 0.6), (0.8, 1.4, 1.6, 0.5)]
    boxes = [{"center": [x, y], "size": [dx, dy]} for x, y, dx, dy in walls]
    ends = [((0.4, 0.88, 0.0), (3.2, 0.9, 0.0)), ((1.5, 0.88, 0.0), (1.5, 0.88, 0.0))]
    robots = [
        {"type": "unicycle_first_order_0", "start": start, "goal": goal}
        for start, goal in ends
    ]
    world = {"min": [0, 0], "max": [3.8, 1.8], "obstacles": boxes}
    path = tmp_path / "alley.yaml"
    path.write_text(json.dumps({"environment": world, "robots": robots}))
    scene = bench_kinodynamic.benchmark_scene(path, tmp_path)
    result = plan_mission(scene, params=bench_kinodynamic.PARAMS)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).ok
    assert result.plan.trajectories[1].state[:, 3].min() < 0.0


def test_top_speeds_need_not_be_exact(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A custom motion model may come to a little more, as the verifier lets it."""
    source = bench_kinodynamic.FIRST_ORDER
    inexact = source.replace("theta + w * dt, v, w", "theta + w * dt, v + 1e-12 * v, w")
    assert inexact != source
    monkeypatch.setattr(bench_kinodynamic, "FIRST_ORDER", inexact)
    scene = _generated(tmp_path, "swap2", 0)
    result = plan_mission(scene, params=bench_kinodynamic.PARAMS)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).ok
    top = scene.robots[0].model.limits.v_max_m_s
    assert max(each.state[:, 3].max() for each in result.plan.trajectories) > top


def _generated(folder: Path, name: str, seed: int) -> Scene:
    """Return the scene that `tools/generate_traffic` makes of a class and a seed."""
    rng = np.random.default_rng((list(generate_traffic.CLASSES).index(name), seed))
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(generate_traffic.CLASSES[name](rng)))
    return bench_kinodynamic.benchmark_scene(path, folder)
