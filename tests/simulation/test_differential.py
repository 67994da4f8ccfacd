"""Differential drives turn as the motion model says, at the work the model says."""

from __future__ import annotations

from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.simulation.fleet import Fleet
from mrmg.simulation.ground import Ground, true_resistance
from mrmg.simulation.world_model import MujocoWorld, build_world

TICK_S = 0.02


@pytest.fixture(scope="module")
def scene(driving: SimpleNamespace) -> Scene:
    return driving.open_ground([(0.0, 0.0, 0.0)], models=["diffdrive"])


@pytest.fixture(scope="module")
def model(scene: Scene) -> RobotModel:
    return scene.robots[0].model


def started(scene: Scene) -> tuple[MujocoWorld, mujoco.MjData, Fleet]:
    world = build_world(scene)
    data = mujoco.MjData(world.model)
    return world, data, Fleet(world, data)


def test_swing_tendon_measures_what_the_wheels_roll_differently(
    model: RobotModel,
) -> None:
    mjcf = mujoco.MjModel.from_xml_path(str(model.mjcf))
    start = mjcf.tendon_adr[mjcf.tendon("swing").id]
    radius = model.wheel_radius_m
    np.testing.assert_allclose(mjcf.wrap_prm[start : start + 2], [-radius, radius])
    weight_N = model.mass_kg * 9.81
    for name, coefficient in (
        ("axle", model.rolling_coefficient),
        ("swing", model.turning_coefficient),
    ):
        friction = mjcf.tendon_frictionloss[mjcf.tendon(name).id]
        assert friction == pytest.approx(coefficient * weight_N)


def test_motors_give_the_traction_force(model: RobotModel) -> None:
    mjcf = mujoco.MjModel.from_xml_path(str(model.mjcf))
    for name in ("drive_l", "drive_r"):
        assert mjcf.actuator(name).gear[0] == pytest.approx(model.wheel_radius_m)


def turning(scene: Scene, speed: float, yaw_rate: float) -> tuple[float, float]:
    """Return measured yaw rate and speed when both are asked for and settled."""
    world, data, fleet = started(scene)
    true = true_resistance(world)
    still = np.zeros(1)
    fleet.set_resistance(
        true.force_N(Ground(still + 1.0, still, still + 1.0)), true.swing_N
    )
    gain, most = 4.4 * scene.robots[0].model.mass_kg, 2.8 * 60.0
    asked, w = np.array([yaw_rate]), np.zeros(1)
    for _ in range(200):
        force = (
            gain * (speed - fleet.axle_speed_m_s()) + np.sign(speed) * true.rolling_N
        )
        following = w + np.clip(asked - w, -TICK_S, TICK_S)
        fleet.drive(np.clip(force, -most, most), w, following, 5)
        w = following
    before, since = fleet.state()[0], data.time
    for _ in range(50):
        force = (
            gain * (speed - fleet.axle_speed_m_s()) + np.sign(speed) * true.rolling_N
        )
        fleet.drive(force, asked, asked, 5)
    after = fleet.state()[0]
    return (after[2] - before[2]) / (data.time - since), after[3]


@pytest.mark.parametrize("speed", [0.0, 0.5, 1.6, 3.0, -0.8])
@pytest.mark.parametrize("yaw_rate", [0.1, 0.6, -1.2])
def test_yaw_rate_is_the_one_asked_for(
    scene: Scene, speed: float, yaw_rate: float
) -> None:
    rate, driven = turning(scene, speed, yaw_rate)
    assert rate == pytest.approx(yaw_rate, rel=0.005)
    assert driven == pytest.approx(speed, abs=0.02)


def test_turning_on_the_spot_takes_what_the_model_says(
    scene: Scene, model: RobotModel
) -> None:
    """Three turns: C_turn m g times the track times the angle, and no way along."""
    world, data, fleet = started(scene)
    true, still = true_resistance(world), np.zeros(1)
    fleet.set_resistance(
        true.force_N(Ground(still + 1.0, still, still + 1.0)), true.swing_N
    )
    ramp = np.arange(50) / 50
    rates = np.concatenate([ramp, np.ones(950), ramp[::-1], np.zeros(50)])
    for now, following in zip(rates, rates[1:], strict=False):
        fleet.drive(still, still + now, still + following, 5)
        x, y, theta, v, omega = fleet.state()[0]
    assert theta == pytest.approx(rates.sum() * TICK_S, rel=0.005)
    assert np.hypot(x, y) < 0.01
    lost_J = model.turning_coefficient * model.mass_kg * 9.81 * model.track_m * theta
    assert fleet.work.work_J().sum() == pytest.approx(lost_J, rel=0.01)
    assert abs(v) < 1e-3
    assert abs(omega) < 1e-2


def test_yaw_inertia_is_what_a_moment_shows(scene: Scene, model: RobotModel) -> None:
    """Without friction, a ramp of omega is followed by feed-forward alone."""
    world, data, fleet = started(scene)
    fleet.set_resistance(np.zeros(1), np.zeros(1))
    fleet.drive(np.zeros(1), np.zeros(1), np.zeros(1), 50)
    fleet.drive(np.zeros(1), np.zeros(1), np.full(1, 0.04), 5)
    moment_Nm = np.diff(data.ctrl)[0] * model.track_m / 2
    turning_Nm = model.energy_model.turning_force_N * model.track_m
    gained = fleet.state()[0, 4] / TICK_S
    inertia_kg_m2 = (moment_Nm - turning_Nm) / 2.0
    assert moment_Nm / inertia_kg_m2 == pytest.approx(gained, rel=0.02)
