"""Every robot of a mixed fleet gets, and gives, what is its own."""

from __future__ import annotations

from types import SimpleNamespace

import mujoco
import numpy as np

from mrmg.scene.types import Scene
from mrmg.simulation.fleet import Fleet
from mrmg.simulation.world_model import build_world


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
