"""What one robot is to drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mrmg.planning import PlannerParams
from mrmg.planning.path_following.band import SPACINGS_M
from mrmg.planning.path_following.following import tour_path
from mrmg.planning.path_following.refine import cost_maps_of
from mrmg.planning.path_following.robot_task import RobotTask, clearance_deficit_m
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


def test_what_a_path_lacks_is_what_an_obstacle_is_too_near(
    task: Callable[..., RobotTask],
) -> None:
    clear = task([])
    assert clearance_deficit_m(clear.cost_map, clear.path) == 0.0
    fenced = task(FENCE)
    assert clearance_deficit_m(fenced.cost_map, fenced.path) < 0.2
    through = replace(clear.path, node=np.stack([np.linspace(4, 26, 30), [10] * 30], 1))
    through = replace(through, gear=np.ones(29, np.int64))
    assert clearance_deficit_m(fenced.cost_map, through) > fenced.cost_map.room - 0.3
