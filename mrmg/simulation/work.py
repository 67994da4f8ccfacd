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

import mujoco
import numpy as np

from mrmg.scene.driven_parts import CHASSIS, PARTS
from mrmg.scene.types import Robot
from mrmg.simulation.drives import is_metered, transmission

BALANCE_TERMS = ("steering", "kinetic", "potential", "joints", "contacts")
"""Columns of `WorkMeter.balance_J`: one more work, two gains, and two losses."""

_BATCH_STEPS = 100
"""Physics steps whose losses are summed at once: small arrays cost calls, not sums."""

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
        self._forces = _Buffer(_BATCH_STEPS, data.actuator_force)
        self._constraint = _Buffer(_BATCH_STEPS, data.qfrc_constraint)
        self._passive = _Buffer(_BATCH_STEPS, data.qfrc_passive)
        self._velocity = _Buffer(_BATCH_STEPS + 1, data.qvel)
        self._friction_N = np.zeros((_BATCH_STEPS, model.nv + model.ntendon))
        self._find_actuators(robots)
        self._tendon = _tendon_moment(model)
        roots = [model.body(f"{robot.id}/{CHASSIS}").rootid[0] for robot in robots]
        self._roots = np.array(roots)
        self._of_dof = model.body_rootid[model.dof_bodyid] == self._roots[:, None]
        self._used, self._begun = 0, 0
        self.restart()

    def restart(self) -> None:
        """Begin the balance anew, with the present state."""
        self._done_J = np.zeros(self._model.nout)  # by every actuator
        self._lost_J = np.zeros((2, len(self._roots)))  # in joints, in contacts
        self._stored_J = self._energy_J()
        self._used = self._begun = 0
        self._velocity.rows[0] = self._data.qvel

    def start(self, steps: int) -> None:
        """Prepare for `steps` physics steps under the present friction losses."""
        if self._used + steps > _BATCH_STEPS:
            self._sum_losses()
        self._begun = self._used
        rows = self._friction_N[self._used : self._used + steps]
        rows[:, : self._model.nv] = self._model.dof_frictionloss
        rows[:, self._model.nv :] = self._model.tendon_frictionloss

    def look(self) -> None:
        """Note what was done in the physics step that has just been made."""
        step = self._used
        self._forces.take(step)
        self._constraint.take(step)
        self._passive.take(step)
        self._used = step + 1
        self._velocity.take(step + 1)

    def work_J(self) -> np.ndarray:
        """Return driving (>= 0) and braking (<= 0) work since `start`, (R, 2).

        The motors of a robot's driven wheels share a bus, as in the energy model: in a
        turn the outer one uses what the inner one gains by braking. All other drives
        count by themselves.
        """
        rows = slice(self._begun, self._used)
        velocity = self._velocity.rows[self._begun : self._used + 1]
        speeds = np.dot(velocity, self._moment)
        ways = (0.5 * self._step_s) * (speeds[1:] + speeds[:-1])
        work_J = np.dot(self._forces.rows[rows] * ways, self._buses)
        both_J = np.empty((2, work_J.shape[1]))
        np.add.reduce(np.maximum(work_J, 0.0), out=both_J[0])
        np.add.reduce(np.minimum(work_J, 0.0), out=both_J[1])
        self._done_J += both_J[0]
        self._done_J += both_J[1]
        return np.asarray(np.dot(self._drives, both_J.T))

    def balance_J(self) -> np.ndarray:
        """Return the terms of the balance since `restart`, (R, len(BALANCE_TERMS))."""
        self._sum_losses()
        gained_J = self._energy_J() - self._stored_J
        steering_J = self._steers @ self._done_J
        return np.stack([steering_J, *gained_J, *self._lost_J], axis=1)

    def _sum_losses(self) -> None:
        """Add up the losses of the steps noted, and make room for others."""
        used, velocity = self._used, self._velocity.rows
        ways = 0.5 * self._step_s * (velocity[1 : used + 1] + velocity[:used])
        constraint_J = -(self._constraint.rows[:used] * ways).sum(axis=0)
        damped_J = -(self._passive.rows[:used] * ways).sum(axis=0)
        # Friction slides, or does no work: its force is the loss, against the way.
        all_ways = np.concatenate([ways, ways @ self._tendon.T], axis=1)
        rubbed_J = (self._friction_N[:used] * np.abs(all_ways)).sum(axis=0)
        nv = self._model.nv
        in_joints_J = rubbed_J[:nv] @ self._of_dof.T
        in_joints_J += rubbed_J[nv:] @ self._of_tendon()
        self._lost_J[0] += in_joints_J + damped_J @ self._of_dof.T
        self._lost_J[1] += constraint_J @ self._of_dof.T - in_joints_J
        velocity[0] = velocity[used]
        self._used = self._begun = 0

    def _of_tendon(self) -> np.ndarray:
        """Return which tendon is which robot's, shape (ntendon, R)."""
        return np.asarray((self._tendon != 0.0) @ self._of_dof.T)

    def _energy_J(self) -> np.ndarray:
        """Return kinetic and potential energy of each robot now, shape (2, R)."""
        model, data = self._model, mujoco.MjData(self._model)
        data.qpos[:], data.qvel[:] = self._data.qpos, self._data.qvel
        mujoco.mj_fwdPosition(model, data)
        momentum = np.zeros(model.nv)
        mujoco.mj_mulM(model, data, momentum, data.qvel)
        of_body = model.body_rootid == self._roots[:, None]
        lifted_J = -model.body_mass * (data.xipos @ model.opt.gravity)
        return np.stack(
            [self._of_dof @ (0.5 * momentum * data.qvel), of_body @ lifted_J]
        )

    def _find_actuators(self, robots: Sequence[Robot]) -> None:
        """Find what moves each actuator on a joint or fixed tendon, and whose it is."""
        model = self._model
        moment = transmission(model)
        place = {robot.id: index for index, robot in enumerate(robots)}
        shared: dict[str, int] = {}
        self._buses = np.zeros((model.nout, model.nout))
        self._drives = np.zeros((len(robots), model.nout))
        self._steers = np.zeros((len(robots), model.nout))
        for index in range(model.nactuator):
            own, _, part = model.actuator(index).name.partition("/")
            output = int(model.actuator_outadr[index])
            if own not in place or not is_metered(model, index):
                moment[output] = 0.0
                continue
            kind = self._steers if part in _STEERING else self._drives
            bus = output
            if part in _WHEEL_MOTORS:
                bus = shared.setdefault(own, output)
            self._buses[output, bus] = kind[place[own], bus] = 1.0
        self._moment = np.ascontiguousarray(moment.T)


class _Buffer:
    """Rows of one of MuJoCo's arrays, step by step."""

    __slots__ = ("_source", "rows")

    def __init__(self, rows: int, source: np.ndarray) -> None:
        self._source, self.rows = source, np.zeros((rows, len(source)))

    def take(self, row: int) -> None:
        self.rows[row] = self._source


def _tendon_moment(model: mujoco.MjModel) -> np.ndarray:
    """Return what joint velocities make of fixed tendons' velocities, (ntendon, nv)."""
    moment = np.zeros((model.ntendon, model.nv))
    for tendon in range(model.ntendon):
        first = model.tendon_adr[tendon]
        for wrap in range(first, first + model.tendon_num[tendon]):
            if model.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_JOINT:
                dof = model.jnt_dofadr[model.wrap_objid[wrap]]
                moment[tendon, dof] = model.wrap_prm[wrap]
    return moment
