"""The MJCF of every shipped robot agrees with its YAML, and rests, rams and touches."""

from __future__ import annotations

from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
import shapely
from shapely import affinity
from shapely.geometry import Polygon

from mrmg import shipped
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.simulation.contacts import ContactWatch
from mrmg.simulation.fleet import Fleet
from mrmg.simulation.ground import Ground, believed_resistance, true_resistance
from mrmg.simulation.simulation import STEPS_PER_TICK
from mrmg.simulation.world_model import build_world

TICK_S = 0.02
ELL = [[4, -3], [9, -3], [9, -2], [5, -2], [5, 3], [4, 3]]
NEAR_M = 1e-4
"""Distance below which neither answer about a touch is wrong."""


@pytest.fixture(scope="module", params=shipped.model_names())
def scene(request: pytest.FixtureRequest, driving: SimpleNamespace) -> Scene:
    """One robot of a kind at the origin, looking along x."""
    return driving.open_ground([(0.0, 0.0, 0.0)], models=[request.param])


@pytest.fixture(scope="module")
def model(scene: Scene) -> RobotModel:
    return scene.robots[0].model


@pytest.fixture(scope="module")
def mjcf(model: RobotModel) -> mujoco.MjModel:
    """The compiled robot, alone."""
    return mujoco.MjModel.from_xml_path(str(model.mjcf))


def wheels_of(mjcf: mujoco.MjModel) -> list[str]:
    """The endings of the wheels' names."""
    names = [mjcf.body(index).name for index in range(mjcf.nbody)]
    return [name.removeprefix("wheel_") for name in names if name.startswith("wheel_")]


def test_masses_agree(model: RobotModel, mjcf: mujoco.MjModel) -> None:
    assert mjcf.body_mass.sum() == pytest.approx(model.mass_kg, rel=1e-9)


def test_wheels_agree(model: RobotModel, mjcf: mujoco.MjModel) -> None:
    names = wheels_of(mjcf)
    assert len(names) == model.wheel_count
    for name in names:
        tyre = mjcf.geom(f"tyre_{name}")
        assert tyre.type == mujoco.mjtGeom.mjGEOM_SPHERE
        assert tyre.size[0] == pytest.approx(model.wheel_radius_m)
        assert tyre.friction[0] == pytest.approx(model.friction_coefficient)
        body = mjcf.body(f"wheel_{name}")
        assert body.pos[2] == pytest.approx(model.wheel_radius_m)
        side = 1.0 if name.endswith("l") else -1.0
        assert body.pos[1] == pytest.approx(side * model.track_m / 2)
        spin = mjcf.joint(f"spin_{name}")
        armature = mjcf.dof_armature[spin.dofadr[0]]
        assert body.inertia[1] + armature == pytest.approx(model.wheel_inertia_kg_m2)


def test_axle_tendon_measures_the_way_rolled(
    model: RobotModel, mjcf: mujoco.MjModel
) -> None:
    axle = mjcf.tendon("axle")
    start = mjcf.tendon_adr[axle.id]
    half_radius = model.wheel_radius_m / 2
    np.testing.assert_allclose(mjcf.wrap_prm[start : start + 2], half_radius)


def test_hull_is_the_footprint(model: RobotModel, mjcf: mujoco.MjModel) -> None:
    hull = mjcf.geom("hull")
    low, high = hull.pos - hull.size, hull.pos + hull.size
    np.testing.assert_allclose(low[:2], model.footprint_m.min(axis=0))
    np.testing.assert_allclose(high[:2], model.footprint_m.max(axis=0))
    assert low[2] == pytest.approx(0.0)
    assert high[2] == pytest.approx(model.height_m)


def test_drawn_body_stays_inside_the_footprint(
    model: RobotModel, mjcf: mujoco.MjModel
) -> None:
    """What is seen is what collides: no drawn part of the body sticks out."""
    data = mujoco.MjData(mjcf)
    mujoco.mj_forward(mjcf, data)
    outline = model.footprint_m
    for geom in np.flatnonzero(mjcf.geom_group == 1):
        if mjcf.geom_bodyid[geom] != mjcf.body("chassis").id:
            continue
        center, half = data.geom_xpos[geom], mjcf.geom_size[geom]
        assert (center[:2] - half[:2] >= outline.min(axis=0) - 1e-9).all()
        assert (center[:2] + half[:2] <= outline.max(axis=0) + 1e-9).all()
        assert center[2] + half[2] <= model.height_m + 1e-9


