"""The continuous plan against the exact motion between its states."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mrmg.motion.dynamics import DERIVATIVES, rk4_step
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.reference import FleetReference


@pytest.fixture(scope="module", params=["car", "diffdrive"])
def scene(request: pytest.FixtureRequest, driving: SimpleNamespace) -> Scene:
    """A car, and a robot of each kind."""
    poses = [(-20.0, 0.0, 0.3), (20.0, 0.0, 2.0)]
    return driving.open_ground(poses, models=["car", request.param])


@pytest.fixture(scope="module")
def plan(driving: SimpleNamespace, scene: Scene) -> Plan:
    """Half a minute of switching controls for two robots."""
    return driving.plan_of(
        scene, [driving.bang_bang(scene, name, 30.0, 5) for name in ("r1", "r2")]
    )


def test_passes_through_every_state(scene: Scene, plan: Plan) -> None:
    states = FleetReference(scene, plan).at(plan.trajectories[0].time_s)
    for index, trajectory in enumerate(plan.trajectories):
        np.testing.assert_allclose(states[:, index], trajectory.state, atol=1e-12)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_between_states_it_is_the_exact_motion(
    scene: Scene, plan: Plan, share: float
) -> None:
    """Oracle: a fine integration from the state before."""
    item, model = plan.trajectories[1], scene.robots[1].model
    step = rk4_step(DERIVATIVES[model.motion_model](math.sin, math.cos, math.tan))
    times = item.time_s[:-1] + share * plan.dt_s
    states = FleetReference(scene, plan).at(times)[:, 1]
    for start, control, state in zip(item.state, item.control, states, strict=False):
        exact = tuple(start)
        for _ in range(8):
            exact = step(exact, control, model.wheelbase_m, share * plan.dt_s / 8)
        np.testing.assert_allclose(state, exact, atol=1e-4)


def test_rests_after_the_end(scene: Scene, plan: Plan) -> None:
    reference = FleetReference(scene, plan)
    late = reference.at(np.array([reference.duration_s + 7.0]))[0]
    last = [item.state[-1] for item in plan.trajectories]
    np.testing.assert_allclose(late, last, atol=1e-12)


def test_at_half_the_pace_speeds_are_halved(scene: Scene, plan: Plan) -> None:
    """The way is the same; speeds and yaw rates match the way per real time."""
    reference = FleetReference(scene, plan)
    full = reference.paced(4.0, 1.0, 0.02, 11)
    half = reference.paced(4.0, 0.5, 0.04, 11)
    np.testing.assert_allclose(half[..., :3], full[..., :3])
    np.testing.assert_allclose(half[..., 3], 0.5 * full[..., 3])
    turns = [robot.model.motion_model == "unicycle" for robot in scene.robots]
    share = np.where(turns, 0.5, 1.0)
    np.testing.assert_allclose(half[..., 4], share * full[..., 4])
    np.testing.assert_allclose(reference.paced(4.0, 0.0, 0.1, 3)[..., 3], 0.0)


def test_one_time_is_as_good_as_many(scene: Scene, plan: Plan) -> None:
    reference = FleetReference(scene, plan)
    times = np.concatenate([np.linspace(0.0, 31.0, 200), plan.trajectories[0].time_s])
    for time_s, states in zip(times.tolist(), reference.at(times), strict=True):
        np.testing.assert_array_equal(reference.at(time_s), states)


def test_order_is_that_of_the_scene(scene: Scene, plan: Plan) -> None:
    turned = replace(plan, trajectories=plan.trajectories[::-1])
    at = np.array([3.3])
    np.testing.assert_array_equal(
        FleetReference(scene, turned).at(at), FleetReference(scene, plan).at(at)
    )


def test_a_plan_without_steps_stands_still(
    driving: SimpleNamespace, scene: Scene
) -> None:
    plan = driving.plan_of(scene, [np.empty((0, 2)), np.empty((0, 2))])
    reference = FleetReference(scene, plan)
    assert reference.duration_s == 0.0
    poses = [(*robot.pose, 0.0, 0.0) for robot in scene.robots]
    np.testing.assert_array_equal(reference.at(np.array([0.0, 1.0])), [poses, poses])
