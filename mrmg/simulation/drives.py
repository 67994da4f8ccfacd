"""The drives of robots in MuJoCo: commanded as forces, metered by what they did.

The mechanical work of a physics step is that of the actuator's force f over the mean of
its velocities u = J qvel before and after the step (midpoint rule),

    W = f (u_before + u_after) / 2 dt,

which is what the integrator adds to the kinetic energy. It is right for any gear, gain,
control range, force range and activation, because f is what MuJoCo applied.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from mrmg.errors import Fault, FileError
from mrmg.scene.driven_parts import CHASSIS, PARTS
from mrmg.scene.types import Robot

_ON_JOINT = (
    int(mujoco.mjtTrn.mjTRN_JOINT),
    int(mujoco.mjtTrn.mjTRN_JOINTINPARENT),
)
_DYNAMICS = (
    int(mujoco.mjtDyn.mjDYN_NONE),
    int(mujoco.mjtDyn.mjDYN_FILTER),
    int(mujoco.mjtDyn.mjDYN_FILTEREXACT),
)
_BIASES = (int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE))
_STEERING = [name for parts in PARTS.values() for name in parts.servos]
_WHEEL_MOTORS = [name for parts in PARTS.values() for name in parts.motors]


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
            fault = _drive_fault(model, index, row)
            if fault:
                name = model.actuator(index).name.removeprefix(f"{robot.id}/")
                text = f"actuator '{name}' {fault}"
                raise FileError(str(robot.model.mjcf), [Fault(robot.model.name, text)])
        radius_m = np.array([robot.model.wheel_radius_m for robot in robots])
        self._traction = moment.sum(axis=1) / radius_m
        self._gain = model.actuator_gainprm[ids, 0]
        # Constant and damping terms of an affine bias, which the control makes up for.
        self._bias = model.actuator_biasprm[ids][:, [0, 2]].T
        self._velocity, self._control = data.actuator_velocity, data.ctrl

    def command(self, force_N: np.ndarray) -> None:
        """Set the controls that give the traction forces `force_N`, shape (D,)."""
        constant, damping = self._bias
        bias = constant + damping * self._velocity[self._out]
        self._control[self._ctrl] = (force_N / self._traction - bias) / self._gain


class WorkMeter:
    """Meters the work of all drives of a fleet at every physics step.

    Drives are all actuators on joints and fixed tendons but the steering servos.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[Robot]
    ) -> None:
        """Find the drives of `robots`."""
        self._moment = transmission(model)
        owner = _owners(model, robots, self._moment)
        bus = _buses(model, owner)
        self._buses = (bus[:, None] == np.arange(len(owner))).astype(float)
        is_own = owner == np.arange(len(robots))[:, None]
        self._sums = 0.5 * model.opt.timestep * is_own
        self._force, self._velocity = data.actuator_force, data.actuator_velocity
        self._qvel = data.qvel
        self._forces = self._velocities = np.empty((0, 0))

    def start(self, steps: int) -> None:
        """Make room for `steps` physics steps."""
        if len(self._forces) != steps:
            self._forces = np.empty((steps, len(self._force)))
            self._velocities = np.empty((steps + 1, len(self._force)))

    def look(self, step: int) -> None:
        """Note what was done in physics step `step`, which has just been made."""
        # MuJoCo leaves the velocities that the step began with.
        self._forces[step] = self._force
        self._velocities[step] = self._velocity

    def work_J(self) -> np.ndarray:
        """Return driving (>= 0) and braking (<= 0) work since the start, (R, 2).

        The motors of a robot's driven wheels share a bus, as in the energy model: in a
        turn the outer one uses what the inner one gains by braking. All other drives
        count by themselves.
        """
        velocity = self._velocities
        np.dot(self._moment, self._qvel, out=velocity[-1])
        work_J = (self._forces * (velocity[:-1] + velocity[1:])) @ self._buses
        driving, braking = np.maximum(work_J, 0.0), np.minimum(work_J, 0.0)
        both = np.array([driving.sum(axis=0), braking.sum(axis=0)])
        return np.asarray(np.dot(self._sums, both.T))


def transmission(model: mujoco.MjModel) -> np.ndarray:
    """Return what joint velocities make of actuators' velocities, shape (nout, nv)."""
    still = mujoco.MjData(model)
    mujoco.mj_forward(model, still)
    moment = np.zeros((model.nout, model.nv))
    mujoco.mju_sparse2dense(
        moment,
        still.actuator_moment,
        still.moment_rownnz,
        still.moment_rowadr,
        still.moment_colind,
    )
    return moment


def _owners(
    model: mujoco.MjModel, robots: Sequence[Robot], moment: np.ndarray
) -> np.ndarray:
    """Return the place of the robot that each actuator drives, or -1, shape (nout,)."""
    place = {
        model.body(f"{robot.id}/{CHASSIS}").id: index
        for index, robot in enumerate(robots)
    }
    owner = np.full(model.nout, -1)
    for index in range(model.nactuator):
        steers = model.actuator(index).name.rpartition("/")[2] in _STEERING
        if steers or _transmission_fault(model, index):
            continue
        output = model.actuator_outadr[index]
        dofs = np.flatnonzero(moment[output])
        roots = model.body_rootid[model.dof_bodyid[dofs]]
        owner[output] = place.get(int(roots[0]), -1) if len(roots) else -1
    return owner


def _buses(model: mujoco.MjModel, owner: np.ndarray) -> np.ndarray:
    """Return the first actuator output on each one's bus, shape (nout,)."""
    bus = np.arange(len(owner))
    first: dict[int, int] = {}
    for index in range(model.nactuator):
        output = int(model.actuator_outadr[index])
        if model.actuator(index).name.rpartition("/")[2] in _WHEEL_MOTORS:
            bus[output] = first.setdefault(int(owner[output]), output)
    return bus


def _drive_fault(model: mujoco.MjModel, index: int, moment: np.ndarray) -> str:
    """Return why an actuator cannot be commanded as a force; "" if it can."""
    elsewhere = _transmission_fault(model, index)
    dofs = np.flatnonzero(moment)
    limited = model.jnt_actfrclimited[model.dof_jntid[dofs]].any()
    gain = model.actuator_gainprm[index, 0]
    is_fixed = model.actuator_gaintype[index] == mujoco.mjtGain.mjGAIN_FIXED
    faults = {
        elsewhere: bool(elsewhere),
        "moves no wheel; check its gear and its joint or tendon": not moment.sum(),
        "acts on a joint with actuatorfrcrange; limit it by a forcerange instead": (
            limited
        ),
        "has a dynamics other than none, filter and filterexact; make it a motor": (
            model.actuator_dyntype[index] not in _DYNAMICS
        ),
        "has no constant gain; make it a motor": not is_fixed or gain == 0.0,
        "has a bias that is not affine in its velocity; make it a motor": (
            model.actuator_biastype[index] not in _BIASES
            or model.actuator_biasprm[index, 1] != 0.0
        ),
    }
    return next((text for text, is_so in faults.items() if is_so), "")


def _transmission_fault(model: mujoco.MjModel, index: int) -> str:
    kind, target = model.actuator_trntype[index], model.actuator_trnid[index, 0]
    if kind in _ON_JOINT:
        return ""
    if kind == mujoco.mjtTrn.mjTRN_TENDON:
        first = model.tendon_adr[target]
        if model.wrap_type[first] == mujoco.mjtWrap.mjWRAP_JOINT:
            return ""
    return "acts neither on a joint nor on a fixed tendon"
