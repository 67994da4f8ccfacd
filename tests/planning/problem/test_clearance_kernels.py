"""Robots between time steps, followed past obstacles, against dense samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import shapely

from mrmg.planning.problem._clearance_kernels import keeps_clear, moves_clear
from mrmg.planning.problem.problem import Problem
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS
from mrmg.scene.types import Scene

SAMPLES = 200
TOUCH_M = 0.02
"""Distance below which a step is between touching and keeping clear."""


def distances_m(scene: Scene, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Distance from obstacles and bounds at samples of a step, with its ends."""
    share = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    poses = before + share * (after - before)
    walls = [shapely.box(*scene.bounds).boundary, *(o.shape for o in scene.obstacles)]
    bodies = shapely.polygons(scene.robots[0].model.footprint_at(poses))
    return np.asarray(shapely.distance(bodies, shapely.union_all(walls)))


@pytest.mark.parametrize("margin_m", [0.0, 0.1])
@pytest.mark.parametrize("model", ["car", "diffdrive"])
def test_steps_that_touch_are_found_and_others_allowed(
    yard: Callable[..., Scene],
    state: Callable[..., Problem],
    model: str,
    margin_m: float,
) -> None:
    """With little margin corners poke between the footprints at both ends."""
    post = {"id": "post", "box": {"center": [15, 10], "size": [0.3, 0.3], "yaw": 0.7}}
    wall = {"id": "wall", "box": {"center": [20, 14], "size": [6, 0.5]}}
    robots = [
        {
            "id": "r",
            "model": model,
            "pose": [4, 10, 0],
            "margins": {"obstacle": margin_m},
        }
    ]
    scene = yard(robots=robots, obstacles=[post, wall])
    problem = state(scene, samples=50)
    own, spaces = problem.mission.fleet[:1], problem.mission.spaces
    corner = np.empty((MOST_CORNERS, 2))
    rng = np.random.default_rng(0)
    found = {True: 0, False: 0}
    for _ in range(3000):
        before, after = np.zeros(5), np.zeros(5)
        before[:3] = rng.uniform((12, 8, -np.pi), (23, 15, np.pi))
        moved = (1.0 + 10.0 * margin_m) * rng.uniform(-1.0, 1.0, 3)
        after[:3] = before[:3] + moved * (0.7, 0.7, 0.6)
        ends = (before, after)
        if not all(keeps_clear(own, spaces, at, margin_m, corner) for at in ends):
            continue
        away_m = distances_m(scene, before[:3], after[:3])
        clear = bool(moves_clear(own, spaces, before, after, corner))
        if away_m.min() == 0.0:
            assert not clear, (before, after)
            found[False] += 1
        elif away_m.min() > TOUCH_M:
            way_m = np.hypot(*(after - before)[:2]) + 2.0 * abs(after[2] - before[2])
            assert clear or away_m.min() < 0.03 * way_m + TOUCH_M, (before, after)
            found[clear] += 1
    assert found[False] > 5
    assert found[True] > 300
