"""How fast robots slow down while they follow paths."""

from __future__ import annotations

import numpy as np
import pytest

import mrmg
from mrmg.planning import PlannerParams
from mrmg.planning.path_following.tracking import deceleration, steerable_speeds
from mrmg.planning.problem.problem import state_mission


@pytest.mark.parametrize(
    ("name", "least", "most"), [("scene2", 0.9, 1.0), ("diffdrive", 0.1, 0.5)]
)
def test_slowing_down_leaves_rolling_to_be_overcome(
    name: str, least: float, most: float
) -> None:
    """Cars nearly roll; robots that turn by their wheels keep both of them pushing."""
    scene = mrmg.load_scene(name)
    problem = state_mission(scene, 0, PlannerParams(samples=300))
    ease = np.array([deceleration(problem, r) for r in range(len(scene.robots))])
    ground = min([1.0, *(area.multiplier for area in scene.terrain)])
    energy = [robot.model.energy_model for robot in scene.robots]
    rolling = np.array(
        [ground * each.rolling_force_N / each.effective_mass_kg for each in energy]
    )
    assert (ease >= least * rolling).all()
    assert (ease <= most * rolling).all()


@pytest.mark.parametrize("name", ["quickstart", "diffdrive"])
def test_robots_can_steer_along_an_arc_as_fast_as_is_said(name: str) -> None:
    """At that speed the steering, or the turning, changes as fast as it can."""
    problem = state_mission(mrmg.load_scene(name), 0, PlannerParams(samples=100))
    robot = problem.mission.fleet[0]
    way = np.linspace(0.0, 6.0, 601)
    bend = 0.4 * way  # a clothoid
    end = np.full(600, 600)
    speed = steerable_speeds(problem, 0, bend, way, end)
    v = speed[1:-1]
    if name == "diffdrive":
        rate = v * np.diff(bend[1:]) / np.diff(way[1:]) * v
    else:
        steering = np.arctan(float(robot["wheelbase"]) * bend)
        rate = v * np.diff(steering[1:]) / np.diff(way[1:])
    assert rate == pytest.approx(np.full(len(v), robot["limit"][4]), rel=0.03)
