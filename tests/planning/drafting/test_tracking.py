"""How fast robots slow down while they follow paths."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import mrmg
from mrmg.planning import PlannerParams
from mrmg.planning.drafting.drafting import tour_path
from mrmg.planning.drafting.tracking import (
    PathPlace,
    Wait,
    courses_of,
    redriven,
    steerable_speeds,
)
from mrmg.planning.problem.problem import state_mission
from mrmg.scene.types import Scene


@pytest.mark.parametrize(
    ("name", "least", "most"), [("scene2", 0.9, 1.0), ("diffdrive", 0.1, 0.5)]
)
def test_slowing_down_leaves_rolling_to_be_overcome(
    name: str, least: float, most: float
) -> None:
    """Cars nearly roll; robots that turn by their wheels keep both of them pushing."""
    scene = mrmg.load_scene(name)
    problem = state_mission(scene, 0, PlannerParams(samples=300))
    paths = [tour_path(problem, r, [r]) for r in range(len(scene.robots))]
    ease = courses_of(problem, paths, [[] for _ in paths]).ease
    ground = min([1.0, *(area.multiplier for area in scene.terrain)])
    energy = [robot.model.energy_model for robot in scene.robots]
    rolling = np.array(
        [ground * each.rolling_force_N / each.effective_mass_kg for each in energy]
    )
    assert (ease >= least * rolling).all()
    assert (ease <= most * rolling).all()


def two_cars(yard: Callable[..., Scene]) -> Scene:
    """Return two cars side by side, each with a finish ahead."""
    robots = [
        {
            "id": f"r{y}",
            "model": "car",
            "pose": [4, y, 0],
            "finish": {"circle": {"center": [26, y], "radius": 1.0}},
        }
        for y in (6, 14)
    ]
    return yard(goals=[], robots=robots)


def test_a_robot_waits_until_the_other_one_has_got_where_it_must(
    yard: Callable[..., Scene],
) -> None:
    params = PlannerParams(samples=300)
    problem = state_mission(two_cars(yard), 0, params)
    paths = [tour_path(problem, r, [r]) for r in range(2)]
    wait = Wait(
        at=PathPlace(0, 8.0, np.array([12.0, 6.0])),
        until=PathPlace(1, 18.0, np.array([22.0, 14.0])),
    )
    none = [np.zeros((0, 2))] * 2
    drive = redriven(problem, params, paths, [[], []], none, [wait], np.zeros(1, bool))
    assert drive.stuck < 0
    first, second = (trajectory.state for trajectory in drive.trajectories)
    leaves = int(np.argmax(first[:, 0] > 12.3))
    assert leaves > 0
    assert second[leaves, 0] > 21.5
    assert np.abs(first[: leaves + 1, 0]).max() < 12.4
    assert first[-1, 0] > 25.0


def test_robots_that_wait_for_each_other_are_stuck(yard: Callable[..., Scene]) -> None:
    params = PlannerParams(samples=300)
    problem = state_mission(two_cars(yard), 0, params)
    paths = [tour_path(problem, r, [r]) for r in range(2)]
    waits = [
        Wait(
            at=PathPlace(r, 8.0, np.array([12.0, y])),
            until=PathPlace(1 - r, 18.0, np.array([22.0, 20 - y])),
        )
        for r, y in ((0, 6.0), (1, 14.0))
    ]
    none = [np.zeros((0, 2))] * 2
    drive = redriven(problem, params, paths, [[], []], none, waits, np.zeros(1, bool))
    assert drive.stuck >= 0
    assert drive.trajectories == ()
    assert (np.abs(drive.state[:, 0] - 12.0) < 0.5).all()


def test_a_place_is_found_again_on_a_path_that_moved(
    yard: Callable[..., Scene],
) -> None:
    problem = state_mission(two_cars(yard), 0, PlannerParams(samples=300))
    path = tour_path(problem, 0, [0])
    place = PathPlace(0, 9.0, path.points(np.array([11.0]))[0])
    assert place.way_along(path) == pytest.approx(11.0, abs=0.1)
    far = PathPlace(0, 1.0, path.points(np.array([15.0]))[0])
    assert far.way_along(path) == pytest.approx(9.0, abs=0.1)  # as far as it may move


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
