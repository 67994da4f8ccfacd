"""Committed braking against exact geometry: nobody ever gets nearer than the margins.

Robots are driven at random, as hard as their limits allow, among walls and each other;
every footprint is placed anew from the states and measured by shapely.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
import shapely

from mrmg.motion._kernels import CAR, UNICYCLE, step
from mrmg.planning.problem._control_kernels import control_towards
from mrmg.planning.problem._safety_kernels import (
    Contingency,
    braking_control,
    follow_braking,
    new_contingency,
    present_state,
    stands,
    toward_zero,
    try_control,
    write_braking,
)
from mrmg.planning.problem.problem import Problem
from mrmg.scene.types import Scene

PLANNING_MARGIN_M = 0.25
ROBOT_MARGIN_M = 0.5

DT_S = 0.1
OBSTACLES = [
    {"box": {"center": [15, 10], "size": [2.5, 4], "yaw": 0.5}, "height": 1},
    {"circle": {"center": [8, 15.5], "radius": 1.3}, "height": 1},
    {
        "polygon": [[19, 3], [27, 3], [27, 8], [19, 8]],
        "holes": [[[20, 4], [26, 4], [26, 7], [20, 7]]],
        "height": 1,
    },
    {"polygon": [[3, 4], [6, 2], [9, 5]], "height": 1, "blocks": ["r2"]},
]
POSES = [(4, 10, 0.2), (10, 10, 2.8), (20, 12, -2.0), (25, 14, 1.0)]
ROUNDING_M = 1e-9

MakeScene = Callable[..., Scene]
MakeProblem = Callable[..., Problem]


@pytest.fixture
def crowd(yard: MakeScene, state: MakeProblem) -> Callable[..., Problem]:
    """Return the maker of problems with some cars (0) and unicycles (1) in the yard."""

    def make(models: tuple[int, ...]) -> Problem:
        robots = [
            {"id": f"r{i + 1}", "model": "car", "pose": list(POSES[i])}
            for i in range(len(models))
        ]
        goals = [{"id": "g", "circle": {"center": [28, 18], "radius": 1}}]
        obstacles = [{"id": f"o{i}", **item} for i, item in enumerate(OBSTACLES)]
        scene = yard(obstacles=obstacles, robots=robots, goals=goals)
        problem = state(scene, samples=50)
        problem.mission.fleet["model"] = models
        return problem

    return make


def committed(problem: Problem, now: np.ndarray | None = None) -> Contingency:
    """Return the contingency trajectories of robots, which stand at their start."""
    fleet = problem.mission.fleet
    # In Python: kernels may not return to it what they are handed by reference.
    make = getattr(new_contingency, "py_func", new_contingency)
    contingency = make(fleet.view(np.recarray), problem.mission.zones, DT_S)
    for r, state in enumerate(problem.start if now is None else now):
        write_braking(fleet, r, state, DT_S, contingency, 0)
    return contingency


def drive_at_random(
    problem: Problem, contingency: Contingency, seed: int, steps: int
) -> Iterator[list[bool]]:
    """Drive all robots, in random order of right of way; yield who got its wish."""
    fleet, spaces = problem.mission.fleet, problem.mission.spaces
    rng = np.random.default_rng(seed)
    robots = len(fleet)
    wanted = np.zeros((robots, 2))
    for n in range(steps):
        decided = np.zeros(robots, bool)
        granted = [False] * robots
        for r in rng.permutation(robots).tolist():
            if n % 12 == 0:
                fast = rng.choice([0.0, 1.0, -1.0], p=[0.1, 0.65, 0.25])
                wanted[r] = 3.0 * fast, rng.uniform(-1.0, 1.0)
            before = present_state(contingency, r).copy()
            u1, u2 = control_towards(fleet, r, before, *wanted[r], DT_S)
            if rng.random() < 0.95:
                granted[r] = try_control(
                    fleet, spaces, contingency, decided, r, u1, u2, DT_S
                )
            if not granted[r]:
                u1, u2 = braking_control(fleet, r, before, DT_S)
                follow_braking(contingency, r)
            after = np.empty(5)
            step(fleet[r], before, u1, u2, DT_S, after)
            assert present_state(contingency, r) == pytest.approx(after, abs=1e-9)
            decided[r] = True
        yield granted


def committed_states(contingency: Contingency) -> np.ndarray:
    """Return what each robot is committed to from now on, shape (R, K, 5)."""
    robots, _, most, _ = contingency.state.shape
    states = np.empty((robots, most, 5))
    for r in range(robots):
        slot = contingency.active[r]
        last = contingency.length[r, slot] - 1
        index = np.minimum(contingency.now[r] + np.arange(most), last)
        states[r] = contingency.state[r, slot, index]
    return states


def footprints(problem: Problem, states: np.ndarray) -> np.ndarray:
    """Return the robots' outlines at states of shape (R, ..., 5), shape (R, ...)."""
    outlines = []
    for robot, own in zip(problem.scene.robots, states, strict=True):
        cos, sin = np.cos(own[..., 2]), np.sin(own[..., 2])
        corner = robot.model.footprint_m
        x = own[..., 0, None] + cos[..., None] * corner[:, 0]
        x = x - sin[..., None] * corner[:, 1]
        y = own[..., 1, None] + sin[..., None] * corner[:, 0]
        y = y + cos[..., None] * corner[:, 1]
        outlines.append(shapely.polygons(np.stack([x, y], axis=-1)))
    return np.array(outlines)


