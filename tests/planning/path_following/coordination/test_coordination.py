"""The search over motions has room for all that it may come to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import mrmg
from mrmg.planning.path_following.coordination.coordination import (
    coordinated,
    empty_nodes,
)
from mrmg.planning.path_following.coordination.rounds import ROUNDS
from mrmg.planning.path_following.coordination.tasks import no_path, task_of
from mrmg.planning.problem._target_kernels import at_target
from mrmg.planning.problem.problem import Problem
from mrmg.scene.types import Scene

OTHERS = 6
"""To track, hold, wait, stay, visit and end."""


@pytest.mark.parametrize("model", ["car", "diffdrive", "husky"])
def test_the_table_of_cells_is_never_full(
    yard: Callable[..., Scene], state: Callable[..., Problem], model: str
) -> None:
    """A full one would be looked through for ever, as keys without nodes count, too."""
    robots = [{"id": "r", "model": model, "pose": [6, 10, 0]}]
    problem = state(yard(robots=robots), samples=50)
    for effort in ROUNDS:
        task = task_of(problem, 0, [], no_path(problem, 0), effort)
        keys = effort.most * (len(task.motion) + OTHERS)
        assert len(empty_nodes(task).table) > keys


def test_a_robot_ends_where_its_tolerances_leave_room(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """With the very pose that is wanted, its side would touch the wall."""
    finish = {
        "circle": {"center": [20, 10], "radius": 0.5},
        "heading": 0.0,
        "heading_tolerance": 0.2,
    }
    pose = {"id": "r", "model": "car", "pose": [6, 10, 0]}
    half_m = yard(robots=[pose]).robots[0].model.half_width_m
    wall = [[17, 10 + half_m], [23, 10 + half_m], [23, 14], [17, 14]]
    scene = yard(
        goals=[],
        robots=[{**pose, "finish": finish}],
        obstacles=[{"id": "wall", "polygon": wall}],
    )
    problem = state(scene, samples=50)
    found = coordinated(
        problem, [[0]], [no_path(problem, 0)], np.zeros(1, bool), rounds=ROUNDS[:1]
    )
    assert found
    assert at_target(problem.mission.targets, 0, found[0].state[-1])


def test_a_robot_sets_out_by_shorter_motions_where_there_is_no_room_for_longer_ones(
    yard: Callable[..., Scene],
) -> None:
    """Every motion of the first length runs into a wall; later rounds' are shorter."""
    obstacles = [
        {"id": name, "polygon": [[x, 4], [x + 0.5, 4], [x + 0.5, 16], [x, 16]]}
        for name, x in (("ahead", 12.3), ("behind", 8.4))
    ]
    scene = yard(
        goals=[{"id": "g", "circle": {"center": [10.3, 10], "radius": 0.2}}],
        robots=[{"id": "r", "model": "car", "pose": [10, 10, 0]}],
        obstacles=obstacles,
    )
    plan = mrmg.plan(scene).plan
    assert plan is not None
    assert mrmg.verify(scene, plan).ok
