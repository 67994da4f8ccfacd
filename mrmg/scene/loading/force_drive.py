"""Which actuators of an MJCF can be commanded as a force, and metered."""

from __future__ import annotations

import numpy as np

from mrmg.mujoco_import import mujoco


def transmission(model: mujoco.MjModel) -> np.ndarray:
    """Return what joint velocities make of actuators' velocities, shape (nout, nv)."""
    still = _at_rest(model)
    layout = still.moment_rownnz, still.moment_rowadr, still.moment_colind
    return _dense(model, still.actuator_moment, *layout)


def tendon_moment(model: mujoco.MjModel) -> np.ndarray:
    """Return what joint velocities make of tendons' velocities, shape (ntendon, nv).

    Rows of tendons that are not fixed, whose moments change as joints move, are 0.
    """
    layout = model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind
    moment = _dense(model, _at_rest(model).ten_J, *layout)
    moment[model.wrap_type[model.tendon_adr] != mujoco.mjtWrap.mjWRAP_JOINT] = 0.0
    return moment


def is_metered(model: mujoco.MjModel, index: int) -> bool:
    """Return whether an actuator acts on a joint or a fixed tendon."""
    return not _transmission_fault(model, index)


def drive_fault(model: mujoco.MjModel, index: int, moment: np.ndarray) -> str:
    """Return why an actuator cannot be commanded as a force; "" if it can."""
    elsewhere = _transmission_fault(model, index)
    dofs = np.flatnonzero(moment)
    limited = model.jnt_actfrclimited[model.dof_jntid[dofs]].any()
    gain = model.actuator_gainprm[index, 0]
    kinds = mujoco.mjtDyn
    dynamics = [kinds.mjDYN_NONE, kinds.mjDYN_FILTER, kinds.mjDYN_FILTEREXACT]
    biases = [mujoco.mjtBias.mjBIAS_NONE, mujoco.mjtBias.mjBIAS_AFFINE]
    is_fixed = model.actuator_gaintype[index] == mujoco.mjtGain.mjGAIN_FIXED
    faults = {
        elsewhere: bool(elsewhere),
        "moves no wheel; check its gear and its joint or tendon": not moment.sum(),
        "acts on a joint with actuatorfrcrange; limit it by a forcerange instead": (
            limited
        ),
        "has a dynamics other than none, filter and filterexact; make it a motor": (
            int(model.actuator_dyntype[index]) not in map(int, dynamics)
        ),
        "has no constant gain; make it a motor": not is_fixed or gain == 0.0,
        "has a bias that is not affine in its velocity; make it a motor": (
            int(model.actuator_biastype[index]) not in map(int, biases)
            or model.actuator_biasprm[index, 1] != 0.0
        ),
    }
    return next((text for text, is_so in faults.items() if is_so), "")


def _at_rest(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def _dense(
    model: mujoco.MjModel, values: np.ndarray, *layout: np.ndarray
) -> np.ndarray:
    """Return a sparse matrix of MuJoCo's with one column for each degree of freedom."""
    matrix = np.zeros((len(layout[0]), model.nv))
    mujoco.mju_sparse2dense(matrix, values, *layout)
    return matrix


def _transmission_fault(model: mujoco.MjModel, index: int) -> str:
    kind, target = model.actuator_trntype[index], model.actuator_trnid[index, 0]
    joints = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    if int(kind) in map(int, joints):
        return ""
    if kind == mujoco.mjtTrn.mjTRN_TENDON:
        first = model.tendon_adr[target]
        if model.wrap_type[first] == mujoco.mjtWrap.mjWRAP_JOINT:
            return ""
    return "acts neither on a joint nor on a fixed tendon"
