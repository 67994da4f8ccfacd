"""Steering: closed loops end where they should, and robots in the way are passed."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, pi, sin

import numpy as np
import pytest

from mrmg.motion._kernels import CAR, UNICYCLE, step
from mrmg.planning.problem._control_kernels import control_towards, wrap
from mrmg.planning.problem.problem import Problem
from mrmg.planning.roadmap._fleet_kernels import space_of
from mrmg.planning.tree._steering_kernels import pursue, sidestep
from mrmg.scene.types import Scene

DT_S = 0.1
TWO_CARS = [
    {"id": "r1", "model": "car", "pose": [4, 10, 0]},
    {"id": "r2", "model": "car", "pose": [14, 10, 0]},
]

MakeScene = Callable[..., Scene]
MakeProblem = Callable[..., Problem]


@pytest.fixture
def open_yard(yard: MakeScene, state: MakeProblem) -> Problem:
    return state(yard(robots=TWO_CARS), samples=20)


def moved(fleet: np.ndarray, state: np.ndarray, u1: float, u2: float) -> np.ndarray:
    after = np.empty(5)
    step(fleet[0], state, u1, u2, DT_S, after)
    return after


def test_wrapped_angles_lie_in_one_turn_and_differ_by_whole_turns() -> None:
    for angle in np.random.default_rng(0).uniform(-30.0, 30.0, 500):
        wrapped = wrap(angle)
        assert -pi < wrapped <= pi
        turns = (angle - wrapped) / (2.0 * pi)
        assert turns == pytest.approx(round(turns), abs=1e-9)
    assert wrap(pi) == pi
    assert wrap(-pi) == pi


def test_controls_respect_limits_and_reach_what_is_wanted(open_yard: Problem) -> None:
    fleet = open_yard.mission.fleet
    low, high, side, u1_max, u2_max = fleet[0]["limit"]
    rng = np.random.default_rng(1)
    for _ in range(300):
        state = np.array([9, 9, 0, rng.uniform(low, high), rng.uniform(-side, side)])
        v, w = rng.uniform(-4.0, 4.0), rng.uniform(-1.5, 1.5)
        gap = np.inf
        for _ in range(40):
            u1, u2 = control_towards(fleet, 0, state, v, w, DT_S)
            assert abs(u1) <= u1_max
            assert abs(u2) <= u2_max
            state = moved(fleet, state, u1, u2)
            assert low - 1e-9 <= state[3] <= high + 1e-9
            assert abs(state[4]) <= side + 1e-9
            left = abs(state[3] - min(max(v, low), high))
            assert left <= gap + 1e-12
            gap = left
        assert state[3] == pytest.approx(min(max(v, low), high), abs=1e-9)
        assert state[4] == pytest.approx(min(max(w, -side), side), abs=1e-9)


@pytest.mark.parametrize(("model", "gear"), [(CAR, 1), (CAR, -1), (UNICYCLE, 1)])
def test_pursuit_gets_there_from_any_pose(
    open_yard: Problem, model: int, gear: int
) -> None:
    """On endless open ground; a car in reverse gear starts with its tail that way."""
    fleet = open_yard.mission.fleet
    fleet["model"] = model
    rng = np.random.default_rng(2)
    for _ in range(60):
        away, direction = rng.uniform(3.0, 20.0), rng.uniform(-pi, pi)
        wx, wy = away * cos(direction), away * sin(direction)
        theta = rng.uniform(-pi, pi)
        if gear < 0:
            theta = direction + pi + rng.uniform(-1.0, 1.0)
        state = np.array([0.0, 0.0, theta, 0.0, 0.0])
        nearest = np.inf
        for _ in range(600):
            v, w = pursue(fleet, 0, state, wx, wy, gear)
            assert np.isfinite(v) and np.isfinite(w)
            u1, u2 = control_towards(fleet, 0, state, v, w, DT_S)
            state = moved(fleet, state, u1, u2)
            nearest = min(nearest, hypot(wx - state[0], wy - state[1]))
            if nearest < 0.5:
                break
        assert nearest < 0.5


def test_pursuit_is_symmetric_about_the_robots_axis(open_yard: Problem) -> None:
    fleet = open_yard.mission.fleet
    rng = np.random.default_rng(3)
    for wx, wy, psi in rng.uniform((-9, -9, -0.5), (9, 9, 0.5), (300, 3)):
        for gear in (1, -1):
            left = pursue(fleet, 0, np.array([0, 0, 0, 1.0, psi]), wx, wy, gear)
            right = pursue(fleet, 0, np.array([0, 0, 0, 1.0, -psi]), wx, -wy, gear)
            assert left[0] == pytest.approx(right[0])
            assert left[1] == pytest.approx(-right[1])


# --- passing others ----------------------------------------------------------------


def aside(
    problem: Problem, other: tuple[float, ...], waypoint: tuple[float, float] = (24, 10)
) -> np.ndarray:
    """Return where r1, heading east from (4, 10), drives with r2 at a state."""
    others = np.array([[4.0, 10.0, 0.0, 1.0, 0.0], [*other, 0.0]])
    space = space_of(problem.mission.spaces, problem.mission.fleet[0]["space"])
    out = np.empty(2)
    sidestep(problem.mission.fleet, 0, others[0], space, others, *waypoint, out)
    return out


def test_nobody_in_the_way_leaves_the_waypoint(open_yard: Problem) -> None:
    for other in (
        (2.0, 10.0, 0.0, 0.0),  # behind
        (16.0, 10.0, 0.0, 0.0),  # beyond sight
        (9.0, 15.0, 0.0, 0.0),  # abeam
        (9.0, 10.0, 0.0, 1.7),  # ahead and as fast
    ):
        assert aside(open_yard, other).tolist() == [24.0, 10.0]
    # beyond the waypoint
    assert aside(open_yard, (11.0, 10.0, 0.0, 0.0), (6.0, 10.0)).tolist() == [6, 10]


@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_robots_that_meet_head_on_pass_on_the_right(
    open_yard: Problem, speed: float
) -> None:
    other = (10.0, 10.0, pi, speed)
    x, y = aside(open_yard, other)
    fleet = open_yard.mission.fleet
    assert y < 10.0
    assert x == pytest.approx(10.0 - fleet[1]["middle"][0])
    assert 10.0 - y > fleet[0]["radius"] + fleet[1]["radius"]


def test_a_robot_aside_is_passed_on_its_free_side(open_yard: Problem) -> None:
    assert aside(open_yard, (10.0, 9.0, pi, 0.0))[1] > 9.0 + 2.0
    assert aside(open_yard, (10.0, 11.0, pi, 0.0))[1] < 11.0 - 2.0


def test_the_other_side_is_taken_where_a_wall_is(
    yard: MakeScene, state: MakeProblem
) -> None:
    south = {"id": "s", "box": {"center": [15, 4], "size": [30, 8]}, "height": 1}
    north = {"id": "n", "box": {"center": [15, 16], "size": [30, 8]}, "height": 1}
    half = state(yard(robots=TWO_CARS, obstacles=[south]), samples=20)
    assert aside(half, (10.0, 10.0, pi, 0.0))[1] > 12.0
    lane = state(yard(robots=TWO_CARS, obstacles=[south, north]), samples=20)
    right = aside(lane, (10.0, 10.0, pi, 0.0))[1]
    passage_m = lane.mission.fleet[0]["passage"]
    assert 8.0 + passage_m <= right < 8.0 + passage_m + 0.4
    tight = [
        {**south, "box": {"center": [15, 4.45], "size": [30, 8.9]}},
        {**north, "box": {"center": [15, 15.55], "size": [30, 8.9]}},
    ]
    lane = state(yard(robots=TWO_CARS, obstacles=tight), samples=20)
    assert aside(lane, (10.0, 10.0, pi, 0.0)).tolist() == [24.0, 10.0]
