"""The drives of robots in MuJoCo, commanded as forces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.errors import Fault, FileError
from mrmg.mujoco_import import mujoco
from mrmg.scene.loading.force_drive import drive_fault, transmission
from mrmg.scene.types import Robot


class ForceDrives:
    """Actuators commanded by the traction force they shall give."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        robots: Sequence[Robot],
        ids: np.ndarray,
    ) -> None:
        """Find out what each actuator makes of its control.

        Args:
            model: the compiled world.
            data: of the simulation.
            robots: whose drive each is, D of them.
            ids: the actuators, shape (D,).

        Raises:
            FileError: if one cannot be commanded as a force.
        """
        self._ctrl = model.actuator_ctrladr[ids]
        self._out = model.actuator_outadr[ids]
        moment = transmission(model)[self._out]
        for robot, index, row in zip(robots, ids.tolist(), moment, strict=True):
            fault = drive_fault(model, index, row)
            if fault:
                name = model.actuator(index).name.removeprefix(f"{robot.id}/")
                text = f"actuator '{name}' {fault}"
                raise FileError(str(robot.model.mjcf), [Fault(robot.model.name, text)])
        radius_m = np.array([robot.model.wheel_radius_m for robot in robots])
        self._traction = moment.sum(axis=1) / radius_m
        self._gain = model.actuator_gainprm[ids, 0]
        # Constant and damping terms of an affine bias, which the control makes up for.
        self._constant, self._damping = model.actuator_biasprm[ids][:, [0, 2]].T
        self._velocity, self._control = data.actuator_velocity, data.ctrl

    def command(self, force_N: np.ndarray) -> None:
        """Set the controls that give the traction forces `force_N`, shape (D,)."""
        damped = self._damping * self._velocity[self._out]
        force = force_N / self._traction - self._constant - damped
        self._control[self._ctrl] = force / self._gain
