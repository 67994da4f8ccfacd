"""The MJCF of the car agrees with its YAML, and drives as the motion model says."""

from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from mrmg.execution.fleet import Fleet
from mrmg.execution.world_model import build_world
from mrmg.scene.types import Scene

STEERS = [0.05, 0.2, 0.35, 0.5]
SPEEDS = [0.5, 1.0, 2.0]


@pytest.fixture(scope="module")
def scene(driving: SimpleNamespace) -> Scene:
    """One car at the origin, looking along x."""
    return driving.open_ground([(0.0, 0.0, 0.0)])


@pytest.fixture(scope="module")
def mjcf(scene: Scene) -> mujoco.MjModel:
    """The compiled car, alone."""
    return mujoco.MjModel.from_xml_path(str(scene.robots[0].model.mjcf))


def test_masses_agree(scene: Scene, mjcf: mujoco.MjModel) -> None:
    model = scene.robots[0].model
    assert mjcf.body_mass.sum() == pytest.approx(model.mass_kg, rel=1e-9)


def test_axles_agree(scene: Scene, mjcf: mujoco.MjModel) -> None:
    model = scene.robots[0].model
    place = {name: mjcf.body(f"wheel_{name}").pos for name in ("fl", "fr", "rl", "rr")}
    for side, sign in (("l", 1.0), ("r", -1.0)):
        rear, front = place[f"r{side}"], place[f"f{side}"]
        half_track = sign * model.track_m / 2
        np.testing.assert_allclose(rear, [0, half_track, model.wheel_radius_m])
        np.testing.assert_allclose(
            front, [model.wheelbase_m, half_track, model.wheel_radius_m]
        )


def test_wheels_agree(scene: Scene, mjcf: mujoco.MjModel) -> None:
    model = scene.robots[0].model
    names = ("fl", "fr", "rl", "rr")
    assert len(names) == model.wheel_count
    for name in names:
        tyre = mjcf.geom(f"tyre_{name}")
        assert tyre.type == mujoco.mjtGeom.mjGEOM_SPHERE
        assert tyre.size[0] == pytest.approx(model.wheel_radius_m)
        assert tyre.friction[0] == pytest.approx(model.friction_coefficient)
        spin = mjcf.joint(f"spin_{name}")
        own = mjcf.body(f"wheel_{name}").inertia[1]
        armature = mjcf.dof_armature[spin.dofadr[0]]
        assert own + armature == pytest.approx(model.wheel_inertia_kg_m2)


def test_the_tendon_measures_the_way_rolled(scene: Scene, mjcf: mujoco.MjModel) -> None:
    half_radius = scene.robots[0].model.wheel_radius_m / 2
    np.testing.assert_allclose(mjcf.wrap_prm, [half_radius, half_radius])


def test_hull_is_the_footprint(scene: Scene, mjcf: mujoco.MjModel) -> None:
    model = scene.robots[0].model
    hull = mjcf.geom("hull")
    low, high = hull.pos - hull.size, hull.pos + hull.size
    np.testing.assert_allclose(low[:2], model.footprint_m.min(axis=0))
    np.testing.assert_allclose(high[:2], model.footprint_m.max(axis=0))
    assert low[2] == pytest.approx(0.0)
    assert high[2] == pytest.approx(model.height_m)


def test_drawn_body_stays_inside_the_footprint(
    scene: Scene, mjcf: mujoco.MjModel
) -> None:
    """What is seen is what collides: no drawn part of the body sticks out."""
    data = mujoco.MjData(mjcf)
    mujoco.mj_forward(mjcf, data)
    outline = scene.robots[0].model.footprint_m
    for geom in np.flatnonzero(mjcf.geom_group == 1):
        if mjcf.geom_bodyid[geom] != mjcf.body("chassis").id:
            continue
        center, half = data.geom_xpos[geom][:2], mjcf.geom_size[geom][:2]
        assert (center - half >= outline.min(axis=0) - 1e-9).all()
        assert (center + half <= outline.max(axis=0) + 1e-9).all()


def test_rolling_resistance_of_plain_ground_agrees(
    scene: Scene, mjcf: mujoco.MjModel
) -> None:
    model = scene.robots[0].model
    dofs = [mjcf.joint(name).dofadr[0] for name in ("spin_rl", "spin_rr")]
    force = mjcf.dof_frictionloss[dofs].sum() / model.wheel_radius_m
    assert force == pytest.approx(model.energy_model.rolling_force_N, rel=1e-4)


def test_steering_reaches_the_limit_on_both_sides(
    scene: Scene, mjcf: mujoco.MjModel
) -> None:
    """The inner wheel turns more than psi; its joint and its servo must allow that."""
    model = scene.robots[0].model
    way = model.wheelbase_m * np.tan(model.limits.w_max)
    inner = np.arctan(way / (model.wheelbase_m - model.track_m / 2 * np.tan(0.6)))
    for name in ("steer_fl", "steer_fr"):
        low, high = mjcf.joint(name).range
        assert low <= -inner
        assert high >= inner
    np.testing.assert_array_less(inner, mjcf.actuator("steer_l").ctrlrange[1])


def test_weight_on_the_driven_axle_is_more_than_half(mjcf: mujoco.MjModel) -> None:
    """The drive control relies on it when it limits the force to the grip."""
    data = mujoco.MjData(mjcf)
    mujoco.mj_forward(mjcf, data)
    assert 0.0 < data.subtree_com[1][0] < 0.6


def circle(scene: Scene, speed: float, steer: float) -> tuple[float, float]:
    """Return measured yaw rate and speed on a steady circle at about `speed`."""
    world = build_world(scene)
    data = mujoco.MjData(world.model)
    fleet = Fleet(world, data)
    fleet.set_resistance(np.zeros(1))
    angle, gain = np.array([steer]), 800.0
    for _ in range(150):
        force = gain * (speed - fleet.axle_speed_m_s())
        fleet.drive(np.clip(force, -500, 500), angle, angle, 5)
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
    scene: Scene, speed: float, steer: float
) -> None:
    rate, driven = circle(scene, speed, steer)
    expected = driven * np.tan(steer) / scene.robots[0].model.wheelbase_m
    assert rate == pytest.approx(expected, rel=0.005)


def test_a_parked_car_does_not_drift(scene: Scene) -> None:
    world = build_world(scene)
    data = mujoco.MjData(world.model)
    fleet = Fleet(world, data)
    still, steer = np.zeros(1), np.array([0.4])
    fleet.drive(still, still, steer, 100)
    before = fleet.state()
    fleet.drive(still, steer, steer, 5000)
    np.testing.assert_allclose(fleet.state()[:, :3], before[:, :3], atol=1e-4)


def test_steering_follows_a_ramp_without_lag(scene: Scene) -> None:
    world = build_world(scene)
    data = mujoco.MjData(world.model)
    fleet = Fleet(world, data)
    still = np.zeros(1)
    for tick in range(25):
        fleet.drive(still, still + 0.02 * tick, still + 0.02 * (tick + 1), 5)
    assert fleet.state()[0, 4] == pytest.approx(0.5, abs=2e-3)
