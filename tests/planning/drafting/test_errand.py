"""What one robot is to drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mrmg.planning import PlannerParams
from mrmg.planning.drafting.band import SPACINGS_M
from mrmg.planning.drafting.drafting import tour_path
from mrmg.planning.drafting.errand import Errand, lack_m
from mrmg.planning.drafting.refine import surfaces_of
from mrmg.planning.problem.problem import state_mission
from mrmg.scene.types import Scene

FENCE = [{"id": "fence", "box": {"center": [15, 13], "size": [0.4, 14]}}]


@pytest.fixture
def errand(yard: Callable[..., Scene]) -> Callable[..., Errand]:
    def make(obstacles: list[object]) -> Errand:
        scene = yard(obstacles=obstacles)
        problem = state_mission(scene, 0, PlannerParams(samples=600))
        made = Errand([0], tour_path(problem, 0, [0]), surfaces_of(problem)[0])
        made.tighten(problem, SPACINGS_M)
        return made

    return make


def test_paths_drawn_tight_stay_before_thin_walls(
    errand: Callable[..., Errand],
) -> None:
    path = errand(FENCE).path
    at_fence = path.node[np.abs(path.node[:, 0] - 15.0) < 0.6]
    assert len(at_fence)
    assert (at_fence[:, 1] < 6.0).all()


def test_what_a_path_lacks_is_what_an_obstacle_is_too_near(
    errand: Callable[..., Errand],
) -> None:
    clear = errand([])
    assert lack_m(clear.surface, clear.path) == 0.0
    fenced = errand(FENCE)
    assert lack_m(fenced.surface, fenced.path) < 0.2
    through = replace(clear.path, node=np.stack([np.linspace(4, 26, 30), [10] * 30], 1))
    through = replace(through, gear=np.ones(29, np.int64))
    assert lack_m(fenced.surface, through) > fenced.surface.room - 0.3
