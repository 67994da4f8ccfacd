"""One expansion: what robots do, what it costs, and what counts as arriving."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest

from mrmg.energy.metering import LoggedMotion, step_energy_parts
from mrmg.energy.model import PARTS
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import TARGET_MARGIN_M
from mrmg.planning.tree._expansion_kernels import (
    attempt_control,
    choose_modes,
    draw_motion,
    expand,
    step_energy,
)
from mrmg.planning.tree._groups_kernels import Tree, new_tree
from mrmg.planning.tree._staying_kernels import note_arrivals
from mrmg.planning.tree._steering_kernels import BACK_OFF, RANDOM, STEER, WAIT
from mrmg.planning.tree.motion_tree import tree_mission
from mrmg.scene.types import Scene
from mrmg.world.terrain import multiplier_at, turning_multiplier_at

DT_S = 0.1
PARAMS = PlannerParams()
SCENE = {
    "goals": [
        {"id": "a", "circle": {"center": [24, 10], "radius": 1.5}},
        {"id": "b", "polygon": [[10, 14], [14, 14], [14, 18], [10, 18]]},
    ],
    "stations": [{"id": "s", "circle": {"center": [12, 4], "radius": 1.5}}],
    "terrain": [
        {
            "id": "m",
            "box": {"center": [15, 10], "size": [10, 4]},
            "multiplier": 2.5,
            "turning_multiplier": 3.0,
        }
    ],
    "robots": [
        {"id": "r1", "model": "car", "pose": [4, 10, 0], "start_energy": 0.5},
        {"id": "r2", "model": "car", "pose": [4, 15, 0], "start_energy": 0.5},
    ],
}
A, B, STATION = 0, 1, 2

MakeScene = Callable[..., Scene]
MakeProblem = Callable[..., Problem]


@pytest.fixture
def problem(yard: MakeScene, state: MakeProblem) -> Problem:
    return state(yard(**SCENE))


def generator(seed: int) -> np.ndarray:
    return np.array([seed], np.uint64)


# --- what robots do ----------------------------------------------------------------


def modes(
    problem: Problem,
    tree: Tree,
    target: tuple[int, int],
    steer: float = 1.0,
    n: int = 2000,
) -> list[Counter[int]]:
    """Return how often each robot does what, over many draws at vertex 0."""
    random = generator(1)
    drawn: list[Counter[int]] = [Counter(), Counter()]
    stuck, mode = np.zeros(2, np.int64), np.zeros(2, np.int64)
    for _ in range(n):
        choose_modes(
            tree,
            np.int64(0),
            np.array(target),
            tree_mission(problem, PARAMS).params,
            steer,
            random,
            stuck,
            mode,
        )
        for r in range(2):
            drawn[r][int(mode[r])] += 1
    return drawn


def test_fresh_robots_steer_and_those_without_a_target_wait(problem: Problem) -> None:
    tree = new_tree(1, 2, 2, 15)
    assert modes(problem, tree, (A, B)) == [{STEER: 2000}, {STEER: 2000}]
    assert modes(problem, tree, (A, -1)) == [{STEER: 2000}, {WAIT: 2000}]


def test_without_steering_all_that_have_a_target_are_random(problem: Problem) -> None:
    tree = new_tree(1, 2, 2, 15)
    assert modes(problem, tree, (A, -1), 0.0) == [{RANDOM: 2000}, {WAIT: 2000}]
    half = modes(problem, tree, (A, B), 0.75)[0]
    assert half[STEER] / 2000 == pytest.approx(0.75, abs=0.04)


def test_an_idle_robot_gives_way_when_another_is_stuck(problem: Problem) -> None:
    tree = new_tree(1, 2, 2, 15)
    tree.stalled[0, 0] = 2
    drawn = modes(problem, tree, (A, -1))
    assert set(drawn[1]) == {WAIT, RANDOM}
    assert drawn[1][RANDOM] / 2000 == pytest.approx(0.5, abs=0.04)
    assert set(drawn[0]) == {STEER, BACK_OFF, RANDOM, WAIT}
    assert drawn[0][STEER] / 2000 == pytest.approx(0.5, abs=0.04)


@pytest.mark.parametrize("gear", [1, -1])
def test_drawn_motions_are_within_limits(problem: Problem, gear: int) -> None:
    fleet = problem.mission.fleet
    low, high, side = fleet[0]["limit"][:3]
    random = generator(2)
    for mode in (RANDOM, BACK_OFF):
        drawn = np.array(
            [draw_motion(fleet, 0, mode, gear, random) for _ in range(2000)]
        )
        assert (drawn[:, 0] >= low).all()
        assert (drawn[:, 0] <= high).all()
        assert (np.abs(drawn[:, 1]) <= side).all()
        assert np.ptp(drawn[:, 1]) > side
        if mode == BACK_OFF:
            assert (drawn[:, 0] * gear < 0.0).all()
        else:
            assert drawn[:, 0].min() < 0.9 * low
            assert drawn[:, 0].max() > 0.9 * high


def test_attempts_get_slower_and_the_last_one_stops(problem: Problem) -> None:
    fleet = problem.mission.fleet
    u1_max, u2_max = fleet[0]["limit"][3:]
    state = np.array([9.0, 9.0, 0.0, 1.0, 0.1])
    wanted = []
    for attempt in range(5):
        u1, u2 = attempt_control(fleet, 0, state, 1.05, 0.12, attempt, DT_S)
        assert abs(u1) <= u1_max
        assert abs(u2) <= u2_max
        wanted.append(u1)
    assert wanted[0] == pytest.approx(0.5)
    assert wanted == sorted(wanted, reverse=True)
    assert wanted[-1] == -u1_max


# --- what it costs -----------------------------------------------------------------


def test_a_step_costs_what_the_energy_model_says_of_its_midpoint(
    problem: Problem,
) -> None:
    """Away from terrain borders, where the grid is exact."""
    model = problem.scene.robots[0].model.energy_model
    border = problem.scene.terrain[0].shape.exterior
    low, high, side = problem.mission.fleet[0]["limit"][:3]
    rng = np.random.default_rng(3)
    compared = set()
    for _ in range(500):
        before = rng.uniform((1, 1, -3, low, -side), (29, 19, 3, high, side))
        after = before + rng.uniform(-0.1, 0.1, 5)
        middle = 0.5 * (before + after)
        k = multiplier_at(problem.scene, middle[None, :2])
        if np.abs(np.asarray(border.coords) - middle[:2]).min() < 0.3:
            continue
        u1 = rng.uniform(-1.2, 1.2)
        turn = np.abs(middle[3:4] * np.tan(middle[4:5]))
        turn *= turning_multiplier_at(problem.scene, middle[None, :2])
        watts = model.power_parts(
            middle[3:4], np.array([u1]), turn, k, np.zeros(1)
        ).sum()
        joules = step_energy(tree_mission(problem, PARAMS), 0, before, after, u1)
        assert joules == pytest.approx(DT_S * watts, abs=1e-9)
        compared.add(float(k[0]))
    assert compared == {1.0, 2.5}


def test_a_step_on_a_slope_is_charged_as_the_accounts_charge_it(
    yard: MakeScene, state: MakeProblem
) -> None:
    """Climbing by the ground below the centre of mass, away from terrain borders."""
    hill = {"hills": [{"center": [18, 5], "height": 0.6, "radius": 8}]}
    problem = state(yard(**{**SCENE, "terrain": []}, elevation=hill))
    low, high, side = problem.mission.fleet[0]["limit"][:3]
    rng = np.random.default_rng(4)
    climbed = 0
    for _ in range(300):
        before = rng.uniform((9, 1, -3, low, -side), (27, 14, 3, high, side))
        after = before + rng.uniform(-0.1, 0.1, 5)
        motion = LoggedMotion(
            robot="r1", time_s=np.array([0.0, DT_S]), state=np.stack([before, after])
        )
        expected = step_energy_parts(problem.scene, motion)
        u1 = (after[3] - before[3]) / DT_S
        joules = step_energy(tree_mission(problem, PARAMS), 0, before, after, u1)
        assert joules == pytest.approx(expected.sum(), abs=1e-9)
        climbed += abs(expected[0, PARTS.index("grade")]) > 0.1
    assert climbed > 150


# --- arriving ----------------------------------------------------------------------


def arrive(
    problem: Problem, points: list[tuple[float, float]], target: list[int]
) -> tuple[bool, np.ndarray, np.ndarray]:
    """Return (whether anything was reached, goals visited, batteries)."""
    state = np.zeros((2, 5))
    state[:, :2] = points
    energy, visited = problem.start_energy.copy(), np.zeros(2, bool)
    event = note_arrivals(
        tree_mission(problem, PARAMS),
        state,
        energy,
        visited,
        np.full(2, -1),
        np.zeros(2),
        np.array(target),
    )
    return bool(event), visited, energy


def test_any_robot_visits_a_goal_it_is_in(problem: Problem) -> None:
    event, visited, energy = arrive(problem, [(12, 16), (24, 10)], [-1, STATION])
    assert event
    assert visited.tolist() == [True, True]
    assert np.array_equal(energy, problem.start_energy)


def test_only_a_robot_bound_for_a_station_recharges_there(problem: Problem) -> None:
    event, visited, energy = arrive(problem, [(12, 4), (12, 4.5)], [A, STATION])
    assert event
    assert not visited.any()
    assert energy[0] == problem.start_energy[0]
    assert energy[1] == problem.scene.robots[1].battery.capacity_J
    event, visited, energy = arrive(problem, [(12, 4), (5, 5)], [A, STATION])
    assert not event
    assert np.array_equal(energy, problem.start_energy)


def test_regions_are_entered_as_deep_as_tracking_needs(problem: Problem) -> None:
    rng = np.random.default_rng(8)
    targets = problem.mission.targets
    for t, target in enumerate(problem.scene.targets()):
        points = target.region.center + rng.uniform(-3.0, 3.0, (2000, 2))
        depth = target.region.depth(points)
        inside = np.array([in_target(targets, t, x, y) for x, y in points])
        assert np.array_equal(inside, depth >= TARGET_MARGIN_M)


# --- the whole ---------------------------------------------------------------------


def run(
    problem: Problem, mode: tuple[int, int], target: tuple[int, int], start: np.ndarray
) -> tuple[tuple[int, bool, bool], np.ndarray, np.ndarray, np.ndarray]:
    """Return (outcome, states, batteries, controls) of one expansion."""
    state, energy = start.copy(), problem.start_energy.copy()
    control = np.full((15, 2, 2), np.nan)
    steps, event, alive = expand(
        tree_mission(problem, PARAMS),
        state,
        energy,
        np.zeros(2, bool),
        np.full(2, -1),
        np.zeros(2),
        np.array(target),
        np.array(mode),
        np.ones(2, np.int64),
        np.zeros(2, np.int64),
        np.arange(2),
        generator(5),
        control,
    )
    return (int(steps), bool(event), bool(alive)), state, energy, control


def test_waiting_brakes_to_rest_and_then_costs_nothing(problem: Problem) -> None:
    start = problem.start.copy()
    start[:, 3] = 1.5
    outcome, state, _, control = run(problem, (WAIT, WAIT), (-1, -1), start)
    assert outcome == (15, False, True)
    assert np.abs(state[:, 3]).max() < 1e-9
    assert (control[:, :, 1] == 0.0).all()
    _, still, energy, _ = run(problem, (WAIT, WAIT), (-1, -1), problem.start)
    assert np.array_equal(still, problem.start)
    assert np.array_equal(energy, problem.start_energy)


def test_steering_gets_nearer_and_uses_energy(problem: Problem) -> None:
    outcome, state, energy, control = run(
        problem, (STEER, WAIT), (A, -1), problem.start
    )
    assert outcome == (15, False, True)
    assert state[0, 0] > problem.start[0, 0] + 1.0
    assert np.array_equal(state[1], problem.start[1])
    assert energy[0] < problem.start_energy[0]
    assert energy[1] == problem.start_energy[1]
    assert np.isfinite(control).all()


def test_it_ends_at_the_first_step_inside_a_target(problem: Problem) -> None:
    start = problem.start.copy()
    start[0] = (22.0, 10.0, 0.0, 1.5, 0.0)
    (steps, event, alive), state, _, control = run(
        problem, (STEER, WAIT), (A, -1), start
    )
    assert (event, alive) == (True, True)
    assert 1 <= steps < 15
    depth = problem.scene.goals[0].region.depth(state[:1, :2])[0]
    assert TARGET_MARGIN_M <= depth < TARGET_MARGIN_M + 0.2
    assert np.isnan(control[steps:]).all()


def test_it_ends_when_a_battery_is_down_to_the_reserve(problem: Problem) -> None:
    problem.mission.fleet["reserve"][0] = problem.start_energy[0] - 1.0
    (steps, _, alive), _, energy, _ = run(
        problem, (STEER, STEER), (A, B), problem.start
    )
    assert not alive
    assert steps < 15
    assert energy[0] < problem.mission.fleet["reserve"][0]
