"""Making a compiled world differ from the models of its robots."""

from __future__ import annotations

import numpy as np

from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import ROOT
from mrmg.simulation.disturbance import Disturbance
from mrmg.simulation.world_model import MujocoWorld
from mrmg.world.elevation import ground_poses


def disturb_world(world: MujocoWorld, disturbance: Disturbance) -> None:
    """Change masses and grip of every robot in `world.model`, in place."""
    model = world.model
    for chassis, item in zip(world.chassis, disturbance.robots, strict=True):
        bodies = np.flatnonzero(model.body_rootid == model.body_rootid[chassis])
        model.body_mass[bodies] *= 1.0 + item.mass
        model.body_inertia[bodies] *= 1.0 + item.mass
        geoms = np.isin(model.geom_bodyid, bodies)
        model.geom_friction[geoms, 0] *= 1.0 + item.friction
    mujoco.mj_setConst(model, mujoco.MjData(model))


def move_starts(
    world: MujocoWorld, data: mujoco.MjData, disturbance: Disturbance
) -> None:
    """Shift and turn every robot from where the scene has it start, in place."""
    for robot, item in zip(world.scene.robots, disturbance.robots, strict=True):
        if not (item.start_x_m or item.start_y_m or item.start_heading_rad):
            continue
        root = world.model.joint(f"{robot.id}/{ROOT}")
        moved = (item.start_x_m, item.start_y_m, item.start_heading_rad)
        pose = np.add(robot.pose, moved)[None]
        data.qpos[int(root.qposadr[0]) :][:7] = ground_poses(world.scene, pose)[0]
