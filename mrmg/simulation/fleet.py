"""The robots inside the simulation: reading their states, steering and driving them.

All robots are handled as arrays in the scene's order; what differs between their kinds
is left to a chassis for each motion model. What an MJCF must name stands in
`scene.driven_parts`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import ROOT
from mrmg.simulation.ackermann import AckermannChassis
from mrmg.simulation.chassis import part_ids
from mrmg.simulation.differential import DifferentialChassis
from mrmg.simulation.reference import speed_states
from mrmg.simulation.work import WorkMeter
from mrmg.simulation.world_model import MujocoWorld

Chassis = AckermannChassis | DifferentialChassis
"""The robots of one motion model."""

_CHASSIS: dict[str, type[Chassis]] = {
    "car": AckermannChassis,
    "unicycle": DifferentialChassis,
}
"""By motion model."""

_NUDGE_M_S = 1e-9
"""Speed that wakes a robot, and moves it by nothing that counts."""


class Fleet:
    """All robots of a running simulation.

    Attributes:
        work: meters the drives.
    """

    def __init__(self, world: MujocoWorld, data: mujoco.MjData) -> None:
        """Find the parts of every robot of `world`.

        Raises:
            FileError: if a drive of a robot cannot be commanded as a force.
        """
        model, robots = world.model, world.scene.robots
        self._model, self._data = model, data
        kinds = np.array([robot.model.motion_model for robot in robots])
        # Places in the scene of the robots of each motion model, and their chassis.
        self._groups: list[tuple[np.ndarray, Chassis]] = []
        for kind in dict.fromkeys(kinds.tolist()):
            own = np.flatnonzero(kinds == kind)
            chassis = _CHASSIS[kind](model, data, [robots[place] for place in own])
            self._groups.append((own, chassis))
        self.work = WorkMeter(model, data, robots)
        root = part_ids(model.joint, robots, (ROOT,))
        root_q, root_v = model.jnt_qposadr[root], model.jnt_dofadr[root]
        self._pose = root_q + np.arange(7)
        self._velocity = root_v + np.arange(2)
        self._tree = model.body_treeid[world.chassis]
        self._turns = speed_states(world.scene)[:, 4]
        self._yaw = [robot.pose[2] for robot in robots]

    def state(self) -> np.ndarray:
        """Return the true (x, y, theta, v, psi or omega), shape (R, 5).

        theta is unwrapped.
        """
        fifth = self._gather([chassis.fifth_state() for _, chassis in self._groups])
        pose = self._data.qpos[self._pose].tolist()
        velocity = self._data.qvel[self._velocity].tolist()
        states = []
        for index, (x, y, _, qw, qx, qy, qz) in enumerate(pose):
            yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
            v_x, v_y = velocity[index]
            speed = v_x * math.cos(yaw) + v_y * math.sin(yaw)
            self._yaw[index] += math.remainder(yaw - self._yaw[index], math.tau)
            states.append((x, y, self._yaw[index], speed, fifth[index]))
        return np.array(states)

    def axle_speed_m_s(self) -> np.ndarray:
        """Return the speed the driven axle rolls at, shape (R,)."""
        return self._gather([chassis.axle_speed_m_s() for _, chassis in self._groups])

    def set_resistance(self, resistance_N: np.ndarray, swing_N: np.ndarray) -> None:
        """Set the dry friction of the driven axles.

        Args:
            resistance_N: against the way of the axle's middle, shape (R,).
            swing_N: against the way its wheels roll differently, shape (R,); counts for
                differential drives.
        """
        for own, chassis in self._groups:
            chassis.set_resistance(resistance_N[own], swing_N[own])

    def drive(
        self,
        force_N: np.ndarray,
        w_from: np.ndarray,
        w_to: np.ndarray,
        steps: int,
        turning_multiplier: np.ndarray | float = 1.0,
        on_step: Callable[[], None] | None = None,
    ) -> None:
        """Run a tick of `steps` physics steps under held force and a ramp of steering.

        Args:
            force_N: traction force at the driven axle, shape (R,).
            w_from: psi [rad] or omega [rad/s] at the start, shape (R,).
            w_to: psi or omega at the end, shape (R,).
            steps: number of physics steps.
            turning_multiplier: of the terrain, as the drive control sees it, shape
                (R,).
            on_step: called after each physics step.
        """
        self._wake((force_N != 0.0) | (w_from != w_to) | (self._turns & (w_to != 0.0)))
        multiplier = np.broadcast_to(turning_multiplier, len(force_N))
        for own, chassis in self._groups:
            chassis.command(
                force_N[own], w_from[own], w_to[own], steps, multiplier[own]
            )
        self.work.start(steps)
        for step in range(steps):
            for _, chassis in self._groups:
                chassis.apply(step)
            mujoco.mj_step(self._model, self._data)
            self.work.look()
            if on_step is not None:
                on_step()

    def _wake(self, commanded: np.ndarray) -> None:
        """Wake those of the sleeping robots that are commanded to move, shape (R,).

        MuJoCo wakes what is touched or moves, and looks at no actuator of a sleeper
        (its manual: Sleeping actuators).
        """
        asleep = self._data.tree_asleep[self._tree] >= 0
        self._data.qvel[self._velocity[asleep & commanded, 0]] = _NUDGE_M_S

    def _gather(self, parts: list[np.ndarray]) -> np.ndarray:
        """Return the groups' values in the scene's order, shape (R,)."""
        whole = np.empty(len(self._yaw))
        for (own, _), part in zip(self._groups, parts, strict=True):
            whole[own] = part
        return whole
