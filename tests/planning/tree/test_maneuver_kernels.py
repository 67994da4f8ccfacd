"""Maneuvers: out of dead ends, clear of walls, and the best of all sequences."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, pi, sin, tan
from typing import Any

import numpy as np
import pytest
import shapely

from mrmg.motion.dynamics import car_derivative, rk4_step
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.problem.problem import Problem
from mrmg.planning.tree._maneuver_kernels import (
    MANEUVER_STEPS,
    SWITCH_M,
    best_maneuver,
    hold_motion,
    way_left,
)
from mrmg.planning.tree.motion_tree import tree_mission
from mrmg.scene.types import Scene

PLANNING_MARGIN_M = PlannerParams().obstacle_margin_m

DT_S = 0.1
PARAMS = PlannerParams()
DEAD_END = [  # 3 m wide, open to the west, its end at x = 20
    {"id": "south", "box": {"center": [16, 7.5], "size": [8, 2]}, "height": 1},
    {"id": "north", "box": {"center": [16, 12.5], "size": [8, 2]}, "height": 1},
    {"id": "end", "box": {"center": [21, 10], "size": [2, 7]}, "height": 1},
]
WESTERN_GOAL = [{"id": "g", "circle": {"center": [3, 10], "radius": 1.5}}]
python_step = rk4_step(car_derivative(sin, cos, tan))

MakeScene = Callable[..., Scene]
MakeProblem = Callable[..., Problem]


@pytest.fixture
def dead_end(yard: MakeScene, state: MakeProblem) -> Problem:
    robots = [{"id": "r1", "model": "car", "pose": [6, 10, 0]}]
    return state(yard(obstacles=DEAD_END, goals=WESTERN_GOAL, robots=robots))


def outline(problem: Problem, state: np.ndarray) -> shapely.Polygon:
    corner = problem.scene.robots[0].model.footprint_m
    c, s = cos(state[2]), sin(state[2])
    turn = np.array([[c, -s], [s, c]])
    return shapely.Polygon(corner @ turn.T + state[:2])


def clearance(problem: Problem, state: np.ndarray) -> float:
    """Return the footprint's exact distance from obstacles and bounds."""
    frame = shapely.box(*problem.scene.bounds)
    walls = [o.shape for o in problem.scene.obstacles]
    own = outline(problem, state)
    if not frame.covers(own):
        return -1.0
    return float(own.distance(shapely.union_all([frame.exterior, *walls])))


def free_states(problem: Problem, seed: int, n: int) -> list[np.ndarray]:
    """Return states that keep the margin, at any speed and steering."""
    rng = np.random.default_rng(seed)
    low, high, side = problem.mission.fleet[0]["limit"][:3]
    found: list[np.ndarray] = []
    while len(found) < n:
        state = rng.uniform((2, 2, -pi, low, -side), (28, 18, pi, high, side))
        if rng.random() < 0.5:
            state[3:] = 0.0
        if clearance(problem, state) > PLANNING_MARGIN_M:
            found.append(state)
    return found


def choose(
    problem: Problem, state: np.ndarray, stuck: int = 0, seed: int = 1
) -> tuple[bool, np.ndarray]:
    out = np.full(2, np.nan)
    random = np.array([seed], np.uint64)
    found = best_maneuver(
        tree_mission(problem, PARAMS), 0, 0, state, stuck, random, out
    )
    return bool(found), out


@pytest.mark.parametrize("x", [14.0, 16.0, 18.0])
@pytest.mark.parametrize("y", [9.7, 10.0, 10.3])
def test_facing_the_end_of_a_dead_end_it_backs_off(
    dead_end: Problem, x: float, y: float
) -> None:
    found, motion = choose(dead_end, np.array([x, y, 0.0, 0.0, 0.0]))
    assert found
    assert motion[0] < 0.0


def test_facing_the_way_out_it_drives_on(dead_end: Problem) -> None:
    found, motion = choose(dead_end, np.array([18.0, 10.0, pi, 0.0, 0.0]))
    assert found
    assert motion[0] > 0.0
    assert motion[1] == 0.0


def test_repeated_maneuvers_lead_out_of_the_dead_end(dead_end: Problem) -> None:
    assert_it_gets_there(dead_end, np.array([17.5, 10.0, 0.0, 0.0, 0.0]), turns=30)


def assert_it_gets_there(problem: Problem, state: np.ndarray, turns: int) -> None:
    """Motion by motion it comes to the goal in the west, clear of everything."""
    for turn in range(turns):
        found, motion = choose(problem, state, seed=turn)
        assert found
        end = np.empty(5)
        hold_motion(tree_mission(problem, PARAMS), 0, state, motion[0], motion[1], end)
        assert clearance(problem, end) >= PLANNING_MARGIN_M - 1e-9
        state = end
        if hypot(state[0] - 3.0, state[1] - 10.0) < 1.5:
            return
    pytest.fail(f"still at {state[:3]}")


