"""The two driven wheels of robots: where they are, and how fast they turn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.mujoco_import import mujoco
from mrmg.scene.types import Robot
from mrmg.simulation.chassis import part_ids


class DrivenWheels:
    """The driven wheels of K robots of one kind in a running simulation.

    Attributes:
        radius_m: of each robot's wheels, shape (K,).
        dof: addresses of their joints' velocities, left and right, shape (K, 2).
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        robots: Sequence[Robot],
        joints: tuple[str, str],
    ) -> None:
        """Find the joints, left and right.

        Raises:
            FileError: if a robot's MJCF lacks one.
        """
        self._data = data
        ids = part_ids(model, mujoco.mjtObj.mjOBJ_JOINT, robots, joints)
        self.dof = model.jnt_dofadr[ids]
        self.radius_m = np.array([robot.model.wheel_radius_m for robot in robots])

    def rate_rad_s(self) -> np.ndarray:
        """Return how fast each wheel turns, shape (K, 2)."""
        return np.asarray(self._data.qvel[self.dof])
