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
from mrmg.simulation.chassis import part_ids
from mrmg.simulation.driven_wheels import DrivenWheels
from mrmg.simulation.drives import ForceDrives


class AckermannChassis:
    """All cars of a running simulation; a `Chassis`."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[Robot]
    ) -> None:
        """Find the parts of `robots`.

        Raises:
            FileError: if an MJCF lacks one.
        """
        self._model, self._data, parts = model, data, PARTS["car"]
        self._step_s = model.opt.timestep
        models = [robot.model for robot in robots]
        # What tan psi loses, by tan psi itself, to the left wheel's and to the right's.
        half_track = np.array([item.track_m / item.wheelbase_m / 2 for item in models])
        self._swing = half_track[:, None] * np.array([1.0, -1.0])
        self._wheels = DrivenWheels(model, data, robots, parts.spin)
        joint, actuator = mujoco.mjtObj.mjOBJ_JOINT, mujoco.mjtObj.mjOBJ_ACTUATOR
        steer = part_ids(model, joint, robots, parts.steer)
        self._steer_q = model.jnt_qposadr[steer]
        servos = part_ids(model, actuator, robots, parts.servos)
        self._steer_ctrl = model.actuator_ctrladr[servos].ravel()
        self._control, self._share = data.ctrl, np.empty((0, 1))
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

    def axle_speed_m_s(self) -> np.ndarray:
        """Return the speed the rear axle rolls at, shape (K,)."""
        return self._mean_over_axle(self._wheels.rate_rad_s())

    def set_resistance(
        self,
        resistance_N: np.ndarray,
        swing_N: np.ndarray,
        believed_swing_N: np.ndarray | None = None,
    ) -> None:
        """Set the dry friction of the rear axle, shape (K,); its differential is free.

        Args:
            resistance_N: against the way of its middle.
            swing_N: zero.
            believed_swing_N: zero.
        """
        torque = 0.5 * self._wheels.radius_m * resistance_N
        self._model.dof_frictionloss[self._wheels.dof] = torque[:, None]

    def command(
        self, force_N: np.ndarray, w_from: np.ndarray, w_to: np.ndarray, steps: int
    ) -> None:
        """Hold the traction force; ramp psi so that the servos are on it in time."""
        lag = self._servo_lag_s / (steps * self._step_s)
        if len(self._share) != steps:
            self._share = (np.arange(steps) / steps)[:, None]
        share = self._share + lag
        tan_steer = np.tan(w_from + share * (w_to - w_from))[:, :, None]
        angles = np.arctan(tan_steer / (1.0 - self._swing * tan_steer))
        self._angles = angles.reshape(steps, -1)
        self._drives.command(force_N[self._driven] / self._drive_count)

    def apply(self, step: int) -> None:
        """Give the servos the angles of physics step `step`."""
        self._control.put(self._steer_ctrl, self._angles[step])

    def _find_drives(self, robots: Sequence[Robot]) -> None:
        """Find `drive`, and what shares its work, of every robot."""
        kind = mujoco.mjtObj.mjOBJ_ACTUATOR
        (motor,) = PARTS["car"].motors
        main = part_ids(self._model, kind, robots, (motor,))[:, 0]
        names = [
            self._model.actuator(index).name for index in range(self._model.nactuator)
        ]
        ids, owners = [], []
        for place, (robot, own) in enumerate(zip(robots, main.tolist(), strict=True)):
            start = f"{robot.id}/{motor}_"
            others = [at for at, name in enumerate(names) if name.startswith(start)]
            ids += [own, *others]
            owners += [place] * (1 + len(others))
        self._driven = np.array(owners)
        self._drive_count = np.bincount(self._driven)[self._driven]
        self._drives = ForceDrives(
            self._model,
            self._data,
            [robots[place] for place in owners],
            np.array(ids),
        )

    def _mean_over_axle(self, wheels: np.ndarray) -> np.ndarray:
        """Return the axle's motion from that of its wheels, shape (K, 2) -> (K,)."""
        radius_m = self._wheels.radius_m
        return np.asarray(0.5 * radius_m * (wheels[:, 0] + wheels[:, 1]))