def distances(problem: Problem, outlines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return distances from obstacles and bounds, (R, ...), and of pairs, (P, ...)."""
    scene = problem.scene
    frame = shapely.box(*scene.bounds).exterior
    obstacle, pair = [], []
    for r, robot in enumerate(scene.robots):
        shapes = [o.shape for o in scene.obstacles if o.stops(robot.id)]
        near = shapely.distance(outlines[r], shapely.union_all([frame, *shapes]))
        obstacle.append(np.where(shapely.covers(frame.envelope, outlines[r]), near, -1))
        pair += [shapely.distance(outlines[r], outlines[o]) for o in range(r)]
    return np.array(obstacle), np.array(pair)


@pytest.mark.parametrize(
    ("models", "seed"),
    [
        ((CAR, CAR), 0),
        ((CAR, CAR), 8),
        ((CAR, CAR, CAR), 2),
        ((CAR, CAR, CAR, CAR), 3),
        ((CAR, CAR, CAR, CAR), 4),
        ((UNICYCLE, CAR, UNICYCLE), 5),
        ((UNICYCLE, UNICYCLE, UNICYCLE, CAR), 6),
    ],
)
def test_all_that_robots_are_committed_to_keeps_the_margins(
    crowd: Callable[..., Problem], models: tuple[int, ...], seed: int
) -> None:
    problem = crowd(models)
    contingency = committed(problem)
    granted, states = [], []
    for outcome in drive_at_random(problem, contingency, seed, 500):
        granted.append(outcome)
        states.append(committed_states(contingency))
    ahead = np.array(states).swapaxes(0, 1)  # (R, n, K, 5)
    obstacle, pair = distances(problem, footprints(problem, ahead))
    assert obstacle.min() >= PLANNING_MARGIN_M - ROUNDING_M
    assert pair.min() >= ROBOT_MARGIN_M - ROUNDING_M
    # They did get near, were refused, and went on: the margins were put to the test.
    assert obstacle.min() < PLANNING_MARGIN_M + 0.1
    assert pair.min() < ROBOT_MARGIN_M + 0.3
    assert 0.1 < np.mean(granted) < 0.9


@pytest.mark.parametrize("models", [(CAR, CAR, CAR), (UNICYCLE, CAR, UNICYCLE)])
def test_committed_braking_ends_at_rest_as_early_as_the_limits_allow(
    crowd: Callable[..., Problem], models: tuple[int, ...]
) -> None:
    problem = crowd(models)
    fleet = problem.mission.fleet
    contingency = committed(problem)
    for _ in drive_at_random(problem, contingency, 7, 200):
        for r in range(len(fleet)):
            slot = contingency.active[r]
            n = contingency.length[r, slot]
            own = contingency.state[r, slot, :n]
            assert stands(fleet, r, own[-1])
            assert abs(own[-1, 3]) < 1e-9
            step_v = fleet[r]["limit"][3] * DT_S
            least = np.ceil(abs(own[0, 3]) / step_v - 1e-6)
            if fleet[r]["model"] == CAR:
                assert n - 1 == least
                assert np.ptp(own[:, 4]) == 0.0, "a car holds its steering"
            else:
                step_w = fleet[r]["limit"][4] * DT_S
                least = max(least, np.ceil(abs(own[0, 4]) / step_w - 1e-6))
                assert n - 1 == least
            assert np.abs(np.diff(own[:, 3])).max(initial=0.0) <= step_v + 1e-12


def stop_all(fleet: np.ndarray, problem: Problem, now: np.ndarray) -> np.ndarray:
    """Return the controls that brake all robots to rest, shape (n, R, 2)."""
    contingency = committed(problem, now)
    lasting = contingency.length[:, 0] - 1
    control = np.zeros((int(lasting.max()), len(now), 2))
    for k, held in enumerate(control):
        for r in range(len(now)):
            state = contingency.state[r, 0, min(k, lasting[r])]
            held[r] = braking_control(fleet, r, state, DT_S)
    return control


def test_stopping_from_any_moment_is_safe_and_ends_at_rest(
    crowd: Callable[..., Problem],
) -> None:
    problem = crowd((CAR, UNICYCLE, CAR, CAR))
    fleet = problem.mission.fleet
    contingency = committed(problem)
    moments = 0
    for n, _ in enumerate(drive_at_random(problem, contingency, 11, 300)):
        if n % 10:
            continue
        now = np.stack([present_state(contingency, r) for r in range(4)])
        control = stop_all(fleet, problem, now)
        states = [now]
        for held in control:
            after = np.empty((4, 5))
            for r in range(4):
                u1, u2 = held[r]
                assert abs(u1) <= fleet[r]["limit"][3] + 1e-12
                assert abs(u2) <= fleet[r]["limit"][4] + 1e-12
                step(fleet[r], states[-1][r], u1, u2, DT_S, after[r])
            states.append(after)
        assert all(stands(fleet, r, states[-1][r]) for r in range(4))
        moments += len(control) > 3
        way = np.array(states).swapaxes(0, 1)
        obstacle, pair = distances(problem, footprints(problem, way))
        assert obstacle.min() >= PLANNING_MARGIN_M - ROUNDING_M
        assert pair.min() >= ROBOT_MARGIN_M - ROUNDING_M
    assert moments > 10


def test_the_rate_towards_zero_stops_without_overshoot() -> None:
    rng = np.random.default_rng(3)
    for value, bound in zip(
        rng.uniform(-2.0, 2.0, 300), rng.uniform(0.1, 15.0, 300), strict=True
    ):
        rate = toward_zero(value, bound, DT_S)
        left = value + rate * DT_S
        assert abs(rate) <= bound
        assert abs(left) == pytest.approx(
            max(0.0, abs(value) - bound * DT_S), abs=1e-12
        )
        assert left * value >= -1e-12
    assert toward_zero(0.0, 1.0, DT_S) == 0.0


def test_a_refused_control_changes_nothing(crowd: Callable[..., Problem]) -> None:
    """A proposal is written to the idle slot: what is in force must not move."""
    problem = crowd((CAR, CAR))
    fleet, spaces = problem.mission.fleet, problem.mission.spaces
    contingency = committed(problem)
    out_of_the_yard = 1e5
    for _ in drive_at_random(problem, contingency, 5, 100):
        before = committed_states(contingency)
        book = contingency.active.copy(), contingency.now.copy()
        decided = np.ones(2, bool)
        assert not try_control(
            fleet, spaces, contingency, decided, 0, out_of_the_yard, 0.0, DT_S
        )
        assert np.array_equal(committed_states(contingency), before)
        assert np.array_equal(contingency.active, book[0])
        assert np.array_equal(contingency.now, book[1])
