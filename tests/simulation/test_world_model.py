"""The compiled world against the scene: shapely is the oracle of every touch."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
import shapely
from shapely import affinity
from shapely.geometry import Polygon, box

from mrmg.errors import FileError
from mrmg.scene.types import Scene
from mrmg.simulation.contacts import ContactWatch
from mrmg.simulation.world_model import MujocoWorld, build_world

HALF_M = 14.0
NEAR_M = 1e-4
"""Distance below which neither answer is wrong."""

OBSTACLES = [
    {
        "id": "frame",
        "polygon": [[-7, -7], [3, -7], [3, 3], [-7, 3]],
        "holes": [[[-5.5, -5.5], [1.5, -5.5], [1.5, 1.5], [-5.5, 1.5]]],
        "height": 1.0,
    },
    {
        "id": "ell",
        "polygon": [[5, 4], [11, 4], [11, 5], [6, 5], [6, 11], [5, 11]],
        "height": 0.3,
    },
    {"id": "pillar", "circle": {"center": [8, -8], "radius": 1.0}, "height": 2.0},
    {"id": "only1", "box": {"center": [-8, 9], "size": [4, 2], "yaw": 0.4}},
]
OBSTACLES[3]["blocks"] = ["r1"]


@pytest.fixture(scope="module")
def scene(driving: SimpleNamespace) -> Scene:
    """Two cars among a frame with a hole, a concave corner, a circle, a private box."""
    return driving.open_ground(
        [(10.0, 0.0, 0.5), (-10.0, 0.0, -2.0)],
        half_m=HALF_M,
        obstacles=OBSTACLES,
        goals=[
            {"id": "g1", "circle": {"center": [-2, -2], "radius": 0.7}},
            {"id": "g2", "polygon": [[9, 9], [11, 9], [11, 11]]},
        ],
        stations=[{"id": "s1", "circle": {"center": [0, 9], "radius": 1.0}}],
        terrain=[
            {"id": "t", "polygon": [[-14, 6], [0, 6], [0, 14], [-14, 14]],
             "multiplier": 3.0}
        ],
    )  # fmt: skip


@pytest.fixture(scope="module")
def world(scene: Scene) -> MujocoWorld:
    return build_world(scene)


def place(
    world: MujocoWorld, data: mujoco.MjData, index: int, pose: np.ndarray
) -> Polygon:
    """Put a robot at a pose and return its footprint there."""
    robot = world.scene.robots[index]
    at = world.model.joint(f"{robot.id}/root").qposadr[0]
    x, y, yaw = pose
    data.qpos[at : at + 7] = [x, y, 0, np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
    turned = affinity.rotate(
        Polygon(robot.model.footprint_m), yaw, origin=(0, 0), use_radians=True
    )
    return affinity.translate(turned, x, y)


def touches(world: MujocoWorld, data: mujoco.MjData) -> set[tuple[str, str]]:
    mujoco.mj_kinematics(world.model, data)
    mujoco.mj_collision(world.model, data)
    watch = ContactWatch(world)
    watch.look(data)
    return {(contact.robot, contact.other) for contact in watch.contacts}


def expected(
    scene: Scene, footprints: list[Polygon], slack_m: float
) -> set[tuple[str, str]]:
    """What shapely says: touches of footprints grown by `slack_m`."""
    grown = [footprint.buffer(slack_m) for footprint in footprints]
    found = set()
    for robot, footprint in zip(scene.robots, grown, strict=True):
        found |= {
            (robot.id, obstacle.id)
            for obstacle in scene.obstacles
            if obstacle.stops(robot.id) and footprint.intersects(obstacle.shape)
        }
        if not box(*scene.bounds).contains(footprint):
            found.add((robot.id, "bounds"))
    if grown[0].intersects(footprints[1]):
        found.add(("r1", "r2"))
    return found


def test_touches_are_those_of_the_footprints(world: MujocoWorld) -> None:
    """600 random pairs of poses; cases within 0.1 mm of a touch may go either way."""
    rng = np.random.default_rng(1)
    data = mujoco.MjData(world.model)
    hits = 0
    for _ in range(600):
        poses = rng.uniform([-13, -13, -np.pi], [13, 13, np.pi], (2, 3))
        if rng.random() < 0.3:
            near = poses[0, :2] + rng.uniform(-2.5, 2.5, 2)
            poses[1, :2] = np.clip(near, -13, 13)
        footprints = [place(world, data, i, pose) for i, pose in enumerate(poses)]
        found = touches(world, data)
        assert found >= expected(world.scene, footprints, -NEAR_M)
        assert found <= expected(world.scene, footprints, NEAR_M)
        hits += len(found)
    assert hits > 300


def test_inside_a_hole_is_free(world: MujocoWorld) -> None:
    data = mujoco.MjData(world.model)
    place(world, data, 0, np.array([-2.5, -2.0, 0.7]))
    place(world, data, 1, np.array([10.0, -3.0, 0.0]))
    assert touches(world, data) == set()


def test_blocks_lets_the_other_robots_through(world: MujocoWorld) -> None:
    data = mujoco.MjData(world.model)
    away = np.array([10.0, -3.0, 0.0])
    inside = np.array([-8.0, 9.0, 0.0])
    place(world, data, 0, inside)
    place(world, data, 1, away)
    assert touches(world, data) == {("r1", "only1")}
    place(world, data, 0, away)
    place(world, data, 1, inside)
    assert touches(world, data) == set()


def test_a_touch_is_noted_once_while_it_lasts(world: MujocoWorld) -> None:
    data = mujoco.MjData(world.model)
    place(world, data, 1, np.array([10.0, -3.0, 0.0]))
    watch = ContactWatch(world)
    for time_s, y in ((0.1, 9.0), (0.2, 9.1), (0.3, 5.5), (0.4, 9.0)):
        place(world, data, 0, np.array([-8.0, y, 0.0]))
        mujoco.mj_kinematics(world.model, data)
        mujoco.mj_collision(world.model, data)
        data.time = time_s
        watch.look(data)
    assert [contact.time_s for contact in watch.contacts] == [0.1, 0.4]


def test_robots_start_at_their_poses(world: MujocoWorld) -> None:
    data = mujoco.MjData(world.model)
    mujoco.mj_forward(world.model, data)
    for robot, body in zip(world.scene.robots, world.chassis, strict=True):
        x, y, yaw = robot.pose
        np.testing.assert_allclose(data.xpos[body], [x, y, 0.0], atol=1e-12)
        np.testing.assert_allclose(
            data.xmat[body].reshape(3, 3)[:2, 0], [np.cos(yaw), np.sin(yaw)], atol=1e-12
        )


def test_targets_are_drawn_where_they_are(world: MujocoWorld) -> None:
    model = world.model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert sorted(world.target_geom) == ["g1", "g2", "s1"]
    for target in world.scene.targets():
        geom = world.target_geom[target.id]
        center = target.region.shape.centroid.coords[0]
        np.testing.assert_allclose(data.geom_xpos[geom][:2], center, atol=0.01)
        assert model.geom_contype[geom] == model.geom_conaffinity[geom] == 0


def test_drawn_obstacles_have_the_volume_of_their_prisms(world: MujocoWorld) -> None:
    """Divergence theorem over the drawn triangles: closed, outward, right size."""
    model = world.model
    for obstacle in world.scene.obstacles:
        mesh = model.mesh(f"obstacle:{obstacle.id}")
        start, count = mesh.faceadr[0], mesh.facenum[0]
        vertices = model.mesh_vert[mesh.vertadr[0] :][: mesh.vertnum[0]]
        corner = vertices[model.mesh_face[start : start + count]].astype(float)
        volume = np.linalg.det(corner).sum() / 6
        expected_m3 = obstacle.shape.area * obstacle.height_m
        assert volume == pytest.approx(expected_m3, rel=1e-4)


def test_equal_scenes_give_equal_worlds(scene: Scene, world: MujocoWorld) -> None:
    assert build_world(scene).digest == world.digest


def test_another_obstacle_gives_another_world(
    driving: SimpleNamespace, world: MujocoWorld
) -> None:
    assert build_world(driving.open_ground([(0, 0, 0)])).digest != world.digest


def test_overlapping_and_touching_obstacles_compile(driving: SimpleNamespace) -> None:
    scene = driving.open_ground(
        [(0, 0, 0)],
        obstacles=[
            {"id": "a", "polygon": [[5, 5], [9, 5], [9, 9], [5, 9]]},
            {"id": "b", "polygon": [[7, 7], [11, 7], [11, 11], [7, 11]]},
            {"id": "c", "polygon": [[9, 5], [12, 5], [12, 7], [9, 7]]},
        ],
    )
    model = build_world(scene).model
    bodies = [model.body(body).name for body in model.geom_bodyid]
    assert sum(bodies.count(f"obstacle:{name}") for name in "abc") == 6


def test_a_broken_mjcf_is_named(driving: SimpleNamespace, tmp_path: Path) -> None:
    scene = driving.open_ground([(0, 0, 0)])
    path = tmp_path / "car.xml"
    path.write_text("<mujoco><worldbody><body></mujoco>")
    robot = scene.robots[0]
    broken = replace(robot, model=replace(robot.model, mjcf=path))
    with pytest.raises(FileError, match="no usable MJCF for model 'car'"):
        build_world(replace(scene, robots=(broken,)))


def test_shapes_of_all_pieces_are_inside_their_obstacle(world: MujocoWorld) -> None:
    """Hulls that MuJoCo makes of the pieces do not reach over the outline."""
    model = world.model
    for obstacle in world.scene.obstacles:
        outline = obstacle.shape.buffer(1e-5)
        body = model.body(f"obstacle:{obstacle.id}").id
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        for geom in np.flatnonzero((model.geom_bodyid == body) & model.geom_contype):
            mesh = model.mesh(model.geom_dataid[geom])
            local = model.mesh_vert[mesh.vertadr[0] :][: mesh.vertnum[0]]
            corners = (
                local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
            )
            assert shapely.MultiPoint(corners[:, :2]).convex_hull.within(outline)
