"""The work of the drives of a fleet, and what becomes of it, by MuJoCo's own forces.

The work of a generalised force f over a physics step of length h is that over the mean
of the velocities v before and after the step (midpoint rule),

    W = h f (v_before + v_after) / 2,

which is what the integrator adds to the kinetic energy. For an actuator f is its force
and v = J qvel its velocity, whatever its gear, gain, ranges and activation are. The
balance of a robot sets the work of its actuators against what became of it:

    W_drives + W_steering = change of kinetic energy + change of potential energy
                            + joint friction and damping + contact dissipation.

Every term comes from other quantities: actuator forces, mass matrix, heights, friction
losses, constraint forces. An actuator that is not metered, or a force that is no
contact and no friction, leaves a residual.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csc_array

from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import CHASSIS, PARTS
from mrmg.scene.loading.force_drive import is_metered, tendon_moment, transmission
from mrmg.scene.types import Robot

BALANCE_TERMS = ("steering", "kinetic", "potential", "joints", "contacts")
"""Columns of `WorkMeter.balance_J`: one more work, two gains, and two losses."""

_BATCH_STEPS = 50
"""Physics steps that are summed at once: small arrays cost calls, not sums."""

_DENSE_SIZE = 8192
"""Entries of a matrix up to which a dense product is quicker than a sparse one."""

_STEERING = [name for parts in PARTS.values() for name in parts.servos]
_WHEEL_MOTORS = [name for parts in PARTS.values() for name in parts.motors]


class WorkMeter:
    """Meters the work of all drives of a fleet at every physics step, and its balance.

    Drives are all actuators on joints and fixed tendons but the steering servos.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[Robot]
    ) -> None:
        """Find the actuators of `robots`."""
        self._model, self._data = model, data
        self._step_s = model.opt.timestep
        sources = (data.actuator_force, data.qfrc_constraint, data.qfrc_passive)
        self._noted = [(np.zeros((_BATCH_STEPS, len(of))), of) for of in sources]
        self._velocity = np.zeros((_BATCH_STEPS + 1, model.nv))
        self._friction_N = np.zeros((_BATCH_STEPS, model.nv + model.ntendon))
        self._own_J: list[np.ndarray] = []
        self._begun: list[int] = []
        roots = [model.body(f"{robot.id}/{CHASSIS}").rootid[0] for robot in robots]
        self._roots = np.array(roots)[:, None]
        own = (model.body_rootid[model.dof_bodyid] == self._roots).astype(float)
        tendon = tendon_moment(model)
        self._by_robot, self._tendons = _row_sums(own), _row_sums(tendon)
        self._rubbed_by_robot = _row_sums(
            np.concatenate([own, (own @ np.abs(tendon.T) > 0.0).astype(float)], axis=1)
        )
        self._find_actuators(robots)
        self.restart()

    def restart(self) -> None:
        """Begin the balance anew, with the present state."""
        self._own_J.clear()
        self._steered_J = np.zeros(len(self._roots))
        self._lost_J = np.zeros((2, len(self._roots)))  # in joints, in contacts
        self._stored_J = self._energy_J()
        self._used, self._begun = 0, []
        self._velocity[0] = self._data.qvel

    def start(self, steps: int) -> None:
        """Begin a tick of at most 50 physics steps, under the present friction."""
        if self._used + steps > _BATCH_STEPS:
            self._sum()
        row, number = self._friction_N[len(self._begun)], self._model.nv
        row[:number] = self._model.dof_frictionloss
        row[number:] = self._model.tendon_frictionloss
        self._begun.append(self._used)

    def look(self) -> None:
        """Note what was done in the physics step that has just been made."""
        step = self._used
        for rows, source in self._noted:
            rows[step] = source
        self._used = step + 1
        self._velocity[step + 1] = self._data.qvel

    def work_J(self) -> np.ndarray:
        """Return driving (>= 0) and braking (<= 0) work of each tick, (n, R, 2).

        The motors of a robot's driven wheels share a bus, as in the energy model: in a
        turn the outer one uses what the inner one gains by braking. All other drives
        count by themselves.
        """
        # What is noted is not summed up: asking changes no bit of the balance.
        return np.concatenate([*self._own_J, self._by_tick(self._noted_work_J())])

    def balance_J(self) -> np.ndarray:
        """Return the terms of the balance since `restart`, (R, len(BALANCE_TERMS))."""
        self._sum()
        gained_J = self._energy_J() - self._stored_J
        return np.stack([self._steered_J, *gained_J, *self._lost_J], axis=1)

    def _sum(self) -> None:
        """Add up the work and the losses of the ticks noted, and make room."""
        used, begun, velocity = self._used, self._begun, self._velocity
        if not begun:
            return
        ways, work_J = self._ways(), self._noted_work_J()
        self._own_J.append(self._by_tick(work_J))
        self._steered_J += (work_J @ self._steers).sum(axis=0)
        # Friction slides, or does no work: its force is the loss, against the way.
        all_ways = np.concatenate([ways, ways @ self._tendons], axis=1)
        slid = np.add.reduceat(np.abs(all_ways), begun, axis=0)
        rubbed_J = (self._friction_N[: len(begun)] * slid).sum(axis=0)
        taken_J = [-(rows[:used] * ways).sum(axis=0) for rows, _ in self._noted[1:]]
        constrained_J, damped_J = np.array(taken_J) @ self._by_robot
        (in_joints_J,) = rubbed_J[None] @ self._rubbed_by_robot
        self._lost_J += damped_J + in_joints_J, constrained_J - in_joints_J
        velocity[0] = velocity[used]
        self._used, self._begun = 0, []

    def _ways(self) -> np.ndarray:
        """Return the way of each joint in the steps noted, (steps, nv)."""
        velocity = self._velocity[: self._used + 1]
        return np.asarray(0.5 * self._step_s * (velocity[1:] + velocity[:-1]))

    def _noted_work_J(self) -> np.ndarray:
        """Return the work on each bus in the steps noted, (steps, buses)."""
        forces = self._noted[0][0][: self._used].take(self._outputs, axis=1)
        return np.asarray(forces * (self._ways() @ self._speeds) @ self._buses)

    def _by_tick(self, work_J: np.ndarray) -> np.ndarray:
        """Return driving and braking work of the drives in each tick, (n, R, 2)."""
        if not self._begun:
            return np.empty((0, len(self._roots), 2))
        both_J = [
            np.add.reduceat(part(work_J, 0.0), self._begun, axis=0) @ self._drives
            for part in (np.maximum, np.minimum)
        ]
        return np.stack(both_J, axis=2)

    def _energy_J(self) -> np.ndarray:
        """Return kinetic and potential energy of each robot now, shape (2, R)."""
        model, data = self._model, mujoco.MjData(self._model)
        data.qpos[:], data.qvel[:] = self._data.qpos, self._data.qvel
        mujoco.mj_fwdPosition(model, data)
        momentum = np.zeros(model.nv)
        mujoco.mj_mulM(model, data, momentum, data.qvel)
        (kinetic_J,) = 0.5 * momentum[None] * data.qvel @ self._by_robot
        own = model.body_rootid == self._roots
        lifted_J = -model.body_mass * (data.xipos @ model.opt.gravity)
        return np.stack([kinetic_J, (own * lifted_J).sum(axis=1)])

    def _find_actuators(self, robots: Sequence[Robot]) -> None:
        """Find the actuators on joints and fixed tendons: drives and steering servos.

        The motors of a robot's driven wheels share a bus, any other has one of its own.
        """
        model, place = self._model, {robot.id: at for at, robot in enumerate(robots)}
        outputs, buses = [], []
        owners: list[int] = []  # of each bus
        steering: list[bool] = []  # whether its work is that of a servo
        shared: dict[str, int] = {}
        for index in range(model.nactuator):
            own, _, part = model.actuator(index).name.partition("/")
            if own not in place or not is_metered(model, index):
                continue
            bus = len(owners)
            if part in _WHEEL_MOTORS:
                bus = shared.setdefault(own, bus)
            outputs.append(int(model.actuator_outadr[index]))
            buses.append(bus)
            if bus == len(owners):
                owners.append(place[own])
                steering.append(part in _STEERING)
        self._outputs = np.array(outputs, dtype=int)
        steers = np.array(steering, dtype=bool)
        by_robot = np.arange(len(robots))[:, None] == owners
        self._speeds = _row_sums(transmission(model)[self._outputs])
        self._buses = _row_sums(np.arange(len(owners))[:, None] == buses)
        self._drives = _row_sums(by_robot & ~steers)
        self._steers = _row_sums(by_robot & steers)


def _row_sums(matrix: np.ndarray) -> np.ndarray | csc_array:
    """Return the matrix of the sums of columns whose weights are the rows of `matrix`.

    Values of shape (n, columns) times it are the sums, shape (n, rows).
    """
    turned = np.ascontiguousarray(matrix.T, dtype=float)
    return turned if turned.size <= _DENSE_SIZE else csc_array(turned)
