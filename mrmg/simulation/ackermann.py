"""The chassis of a car: two steered wheels in front, an open differential behind.

The MJCF names its parts as `scene.driven_parts` has them: the joints of steered and
driven wheels, a position servo for each steered wheel, and the motor `drive` of wheels.
Further motors `drive_...` share the traction force equally with it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import PARTS
from mrmg.scene.types import Robot
from mrmg.simulation.chassis import Chassis, part_ids
from mrmg.simulation.drives import ForceDrives


class AckermannChassis(Chassis):
    """All cars of a running simulation."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[Robot]
    ) -> None:
        """Find the parts of `robots`.

        Raises:
            FileError: if a drive cannot be commanded as a force.
        """
        parts = PARTS["car"]
        super().__init__(model, data, robots, parts)
        self._step_s = model.opt.timestep
        models = [robot.model for robot in robots]
        # What tan psi loses, by tan psi itself, to the left wheel's and to the right's.
        half_track = np.array([item.track_m / item.wheelbase_m / 2 for item in models])
        self._swing = half_track[:, None] * np.array([1.0, -1.0])
        self._steer_q = model.jnt_qposadr[part_ids(model.joint, robots, parts.steer)]
        servos = part_ids(model.actuator, robots, parts.servos)
        self._steer_ctrl = model.actuator_ctrladr[servos].ravel()
        self._control = data.ctrl
        self._find_drives(robots)
        # A servo with stiffness kp and damping kv follows a ramp kv / kp late.
        servo = servos[:, 0]
        self._servo_lag_s = (
            model.actuator_biasprm[servo, 2] / model.actuator_biasprm[servo, 1]
        )

    def fifth_state(self) -> np.ndarray:
        """Return the true psi, shape (K,)."""
        tan_wheel = np.tan(self._data.qpos[self._steer_q])
        tan_steer = 0.5 * (tan_wheel / (1.0 + self._swing * tan_wheel)).sum(axis=1)
        return np.asarray(np.arctan(tan_steer))

    def set_resistance(self, resistance_N: np.ndarray, swing_N: np.ndarray) -> None:
        """Set the dry friction of the rear axle; its differential is free of any."""
        torque = 0.5 * self._radius_m * resistance_N
        self._model.dof_frictionloss[self._wheels_v] = torque[:, None]

    def command(
        self,
        force_N: np.ndarray,
        w_from: np.ndarray,
        w_to: np.ndarray,
        steps: int,
        turning_multiplier: np.ndarray,
    ) -> None:
        """Hold the traction force; ramp psi so that the servos are on it in time."""
        lag = self._servo_lag_s / (steps * self._step_s)
        share = (np.arange(steps) / steps)[:, None] + lag
        tan_steer = np.tan(w_from + share * (w_to - w_from))[:, :, None]
        angles = np.arctan(tan_steer / (1.0 - self._swing * tan_steer))
        self._angles = angles.reshape(steps, -1)
        self._drives.command(force_N[self._driven] / self._drive_count)

    def apply(self, step: int) -> None:
        """Give the servos the angles of physics step `step`."""
        self._control.put(self._steer_ctrl, self._angles[step])

    def _find_drives(self, robots: Sequence[Robot]) -> None:
        """Find `drive`, and what shares its work, of every robot."""
        model, (motor,) = self._model, PARTS["car"].motors
        names = [model.actuator(index).name for index in range(model.nactuator)]
        ids, owners = [], []
        for place, robot in enumerate(robots):
            own = f"{robot.id}/{motor}"
            others = [name for name in names if name.startswith(f"{own}_")]
            ids += [model.actuator(name).id for name in (own, *others)]
            owners += [place] * (1 + len(others))
        self._driven = np.array(owners)
        self._drive_count = np.bincount(self._driven)[self._driven]
        driven = [robots[place] for place in owners]
        self._drives = ForceDrives(model, self._data, driven, np.array(ids))