def test_motions_are_held_up_to_the_first_state_too_near(dead_end: Problem) -> None:
    """Against the plain Python form of the motion model and exact distances."""
    mission = tree_mission(dead_end, PARAMS)
    low, high, side, u1_max, u2_max = mission.fleet[0]["limit"]
    wheelbase = mission.fleet[0]["wheelbase"]
    rng = np.random.default_rng(6)
    cut_short = 0
    for first in free_states(dead_end, 5, 200):
        v = float(rng.choice([0.7 * high, low]))
        w = float(rng.uniform(-side, side))
        end = np.empty(5)
        way = hold_motion(mission, 0, first, v, w, end)
        state, driven, steps = first.copy(), 0.0, 0
        while steps < MANEUVER_STEPS:
            u1 = np.clip((v - state[3]) / DT_S, -u1_max, u1_max)
            if state[3] * v < 0.0:
                u1 = np.clip(-state[3] / DT_S, -u1_max, u1_max)
            u2 = np.clip((w - state[4]) / DT_S, -u2_max, u2_max)
            after = np.array(python_step(*state, u1, u2, wheelbase, DT_S))
            if clearance(dead_end, after) < PLANNING_MARGIN_M:
                state[3] = 0.0
                cut_short += 1
                break
            driven += 0.5 * abs(state[3] + after[3]) * DT_S
            state, steps = after, steps + 1
        assert end == pytest.approx(state, abs=1e-9)
        assert way == pytest.approx(driven, abs=1e-9)
        assert way >= hypot(*(end[:2] - first[:2])) - 1e-3
    assert 20 < cut_short < 180


def best_by_recursion(problem: Problem, start: np.ndarray) -> tuple[float, list[Any]]:
    """Return the best rating of two motions, and the first motions that attain it."""
    mission = tree_mission(problem, PARAMS)
    low, high, side = mission.fleet[0]["limit"][:3]
    motions = [
        (v, w) for v in (0.7 * high, low) for w in np.linspace(-1.0, 1.0, 5) * side
    ]
    rated: list[tuple[float, tuple[float, float]]] = []

    def extend(state: np.ndarray, speed: float, way: float, first: Any) -> None:
        for motion in motions:
            end = np.empty(5)
            driven = hold_motion(mission, 0, state, motion[0], motion[1], end)
            if driven < 0.05:
                continue
            switch = SWITCH_M if speed * motion[0] < -1e-6 else 0.0
            total = way + driven + switch
            to_go, turning = way_left(mission, 0, 0, end, np.empty(2))
            rated.append((total + to_go + turning, first or motion))
            if first is None:
                extend(end, motion[0], total, motion)

    extend(start, start[3], 0.0, None)
    best = min((rating for rating, _ in rated), default=np.inf)
    return best, [motion for rating, motion in rated if rating < best + 1e-9]


def test_it_is_the_first_motion_of_the_best_sequence_of_two(dead_end: Problem) -> None:
    for start in free_states(dead_end, 7, 25):
        best, motions = best_by_recursion(dead_end, start)
        found, motion = choose(dead_end, start)
        assert found is bool(np.isfinite(best))
        if found:
            gaps = [hypot(motion[0] - v, motion[1] - w) for v, w in motions]
            assert min(gaps) < 1e-9


@pytest.mark.parametrize("stuck", [0, 1, 2, 7])
def test_choices_are_within_limits_and_a_function_of_the_seed(
    dead_end: Problem, stuck: int
) -> None:
    low, high, side = dead_end.mission.fleet[0]["limit"][:3]
    for start in free_states(dead_end, 9, 12):
        found, motion = choose(dead_end, start, stuck)
        again, same = choose(dead_end, start, stuck)
        assert found is again
        assert np.array_equal(motion, same, equal_nan=True)
        if found:
            assert low <= motion[0] <= high
            assert abs(motion[1]) <= side


def test_a_stuck_robot_tries_others(dead_end: Problem) -> None:
    start = np.array([7.0, 15.0, 0.0, 0.0, 0.0])
    calm = {tuple(choose(dead_end, start, 0, seed)[1]) for seed in range(20)}
    stuck = {tuple(choose(dead_end, start, 5, seed)[1]) for seed in range(20)}
    assert len(calm) == 1
    assert len(stuck) > 1


def test_where_nothing_can_move_there_is_no_maneuver(
    yard: MakeScene, state: MakeProblem
) -> None:
    """A cell that leaves 0.27 m on all sides: no motion gets 5 cm far."""
    cell = {
        "id": "cell",
        "polygon": [[2, 7], [9, 7], [9, 13], [2, 13]],
        "holes": [[[3.43, 9.18], [5.77, 9.18], [5.77, 10.82], [3.43, 10.82]]],
        "height": 1,
    }
    problem = state(yard(obstacles=[cell]), samples=50)
    found, _ = choose(problem, problem.start[0])
    assert not found


def test_in_the_open_turning_round_ends_at_the_goal_behind(
    yard: MakeScene, state: MakeProblem
) -> None:
    problem = state(yard(goals=WESTERN_GOAL))
    assert_it_gets_there(problem, np.array([20.0, 10.0, 0.0, 0.0, 0.0]), turns=25)
