"""Every chassis says what an MJCF lacks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from mrmg import shipped
from mrmg.errors import FileError, UsageError
from mrmg.scene.types import Scene
from mrmg.simulation.chassis import chassis_maker
from mrmg.simulation.fleet import Fleet
from mrmg.simulation.world_model import build_world


@pytest.fixture(scope="module", params=shipped.model_names())
def scene(request: pytest.FixtureRequest, driving: SimpleNamespace) -> Scene:
    return driving.open_ground([(0.0, 0.0, 0.0)], models=[request.param])


def test_a_kind_that_cannot_be_executed_is_named(scene: Scene) -> None:
    robot = scene.robots[0]
    boat = replace(robot, model=replace(robot.model, motion_model="boat"))
    with pytest.raises(UsageError, match="'r1'.*'boat'.*allowed: car, unicycle"):
        chassis_maker(boat)


@pytest.mark.parametrize(
    ("name", "part", "noun"),
    [
        ("car", "steer_fl", "joint"),
        ("car", "drive", "actuator"),
        ("diffdrive", "swing", "tendon"),
    ],
)
def test_a_missing_part_is_named(
    driving: SimpleNamespace, tmp_path: Path, name: str, part: str, noun: str
) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.0)], models=[name])
    robot = scene.robots[0]
    mjcf = tmp_path / "robot.xml"
    text = robot.model.mjcf.read_text()
    mjcf.write_text(text.replace(f'"{part}"', '"other"'))
    changed = replace(robot, model=replace(robot.model, mjcf=mjcf))
    world = build_world(replace(scene, robots=(changed,)))
    with pytest.raises(FileError, match=f"robot.xml.*\n.*has no {noun} '{part}'"):
        Fleet(world, mujoco.MjData(world.model))


def test_a_mixed_fleet_is_read_in_the_scenes_order(driving: SimpleNamespace) -> None:
    """Values of each robot are those it has when it is alone."""
    kinds = ["diffdrive", "car", "diffdrive", "hauler"]
    poses = [(0.0, 6.0 * index, 0.3 * index) for index in range(4)]
    force, w = np.array([60.0, 300.0, -40.0, 700.0]), np.array([0.5, 0.2, -0.3, -0.1])
    resistance, swing = np.array([20.0, 80.0, 30.0, 200.0]), np.array([9.0, 0, 9.0, 0])

    def driven(scene: Scene, own: np.ndarray) -> tuple[np.ndarray, ...]:
        world = build_world(scene)
        fleet = Fleet(world, mujoco.MjData(world.model))
        fleet.set_resistance(resistance[own], swing[own])
        still = np.zeros(len(own))
        for _ in range(20):
            fleet.drive(force[own], still, w[own], 5)
        return fleet.state(), fleet.axle_speed_m_s(), fleet.work.work_J()[-1]

    together = driven(driving.open_ground(poses, models=kinds), np.arange(4))
    for index, (kind, pose) in enumerate(zip(kinds, poses, strict=True)):
        alone = driven(driving.open_ground([pose], models=[kind]), np.array([index]))
        for whole, own in zip(together, alone, strict=True):
            np.testing.assert_allclose(whole[index], own[0], atol=1e-5)
