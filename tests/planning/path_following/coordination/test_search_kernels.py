"""The search for one robot's motion among others that move as given."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mrmg.planning.path_following._following_kernels import Course
from mrmg.planning.path_following.coordination._motion_kernels import Traffic
from mrmg.planning.path_following.coordination._node_kernels import Scratch, Setting
from mrmg.planning.path_following.coordination._search_kernels import find_motion
from mrmg.planning.path_following.coordination.coordination import empty_nodes
from mrmg.planning.path_following.coordination.fields import Fields
from mrmg.planning.path_following.coordination.rounds import ROUNDS
from mrmg.planning.path_following.coordination.tasks import (
    arrival_poses,
    no_path,
    task_of,
)
from mrmg.planning.path_following.coordination.traffic import FleetTraffic
from mrmg.planning.path_following.tracking import Motion, course_of, empty_path
from mrmg.planning.problem.problem import Problem
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS
from mrmg.scene.types import Scene

HORIZON = 2000


def found_control(problem: Problem, r: int, around: Traffic) -> np.ndarray:
    """Return controls of robot r to the first target among the others."""
    nowhere, guide = no_path(problem, r), Fields(problem).static(r, [0])
    task = task_of(problem, r, [0], nowhere, arrival_poses(problem, r, [0]), ROUNDS[1])
    search = Setting(
        own=problem.mission.fleet[r : r + 1],
        spaces=problem.mission.spaces,
        terrain=problem.mission.terrain,
        targets=problem.mission.targets,
        zones=problem.mission.zones,
        course=course_of(problem, r, nowhere),
        traffic=around,
        task=task._replace(guide=guide),
        dt=problem.dt_s,
    )
    room = Scratch(
        state=np.zeros((HORIZON + 1, 5)),
        control=np.zeros((HORIZON, 2)),
        corner=np.empty((2, MOST_CORNERS, 2)),
        near=np.empty(len(problem.start), np.int64),
        curve=Course(empty_path(100), np.zeros(1, np.int64), 0.0, 1.0),
    )
    control = np.zeros((HORIZON, 2))
    nodes = empty_nodes(search.task)
    count = find_motion(search, nodes, room, problem.start[r : r + 1], control)
    assert count > 0
    return control[:count]


@pytest.mark.parametrize("model", ["car", "diffdrive"])
@pytest.mark.parametrize("heading", [-2.6, -0.4, 0.7, 1.9])
def test_what_is_found_leads_to_the_target_when_it_is_driven(
    yard: Callable[..., Scene],
    state: Callable[..., Problem],
    model: str,
    heading: float,
) -> None:
    """Motions are worked out once and carried to where they are needed."""
    robots = [{"id": "own", "model": model, "pose": [6, 10, heading]}]
    goals = [{"id": "g", "circle": {"center": [12, 5], "radius": 1}}]
    problem = state(yard(robots=robots, goals=goals), samples=50)
    nobody = FleetTraffic(problem, HORIZON).around(0, [None], np.zeros(1, bool))
    driven = problem.trajectory(0, found_control(problem, 0, nobody))
    assert np.hypot(*(driven.state[:, :2] - (12.0, 5.0)).T).min() < 1.0


def test_near_robots_are_minded_where_a_wait_is_open(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """One that stands in the way sets out later; another one is far away."""
    poses = {"far": [4, 4, 0], "near": [15, 10, 0], "own": [6, 10, 0]}
    robots = [{"id": name, "model": "car", "pose": at} for name, at in poses.items()]
    goals = [{"id": "g", "circle": {"center": [24, 10], "radius": 1}}]
    problem = state(yard(robots=robots, goals=goals), samples=50)
    motions = [
        Motion(np.tile(at, (200, 1)), np.zeros((199, 2))) for at in problem.start
    ]
    motions[1].state[190:, 1] += 0.05 * np.arange(10)  # it sets out
    traffic = FleetTraffic(problem, HORIZON)
    above = np.array([False, True, False])
    around = traffic.around(2, [*motions[:2], None], above)
    control = found_control(problem, 2, around)
    own = problem.trajectory(2, control)
    found = [*motions[:2], Motion(own.state, own.control)]
    assert traffic.conflicts(2, found)[1] == np.inf
