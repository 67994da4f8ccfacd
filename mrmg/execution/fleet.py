"""The cars inside the simulation: reading their states, steering and driving them.

All robots are handled as arrays in the scene's order. A car's MJCF names its parts:
joints `root`, `steer_fl`, `steer_fr`, `spin_rl`, `spin_rr`; actuators `steer_l`,
`steer_r`, `drive`; geom `hull`; body `chassis`.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mrmg.errors import UsageError
from mrmg.execution.world_model import MujocoWorld


class Fleet:
    """All cars of a running simulation.

    Attributes:
        force_N: drive force last commanded, shape (R,).
    """

    def __init__(self, world: MujocoWorld, data: mujoco.MjData) -> None:
        """Find the parts of every robot of `world`.

        Raises:
            UsageError: if a robot is of a kind that cannot be executed.
        """
        robots = world.scene.robots
        for robot in robots:
            if robot.model.motion_model != "car":
                raise UsageError(
                    f"robot '{robot.id}': motion model '{robot.model.motion_model}' "
                    "cannot be executed; allowed: car"
                )
        model = world.model
        self._model, self._data = model, data
        self._wheelbase_m = np.array([robot.model.wheelbase_m for robot in robots])
        self._half_track_m = np.array([robot.model.track_m for robot in robots]) / 2
        self._radius_m = np.array([robot.model.wheel_radius_m for robot in robots])
        names = [robot.id for robot in robots]

        def address(kind: np.ndarray, joint: str) -> np.ndarray:
            return np.array([kind[model.joint(f"{name}/{joint}").id] for name in names])

        root_q = address(model.jnt_qposadr, "root")
        root_v = address(model.jnt_dofadr, "root")
        self._xy = root_q[:, None] + np.arange(2)
        self._quaternion = root_q[:, None] + np.arange(3, 7)
        self._velocity = root_v[:, None] + np.arange(2)
        self._steer_q = np.stack(
            [address(model.jnt_qposadr, f"steer_{side}") for side in ("fl", "fr")], 1
        )
        rear = ("spin_rl", "spin_rr")
        self._spin_q = np.stack([address(model.jnt_qposadr, name) for name in rear], 1)
        self._spin_v = np.stack([address(model.jnt_dofadr, name) for name in rear], 1)
        self._steer_ctrl = np.array(
            [
                [model.actuator(f"{name}/steer_{side}").id for side in ("l", "r")]
                for name in names
            ]
        )
        self._drive_ctrl = np.array([model.actuator(f"{n}/drive").id for n in names])
        # A servo with stiffness kp and damping kv follows a ramp kv / kp late.
        servo = self._steer_ctrl[:, 0]
        self._servo_lag_s = (
            model.actuator_biasprm[servo, 2] / model.actuator_biasprm[servo, 1]
        )
        self._yaw = np.array([robot.pose[2] for robot in robots])
        self.force_N = np.zeros(len(robots))

    def state(self) -> np.ndarray:
        """Return the true (x, y, theta, v, psi), theta unwrapped, shape (R, 5)."""
        qpos, qvel = self._data.qpos, self._data.qvel
        w, x, y, z = qpos[self._quaternion].T
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        self._yaw = self._yaw + (yaw - self._yaw + np.pi) % (2.0 * np.pi) - np.pi
        velocity = qvel[self._velocity]
        speed = velocity[:, 0] * np.cos(yaw) + velocity[:, 1] * np.sin(yaw)
        steer = np.arctan(self._tan_steer(np.tan(qpos[self._steer_q])))
        return np.column_stack([qpos[self._xy], self._yaw, speed, steer])

    def axle_speed_m_s(self) -> np.ndarray:
        """Return the speed the rear axle rolls at, shape (R,)."""
        return self._mean_over_axle(self._data.qvel[self._spin_v])

    def rolled_m(self) -> np.ndarray:
        """Return the way the rear axle has rolled, forward less back, shape (R,)."""
        return self._mean_over_axle(self._data.qpos[self._spin_q])

    def set_resistance(self, resistance_N: np.ndarray) -> None:
        """Let driving cost `resistance_N`, shape (R,): dry friction of the axle."""
        torque = 0.5 * self._radius_m * resistance_N
        self._model.dof_frictionloss[self._spin_v] = torque[:, None]

    def drive(
        self,
        force_N: np.ndarray,
        steer_from: np.ndarray,
        steer_to: np.ndarray,
        steps: int,
    ) -> None:
        """Run `steps` physics steps under held force and a ramp of steering angles.

        Args:
            force_N: traction force at the rear axle, shape (R,).
            steer_from: psi at the start [rad], shape (R,).
            steer_to: psi at the end [rad], shape (R,).
            steps: number of physics steps.
        """
        model, data = self._model, self._data
        step_s = model.opt.timestep
        rate = (steer_to - steer_from) / (steps * step_s)
        share = (np.arange(steps) / steps)[:, None]
        psi = steer_from + share * (steer_to - steer_from) + rate * self._servo_lag_s
        angles = self._wheel_angles(psi)
        self.force_N = force_N
        data.ctrl[self._drive_ctrl] = force_N
        for angle in angles:
            data.ctrl[self._steer_ctrl] = angle
            mujoco.mj_step(model, data)

    def _mean_over_axle(self, wheels: np.ndarray) -> np.ndarray:
        """Return the axle's motion from that of its wheels, shape (R, 2) -> (R,)."""
        return np.asarray(0.5 * self._radius_m * (wheels[:, 0] + wheels[:, 1]))

    def _wheel_angles(self, steer: np.ndarray) -> np.ndarray:
        """Return left and right Ackermann angles, shape (n, R) -> (n, R, 2)."""
        way = self._wheelbase_m * np.tan(steer)
        swing = self._half_track_m / self._wheelbase_m * way
        left = np.arctan(way / (self._wheelbase_m - swing))
        right = np.arctan(way / (self._wheelbase_m + swing))
        return np.stack([left, right], axis=-1)

    def _tan_steer(self, tan_wheel: np.ndarray) -> np.ndarray:
        """Return tan psi from the tangents of both wheels' angles, (R, 2) -> (R,)."""
        ratio = self._half_track_m / self._wheelbase_m
        left = tan_wheel[:, 0] / (1.0 + ratio * tan_wheel[:, 0])
        right = tan_wheel[:, 1] / (1.0 - ratio * tan_wheel[:, 1])
        return np.asarray(0.5 * (left + right))
