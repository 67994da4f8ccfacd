"""The drives of robots in MuJoCo, commanded as forces."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from mrmg.errors import Fault, FileError
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


def is_metered(model: mujoco.MjModel, index: int) -> bool:
    """Return whether an actuator acts on a joint or a fixed tendon."""
    return not _transmission_fault(model, index)


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