def test_what_is_believed_of_the_ground_is_true(scene: Scene) -> None:
    believed, true = believed_resistance(scene), true_resistance(build_world(scene))
    np.testing.assert_allclose(believed.rolling_N, true.rolling_N, rtol=1e-9)
    np.testing.assert_allclose(believed.turning_N, true.turning_N, rtol=1e-9)
    np.testing.assert_allclose(believed.swing_N, true.swing_N, rtol=1e-9)


def test_weight_on_the_driven_axle_is_more_than_half(
    model: RobotModel, mjcf: mujoco.MjModel
) -> None:
    """The drive control relies on it when it limits the force to the grip."""
    data = mujoco.MjData(mjcf)
    mujoco.mj_forward(mjcf, data)
    center = data.subtree_com[mjcf.body("chassis").id]
    assert 0.0 < center[0] < model.wheelbase_m / 2
    assert center[1] == pytest.approx(0.0, abs=1e-12)


def test_does_not_drift_at_rest(scene: Scene, model: RobotModel) -> None:
    """A minute without any force; a car also with its wheels turned."""
    world = build_world(scene)
    data = mujoco.MjData(world.model)
    fleet = Fleet(world, data)
    true, still = true_resistance(world), np.zeros(1)
    fleet.set_resistance(
        true.force_N(Ground(still + 1.0, still, still + 1.0)), true.swing_N
    )
    turned = still + (0.4 if model.motion_model == "car" else 0.0)
    fleet.drive(still, still, turned, 50)
    before = fleet.state()
    for _ in range(300):
        fleet.drive(still, turned, turned, 50)
    np.testing.assert_allclose(fleet.state()[:, :3], before[:, :3], atol=1e-4)


def test_ramming_leaves_everybody_on_their_wheels(
    driving: SimpleNamespace, model: RobotModel
) -> None:
    """A minute of wild pushing among obstacles, walls and each other; no warning."""
    scene = driving.open_ground(
        [(-2.0, 0.0, 0.5), (2.0, -6.0, -2.0)],
        half_m=10.0,
        models=[model.name],
        obstacles=[
            {"id": "ell", "polygon": ELL, "height": 0.3},
            {"id": "pillar", "circle": {"center": [-6, 5], "radius": 1}, "height": 2.0},
        ],
    )
    world = build_world(scene)
    data = mujoco.MjData(world.model)
    fleet, watch = Fleet(world, data), ContactWatch(world)
    resistance = believed_resistance(scene)
    fleet.set_resistance(resistance.rolling_N, resistance.swing_N)
    rng = np.random.default_rng(8)
    energy = model.energy_model
    ground_N = energy.rolling_force_N + energy.turning_force_N
    grip_N = max(0.5 * model.mass_kg * 9.81, 2.0 * ground_N)
    w = np.zeros(2)
    for _ in range(300):
        force = rng.uniform(-0.7, 1.0, 2) * grip_N
        following = rng.uniform(-1.0, 1.0, 2) * model.limits.w_max
        for _ in range(10):
            fleet.drive(force, w, following, STEPS_PER_TICK)
            w = following
            watch.look(data)
            upright = data.xmat[world.chassis].reshape(2, 3, 3)[:, 2, 2]
            assert upright.min() > np.cos(np.radians(20))
            assert np.abs(data.xpos[world.chassis, 2]).max() < 0.15
    assert data.time == pytest.approx(60.0)
    assert np.isfinite(data.qpos).all()
    assert len(watch.contacts) > 20
    assert sum(warning.number for warning in data.warning) == 0


def test_touches_are_those_of_the_footprint(
    driving: SimpleNamespace, model: RobotModel
) -> None:
    """1500 random poses beside a concave corner; within 0.1 mm both answers hold."""
    scene = driving.open_ground(
        [(-7.0, 0.0, 0.0)],
        half_m=16.0,
        models=[model.name],
        obstacles=[{"id": "ell", "polygon": ELL, "height": 0.3}],
    )
    world = build_world(scene)
    data = mujoco.MjData(world.model)
    outline, obstacle = Polygon(model.footprint_m), Polygon(ELL)
    shapely.prepare(obstacle)
    rng, hits = np.random.default_rng(5), 0
    for _ in range(1500):
        x, y, yaw = rng.uniform([2, -5, -np.pi], [10, 5, np.pi])
        data.qpos[:7] = [x, y, 0, np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
        mujoco.mj_kinematics(world.model, data)
        mujoco.mj_collision(world.model, data)
        watch = ContactWatch(world)
        watch.look(data)
        turned = affinity.rotate(outline, yaw, origin=(0, 0), use_radians=True)
        footprint = affinity.translate(turned, x, y)
        touches = bool(watch.contacts)
        if footprint.boundary.distance(obstacle.boundary) > NEAR_M:
            assert touches == footprint.intersects(obstacle)
        hits += touches
    assert 300 < hits < 1400
