"""Braking is what planning takes it for, and ends with straight wheels."""

from __future__ import annotations

import numpy as np
import pytest

from mrmg.motion._kernels import step
from mrmg.planning.problem._control_kernels import braking_control, stands
from mrmg.planning.roadmap.fleet import fleet_array
from mrmg.scene.loading import scene_from_document
from mrmg.scene.margins import Margins
from mrmg.scene.types import Scene
from mrmg.supervision.stopping import brake_to_rest
from mrmg.world.world import World

DT_S = 0.1


def one_robot(model: str) -> Scene:
    return scene_from_document(
        {
            "format": 1,
            "name": "one",
            "bounds": [0, 0, 20, 20],
            "robots": [{"id": "r1", "model": model, "pose": [10, 10, 0]}],
        },
        source="one",
    )


@pytest.mark.parametrize("speed", [1.7, -0.9, 0.31, 0.0])
@pytest.mark.parametrize("model", ["car", "diffdrive"])
def test_braking_is_what_planning_takes_it_for(model: str, speed: float) -> None:
    scene = one_robot(model)
    state = np.array([10.0, 10.0, 0.4, speed, 0.37])
    states, controls = brake_to_rest(scene.robots[0].model, state, DT_S)
    own = fleet_array(scene, World.from_scene(scene), Margins()).view(np.recarray)
    expected, n = state.copy(), 0
    while not stands(own, 0, expected):
        before = expected.copy()
        u1, u2 = braking_control(own, 0, before, DT_S)
        step(own[0], before, u1, u2, DT_S, expected)
        n += 1
        np.testing.assert_allclose(states[n], expected, atol=1e-12)
    assert len(states) == len(controls) + 1


@pytest.mark.parametrize("model", ["car", "diffdrive"])
def test_braking_ends_at_rest_within_the_limits(model: str) -> None:
    robot = one_robot(model).robots[0]
    limits = robot.model.limits.scaled(robot.model.planning_share)
    start = np.array([0.0, 0.0, 0.0, limits.v_max_m_s, -limits.w_max])
    states, controls = brake_to_rest(robot.model, start, DT_S)
    np.testing.assert_allclose(states[-1, 3:], 0.0, atol=1e-9)
    assert np.abs(controls[:, 0]).max() <= limits.u1_max_m_s2 + 1e-12
    assert np.abs(controls[:, 1]).max() <= limits.u2_max + 1e-12


def test_a_standing_robot_brakes_in_no_time() -> None:
    states, controls = brake_to_rest(
        one_robot("car").robots[0].model, np.zeros(5), DT_S
    )
    assert states.shape == (1, 5)
    assert controls.shape == (0, 2)
