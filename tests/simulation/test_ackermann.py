"""Cars drive as the motion model says, and steer without lag."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.simulation.fleet import Fleet
from mrmg.simulation.world_model import build_world

STEERS = [0.05, 0.2, 0.35, 0.5]
SPEEDS = [0.5, 1.0, 2.0, 3.0]
GRIP_SHARE = 0.85
"""Share of the tyres' grip that turning may take and still be steady."""


@pytest.fixture(scope="module", params=["car", "hauler"])
def scene(request: pytest.FixtureRequest, driving: SimpleNamespace) -> Scene:
    """One car at the origin, looking along x."""
    return driving.open_ground([(0.0, 0.0, 0.0)], models=[request.param])


@pytest.fixture(scope="module")
def model(scene: Scene) -> RobotModel:
    return scene.robots[0].model


@pytest.fixture(scope="module")
def mjcf(model: RobotModel) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(model.mjcf))


def test_axles_agree(model: RobotModel, mjcf: mujoco.MjModel) -> None:
    for side in ("l", "r"):
        rear, front = (mjcf.body(f"wheel_{axle}{side}").pos for axle in "rf")
        assert rear[0] == 0.0
        assert front[0] == pytest.approx(model.wheelbase_m)


def test_rolling_resistance_before_the_first_tick(
    model: RobotModel, mjcf: mujoco.MjModel
) -> None:
    dofs = [mjcf.joint(name).dofadr[0] for name in ("spin_rl", "spin_rr")]
    force = mjcf.dof_frictionloss[dofs].sum() / model.wheel_radius_m
    assert force == pytest.approx(model.energy_model.rolling_force_N, rel=1e-4)


def test_steering_reaches_the_limit_on_both_sides(
    model: RobotModel, mjcf: mujoco.MjModel
) -> None:
    """The inner wheel turns more than psi; its joint and its servo must allow that."""
    tan = np.tan(model.limits.w_max)
    inner = np.arctan(
        model.wheelbase_m * tan / (model.wheelbase_m - model.track_m / 2 * tan)
    )
    for name in ("steer_fl", "steer_fr"):
        low, high = mjcf.joint(name).range
        assert low <= -inner
        assert high >= inner
    np.testing.assert_array_less(inner, mjcf.actuator("steer_l").ctrlrange[1])


def circle(scene: Scene, speed: float, steer: float) -> tuple[float, float]:
    """Return measured yaw rate and speed on a steady circle at about `speed`."""
    world = build_world(scene)
    data = mujoco.MjData(world.model)
    fleet = Fleet(world, data)
    fleet.set_resistance(np.zeros(1), np.zeros(1))
    mass = scene.robots[0].model.mass_kg
    angle, gain, most = np.array([steer]), 4.4 * mass, 2.8 * mass
    for _ in range(150):
        force = gain * (speed - fleet.axle_speed_m_s())
        fleet.drive(np.clip(force, -most, most), angle, angle, 5)
    before, since = fleet.state()[0], data.time
    for _ in range(50):
        fleet.drive(gain * (speed - fleet.axle_speed_m_s()), angle, angle, 5)
    after = fleet.state()[0]
    rate = (after[2] - before[2]) / (data.time - since)
    assert after[4] == pytest.approx(steer, abs=1e-3)
    return rate, after[3]


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("steer", STEERS)
def test_yaw_rate_is_that_of_the_kinematic_model(
    scene: Scene, model: RobotModel, speed: float, steer: float
) -> None:
    """Wherever the tyres can hold the turn at all."""
    curvature = np.tan(steer) / model.wheelbase_m
    held_m_s2 = GRIP_SHARE * model.friction_coefficient * 9.81
    driven = min(speed, np.sqrt(held_m_s2 / curvature))
    rate, driven = circle(scene, driven, steer)
    assert rate == pytest.approx(driven * curvature, rel=0.005)


def test_steering_follows_a_ramp_without_lag(scene: Scene) -> None:
    world = build_world(scene)
    fleet = Fleet(world, mujoco.MjData(world.model))
    still = np.zeros(1)
    for tick in range(25):
        fleet.drive(still, still + 0.02 * tick, still + 0.02 * (tick + 1), 5)
    assert fleet.state()[0, 4] == pytest.approx(0.5, abs=2e-3)


def test_state_before_the_first_step_is_the_start(scene: Scene) -> None:
    start = replace(scene.robots[0], pose=(1.0, -2.0, 2.5))
    world = build_world(replace(scene, robots=(start,)))
    state = Fleet(world, mujoco.MjData(world.model)).state()[0]
    np.testing.assert_allclose(state, [1.0, -2.0, 2.5, 0.0, 0.0], atol=1e-12)
