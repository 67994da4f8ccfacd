"""Slopes in MuJoCo: gravity does what the energy model says, and robots hold still."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from mrmg.energy.metering import measured_energy_parts, plan_ledger
from mrmg.scene.types import Scene
from mrmg.simulation.ground_shape import FOUNDATION_M, draped_mark, height_span
from mrmg.simulation.log import ExecutionLog
from mrmg.simulation.scenery import FLOOR
from mrmg.simulation.simulation import simulate
from mrmg.simulation.slopes import SlopesUnderfoot
from mrmg.simulation.world_model import build_world
from mrmg.world.elevation import ground_poses, height_at

HILLS = {"hills": [{"center": [0, 0], "height": 2.0, "radius": 20}]}


def ramp(grade: float) -> dict[str, Any]:
    """Rising evenly from west to east over 120 m, 0 in the middle."""
    return {"grid": [[-60.0 * grade, 60.0 * grade]] * 2}


def driven(
    driving: SimpleNamespace, scene: Scene, control: np.ndarray
) -> tuple[ExecutionLog, float, float]:
    """Return the log, and the energy planned and measured of the first robot [J]."""
    plan = driving.plan_of(scene, [control] * len(scene.robots))
    log = simulate(scene, plan)
    assert log.completed
    measured = measured_energy_parts(scene.robots[0], log.work_J[0], log.time_s).sum()
    return log, driving.planned_J(scene, plan, "r1"), float(measured)


@pytest.mark.parametrize("model", ["car", "diffdrive", "hauler"])
def test_climbing_takes_the_work_of_the_height(
    driving: SimpleNamespace, model: str
) -> None:
    """Up 8 %: rolling by the way on the map, and m g h."""
    scene = driving.open_ground(
        [(-8.0, 0.0, 0.0)], models=(model,), elevation=ramp(0.08)
    )
    log, planned_J, measured_J = driven(driving, scene, driving.straight(12.0, 1.0))
    way_m = log.state[0, -1, 0] - log.state[0, 0, 0]
    robot = scene.robots[0].model
    force_N = robot.energy_model.rolling_force_N + 0.08 * robot.energy_model.weight_N
    assert log.work_J.sum() == pytest.approx(force_N * way_m, rel=0.015)
    assert measured_J == pytest.approx(planned_J, rel=0.015)
    off_m = np.hypot(*(log.state[0] - log.reference[0])[:, :2].T)
    assert off_m.max() < 0.05


@pytest.mark.parametrize("regeneration", [0.0, 0.5])
def test_rolling_down_feeds_back_what_braking_takes(
    driving: SimpleNamespace, regeneration: float
) -> None:
    """Down 12 %, twice what rolling takes, after speeding up and before stopping."""
    scene = driving.open_ground([(-8.0, 0.0, np.pi)], elevation=ramp(0.12))
    robot = scene.robots[0]
    model = replace(robot.model, regeneration_efficiency=regeneration)
    scene = replace(scene, robots=(replace(robot, model=model),))
    log, planned_J, measured_J = driven(driving, scene, driving.straight(14.0, 1.5))
    way_m = log.state[0, 0, 0] - log.state[0, -1, 0]
    energy = model.energy_model
    surplus_N = 0.12 * energy.weight_N - energy.rolling_force_N
    assert log.work_J.sum() == pytest.approx(-surplus_N * way_m, rel=0.03)
    # What speeding up takes is a few joules; all else is braking.
    scale_J = surplus_N * way_m
    assert measured_J == pytest.approx(planned_J, abs=0.03 * scale_J)
    if regeneration:
        assert measured_J < -0.4 * scale_J


def test_over_a_hill_and_back_to_rest(driving: SimpleNamespace) -> None:
    """Metered and measured agree with planned where the drive pulls and coasts."""
    scene = driving.open_ground([(-26.0, 3.0, 0.0)], elevation=HILLS)
    plan = driving.plan_of(scene, [driving.straight(30.0, 1.7)])
    log = simulate(scene, plan)
    planned_J = driving.planned_J(scene, plan, "r1")
    motion = replace(
        plan.trajectories[0], state=log.state[0], dt_s=log.control_period_s
    )
    metered_J = plan_ledger(scene, [motion], ()).total_J()
    measured_J = measured_energy_parts(scene.robots[0], log.work_J[0], log.time_s).sum()
    assert metered_J == pytest.approx(planned_J, rel=0.01)
    assert measured_J == pytest.approx(planned_J, rel=0.02)
    assert log.contacts == ()


def test_a_robot_stands_still_on_a_slope_at_no_cost(driving: SimpleNamespace) -> None:
    """Across, up and down 15 %."""
    poses = [(-20.0, 0.0, 0.0), (0.0, 0.0, np.pi), (20.0, 0.0, 1.2)]
    scene = driving.open_ground(poses, elevation=ramp(0.15))
    log, _, measured_J = driven(driving, scene, np.zeros((60, 2)))
    moved_m = np.hypot(*(log.state[:, -1] - log.state[:, 0])[:, :2].T)
    assert moved_m.max() < 0.02
    assert abs(measured_J) < 5.0


def test_equal_runs_on_slopes_give_equal_logs(driving: SimpleNamespace) -> None:
    scene = driving.open_ground([(-8.0, 0.0, 0.0)], elevation=HILLS)
    plan = driving.plan_of(scene, [driving.straight(5.0, 1.0)])
    first, second = (simulate(scene, plan) for _ in range(2))
    np.testing.assert_array_equal(first.qpos, second.qpos)
    np.testing.assert_array_equal(first.work_J, second.work_J)


# --- shapes ------------------------------------------------------------------------


def test_flat_scenes_keep_their_plane(driving: SimpleNamespace) -> None:
    world = build_world(driving.open_ground([(0.0, 0.0, 0.0)]))
    assert world.model.geom(FLOOR).type == mujoco.mjtGeom.mjGEOM_PLANE
    assert world.model.nhfield == 0


def test_the_floor_lies_as_high_as_the_ground(driving: SimpleNamespace) -> None:
    """Looked at by rays from above."""
    scene = driving.open_ground([(-40.0, 0.0, 0.0)], half_m=45.0, elevation=HILLS)
    world = build_world(scene)
    data = mujoco.MjData(world.model)
    mujoco.mj_forward(world.model, data)
    points = np.random.default_rng(1).uniform(-22.0, 22.0, (400, 2))
    below = np.zeros(1, np.int32)
    found = [
        20.0
        - mujoco.mj_ray(
            world.model,
            data,
            np.array([x, y, 20.0]),
            np.array([0.0, 0.0, -1.0]),
            None,
            1,
            -1,
            below,
        )
        for x, y in points
    ]
    error_m = np.array(found) - height_at(scene, points)
    assert np.abs(error_m).max() < 0.01
    assert abs(error_m.mean()) < 0.001


def test_robots_start_upright_on_the_ground(driving: SimpleNamespace) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.0)], elevation=HILLS)
    rng = np.random.default_rng(2)
    for _ in range(50):
        x, y = rng.uniform(-18.0, 18.0, 2)
        yaw = rng.uniform(-3.0, 3.0)
        (pose,) = ground_poses(scene, np.array([[x, y, yaw]]))
        position, orientation = pose[:3], pose[3:]
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, orientation)
        forward, left, up = axes.reshape(3, 3).T
        assert np.arctan2(forward[1], forward[0]) == pytest.approx(yaw)
        for axis in (forward, left):  # tangents of the ground
            ahead = np.array([position[:2] + 1e-4 * axis[:2]])
            rise = (height_at(scene, ahead)[0] - position[2]) / 1e-4
            assert rise == pytest.approx(axis[2], abs=2e-3)
        assert up[2] > 0.9
    flat = driving.open_ground([(0.0, 0.0, 0.0)])
    (pose,) = ground_poses(flat, np.array([[1.0, 2.0, 0.6]]))
    position, orientation = pose[:3], pose[3:]
    assert position.tolist() == [1.0, 2.0, 0.0]
    assert orientation == pytest.approx([np.cos(0.3), 0.0, 0.0, np.sin(0.3)])


def test_inclines_are_positive_uphill(driving: SimpleNamespace) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.0)] * 1, elevation=ramp(0.1))
    for heading, expected in ((0.0, 0.1), (np.pi, -0.1), (np.pi / 2, 0.0)):
        level, slope = SlopesUnderfoot(scene).under(
            np.array([[5.0, 1.0, heading, 0.0, 0.0]])
        )
        assert slope / level == pytest.approx(expected, abs=1e-12)
        assert level**2 + slope**2 == pytest.approx(1.0)


def test_obstacles_reach_from_below_the_ground_to_above_it(
    driving: SimpleNamespace,
) -> None:
    tower = {"id": "tower", "box": {"center": [8, 0], "size": [4, 4]}, "height": 1.5}
    scene = driving.open_ground([(-40.0, 0.0, 0.0)], elevation=HILLS, obstacles=[tower])
    world = build_world(scene)
    body = world.model.body("obstacle:tower")
    low, high = height_span(scene, scene.obstacles[0].shape)
    assert high - low > 0.4
    foot = body.pos[2]
    assert foot == pytest.approx(low - FOUNDATION_M)
    data = mujoco.MjData(world.model)
    mujoco.mj_forward(world.model, data)
    geom = world.model.geom("obstacle:tower").id
    mesh = int(world.model.geom_dataid[geom])
    start, count = world.model.mesh_vertadr[mesh], world.model.mesh_vertnum[mesh]
    corners = world.model.mesh_vert[start : start + count]
    turned = corners @ data.geom_xmat[geom].reshape(3, 3).T
    heights_m = turned[:, 2] + data.geom_xpos[geom, 2]
    assert heights_m.max() == pytest.approx(high + 1.5, abs=1e-4)
    assert heights_m.min() == pytest.approx(foot, abs=1e-4)


def test_marks_lie_on_the_ground(driving: SimpleNamespace) -> None:
    goals = [
        {"id": "a", "circle": {"center": [7, 3], "radius": 2}},
        {"id": "b", "polygon": [[-12, -4], [-8, -4], [-8, 0], [-12, 0]]},
    ]
    scene = driving.open_ground([(-40.0, 0.0, 0.0)], elevation=HILLS, goals=goals)
    for goal in scene.goals:
        corners, faces = draped_mark(scene, goal.region)
        above_m = corners[:, 2] - height_at(scene, corners[:, :2])
        assert np.abs(above_m) == pytest.approx(0.05)
        a, b, c = (corners[faces[:, k]] for k in range(3))
        upper = (above_m[faces] > 0.0).all(axis=1)
        (ux, uy, _), (vx, vy, _) = (b - a).T, (c - a).T
        area_m2 = 0.5 * (ux * vy - uy * vx)
        assert (area_m2[upper] > 0.0).all()
        assert area_m2[upper].sum() == pytest.approx(goal.region.shape.area)
        # Every edge belongs to two faces that run along it in opposite directions.
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        there = {tuple(edge) for edge in edges.tolist()}
        assert len(there) == len(edges)
        assert {edge[::-1] for edge in there} == there


@pytest.mark.parametrize("model", ["diffdrive", "husky"])
def test_a_differential_drive_crosses_a_slope_and_stands_on_it(
    driving: SimpleNamespace, model: str
) -> None:
    """Its mass ahead of the axle pulls it downhill: that neither turns nor costs."""
    across = {"grid": [[-10.2] * 2, [10.2] * 2]}  # 17 %
    scene = driving.open_ground([(-10.0, 0.0, 0.0)], models=[model], elevation=across)
    log, planned_J, measured_J = driven(
        driving, scene, driving.straight(14.0, 0.8, 0.4)
    )
    assert measured_J == pytest.approx(planned_J, rel=0.01)
    assert np.abs(log.state[0, :, 1]).max() < 0.02
    assert np.abs(log.state[0, :, 2]).max() < 0.02
