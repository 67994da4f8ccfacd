"""Conflicts, obstacles and zones in the search for motions, against exact geometry."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import shapely

from mrmg.planning.path_following.coordination._conflict_kernels import (
    first_conflict,
    standing_cost,
)
from mrmg.planning.path_following.coordination._motion_kernels import (
    OTHER,
    Traffic,
    clear,
)
from mrmg.planning.problem.problem import Problem
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS
from mrmg.scene.types import Scene

STEP_M = 0.2
STEPS = 60
SOFT_S = 4.0


@pytest.fixture
def problem(yard: Callable[..., Scene], state: Callable[..., Problem]) -> Problem:
    """Two cars that face each other, and a station for one robot at a time."""
    poses = {"r1": [5, 10, 0], "r2": [24, 10, np.pi]}
    robots = [{"id": name, "model": "car", "pose": at} for name, at in poses.items()]
    station = {"id": "s", "circle": {"center": [12, 10], "radius": 1}, "capacity": 1}
    goals = [{"id": "g", "circle": {"center": [28, 18], "radius": 1}}]
    return state(yard(robots=robots, stations=[station], goals=goals), samples=50)


def straight(pose: np.ndarray, steps: int) -> np.ndarray:
    """States of a robot that drives on along its heading, shape (steps + 1, 5)."""
    states = np.zeros((steps + 1, 5))
    heading = np.array([np.cos(pose[2]), np.sin(pose[2])])
    states[:, :3] = pose[:3]
    states[:, :2] += STEP_M * np.arange(steps + 1)[:, None] * heading
    return states


def traffic_of(problem: Problem, states: np.ndarray, *, hard: bool = True) -> Traffic:
    """What robot r1 sees of robot r2, which goes through some states."""
    fleet = problem.mission.fleet
    c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
    seen = np.column_stack([states[:, :3], c, s])
    pose = np.stack([np.zeros_like(seen), seen])
    model = problem.scene.robots[1].model
    footprint = shapely.MultiPoint(model.footprint_m).bounds
    ahead, aside = (footprint[2] + footprint[0]) / 2, (footprint[3] + footprint[1]) / 2
    closing_m = 3.0 * STEP_M
    offset = np.stack([c * ahead - s * aside, s * ahead + c * aside], axis=1)
    return Traffic(
        fleet=fleet,
        pose=pose,
        middle=pose[:, :, :2] + np.stack([np.zeros_like(offset), offset]),
        robot=np.array(
            [
                (0, closing_m, False, False),
                (len(states) - 1, closing_m, hard, not hard),
            ],
            OTHER,
        ),
        busy=np.zeros((1, len(states)), bool),
        end=len(states) - 1,
    )


def apart_m(problem: Problem, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Distance of both robots' footprints, step by step."""
    first, second = (robot.model for robot in problem.scene.robots)
    return np.asarray(
        shapely.distance(
            shapely.polygons(first.footprint_at(one)),
            shapely.polygons(second.footprint_at(other)),
        )
    )


def corners() -> np.ndarray:
    return np.empty((2, MOST_CORNERS, 2))


@pytest.mark.parametrize("aside_m", [0.0, 1.2, 1.5, 1.7, 3.0])
def test_the_first_conflict_is_where_robots_come_too_near(
    problem: Problem, aside_m: float
) -> None:
    own = straight(problem.start[0] + [0.0, aside_m, 0.0, 0.0, 0.0], STEPS)
    other = straight(problem.start[1], STEPS)
    spacing_m = float(problem.mission.fleet["spacing"].max())
    near = np.flatnonzero(apart_m(problem, own, other)[1:] < spacing_m)
    expected = int(near[0]) + 1 if len(near) else -1
    assert (expected > 0) == (aside_m < 1.6)
    traffic = traffic_of(problem, other)
    fleet = problem.mission.fleet[:1]
    assert first_conflict(fleet, traffic, 1, own, STEPS, 0, corners()) == expected


def test_robots_that_meet_between_steps_are_in_conflict(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """At right angles the corners of two cars overlap for less than a step."""
    robots = [
        {"id": name, "model": "car", "pose": pose, "margins": {"robot": 0.0}}
        for name, pose in {"r1": [4, 10, 0], "r2": [15, 3, 0.5 * np.pi]}.items()
    ]
    problem = state(yard(robots=robots), samples=50)
    fleet, between = problem.mission.fleet[:1], np.linspace(0.0, 1.0, 21)[:, None]
    unseen = 0
    for back_m in np.linspace(-4.0, 4.0, 400):
        own = straight(problem.start[0], STEPS)
        other = straight(problem.start[1] + [0.0, back_m, 0.0, 0.0, 0.0], STEPS)
        least_m = [
            apart_m(
                problem, *(a[k] + between * (a[k + 1] - a[k]) for a in (own, other))
            )
            for k in range(STEPS)
        ]
        at_steps_m = apart_m(problem, own, other)
        meet, near = np.min(least_m) <= 0.0, np.min(least_m) < 0.02
        unseen += meet and at_steps_m.min() > 0.0
        traffic = traffic_of(problem, other)
        found = first_conflict(fleet, traffic, 1, own, STEPS, 0, corners())
        assert (found >= 0) or not meet, back_m
        assert found < 0 or near, back_m
    assert unseen >= 2


@pytest.mark.parametrize(
    ("aside_m", "hard", "cost_s"),
    [(0.0, True, np.inf), (0.0, False, SOFT_S), (3.0, True, 0.0), (3.0, False, 0.0)],
)
def test_who_stays_in_the_way_of_others_pays_for_it(
    problem: Problem, aside_m: float, hard: bool, cost_s: float
) -> None:
    own = problem.start[0] + [0.0, aside_m, 0.0, 0.0, 0.0]
    traffic = traffic_of(problem, straight(problem.start[1], 80), hard=hard)
    fleet = problem.mission.fleet[:1]
    assert standing_cost(fleet, traffic, own, 0, SOFT_S, corners()) == cost_s


@pytest.mark.parametrize(("steps", "kept"), [(60, True), (118, False)])
def test_motions_keep_the_margin_from_the_bounds(
    problem: Problem, steps: int, kept: bool
) -> None:
    own = straight(problem.start[0], steps)
    footprint = problem.scene.robots[0].model.footprint_at(own)
    margin_m = float(problem.mission.fleet["margin"][0])
    assert (footprint[:, :, 0].max() + margin_m < 30.0) == kept
    assert is_clear(problem, own, busy=False) == kept


@pytest.mark.parametrize("busy", [False, True])
def test_motions_enter_no_zone_that_another_robot_is_in(
    problem: Problem, busy: bool
) -> None:
    through = straight(problem.start[0], 50)
    assert is_clear(problem, through, busy=busy) != busy
    before = straight(problem.start[0], 20)
    assert is_clear(problem, before, busy=busy)


def is_clear(problem: Problem, states: np.ndarray, *, busy: bool) -> bool:
    mission = problem.mission
    traffic = traffic_of(problem, straight(problem.start[1], STEPS))
    traffic.busy[:] = busy
    fleet, count = mission.fleet[:1], len(states) - 1
    found = clear(
        fleet, mission.spaces, mission.zones, traffic, states, count, 0, corners()
    )
    return bool(found)
