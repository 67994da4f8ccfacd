"""What one robot is to drive."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mrmg.planning import PlannerParams
from mrmg.planning.path_following.band import SPACINGS_M
from mrmg.planning.path_following.cost_map import cost_maps_of
from mrmg.planning.path_following.following import tour_path
from mrmg.planning.path_following.robot_task import RobotTask
from mrmg.planning.problem.problem import state_mission
from mrmg.scene.types import Scene

FENCE = [{"id": "fence", "box": {"center": [15, 13], "size": [0.4, 14]}}]


@pytest.fixture
def task(yard: Callable[..., Scene]) -> Callable[..., RobotTask]:
    def make(obstacles: list[object]) -> RobotTask:
        scene = yard(obstacles=obstacles)
        problem = state_mission(scene, 0, PlannerParams(samples=600))
        made = RobotTask([0], tour_path(problem, 0, [0]), cost_maps_of(problem)[0])
        made.smooth(problem, SPACINGS_M)
        return made

    return make


def test_paths_drawn_tight_stay_before_thin_walls(
    task: Callable[..., RobotTask],
) -> None:
    path = task(FENCE).path
    at_fence = path.node[np.abs(path.node[:, 0] - 15.0) < 0.6]
    assert len(at_fence)
    assert (at_fence[:, 1] < 6.0).all()
