"""What a robot's MJCF states of it, measured in the compiled model.

It imports MuJoCo, which takes a fifth of a second at best; as unchanged shipped models
need no look, `models` imports the comparison of both files late.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import CHASSIS, FLOOR_BIT, OBSTACLE_BIT, ROOT
from mrmg.scene.loading.force_drive import drive_fault, tendon_moment, transmission


@contextmanager
def no_warning_file() -> Iterator[None]:
    """Keep MuJoCo from writing warnings to a file in the working directory."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


class CompiledRobot:
    """A robot as its MJCF has it, alone and at rest, in the frame of its chassis.

    Attributes:
        file: name of the MJCF file.
    """

    def __init__(self, path: Path) -> None:
        """Compile the MJCF file at `path`.

        Raises:
            ValueError: if MuJoCo cannot use it, with its message.
        """
        self.file = path.name
        self._model = mujoco.MjSpec.from_file(str(path)).compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)

    def has(self, kind: str, name: str) -> bool:
        """Return whether there is a joint, body, geom, actuator, ... of that name."""
        code = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
        return bool(mujoco.mj_name2id(self._model, code, name) >= 0)

    def has_free_root(self) -> bool:
        """Return whether the joint `root` is free, and that of the chassis."""
        joint = self._model.joint(ROOT)
        free = joint.type == mujoco.mjtJoint.mjJNT_FREE
        return bool(free and joint.bodyid[0] == self._model.body(CHASSIS).id)

    @property
    def mass_kg(self) -> float:
        """Mass of all bodies."""
        return float(self._model.body_mass.sum())

    @property
    def center_of_mass_m(self) -> float:
        """How far ahead of the chassis' origin the centre of all masses lies."""
        return float(self._data.subtree_com[0, 0] - self.origin_m[0])

    @property
    def origin_m(self) -> np.ndarray:
        """Where the chassis stands, shape (3,)."""
        return np.asarray(self._data.body(CHASSIS).xpos)

    @property
    def heading(self) -> np.ndarray:
        """Forward axis of the chassis, shape (3,)."""
        return np.asarray(self._data.body(CHASSIS).xmat.reshape(3, 3)[:, 0])

    def axis(self, joint: str | int) -> np.ndarray:
        """Return the axis of a hinge, shape (3,); zeros for a joint that is none."""
        hinge = self._model.joint(joint).type == mujoco.mjtJoint.mjJNT_HINGE
        return np.asarray(self._data.joint(joint).xaxis) if hinge else np.zeros(3)

    def place_m(self, joint: str) -> np.ndarray:
        """Return where a joint is, seen from the chassis' origin, shape (3,)."""
        return np.asarray(self._data.joint(joint).xanchor - self.origin_m)

    def joint_range_rad(self, joint: str) -> tuple[float, float]:
        """Return how far a joint turns."""
        found = self._model.joint(joint)
        return _range(found.limited, found.range)

    @cached_property
    def wheels(self) -> tuple[str | int, ...]:
        """Joints of all wheels: hinges across, with a tyre on the floor.

        They are given by their names, or by their numbers where they have none.
        """
        joints = range(self._model.njnt)
        named = [self._model.joint(at).name or at for at in joints]
        hinges = [name for name in named if abs(self.axis(name)[1]) > 0.9]
        return tuple(name for name in hinges if self._tyres(name))

    def radius_m(self, joint: str | int) -> float:
        """Return how far the tyres of a wheel reach below its joint."""
        down = np.array([0.0, 0.0, -1.0])
        middle = down @ self._data.joint(joint).xanchor
        lowest = max(
            support_m(self._model, self._data, geom, down)
            for geom in self._tyres(joint)
        )
        return float(lowest - middle)

    def spin_inertia_kg_m2(self, joint: str | int) -> float:
        """Return the inertia about a wheel's joint, armature included."""
        return float(self._model.joint(joint).M0[0])

    def wheel_mass_kg(self, joint: str | int) -> float:
        """Return the mass of all that turns with a wheel."""
        model = self._model
        turning = model.body_weldid == model.body_weldid[model.joint(joint).bodyid[0]]
        return float(model.body_mass[turning].sum())

    def grip(self, joint: str) -> float:
        """Return the friction coefficient of a wheel on the simulated floor."""
        model = self._model
        best = 0.0
        for geom in self._tyres(joint):
            own = float(model.geom_friction[geom, 0])
            if model.geom_priority[geom] == 0:  # as the floor's: the larger one counts
                best = max(best, own, 1.0)
            elif model.geom_condim[geom] > 1:
                best = max(best, own)
        return best

    def touching(self) -> list[str]:
        """Return the names of all geoms that obstacles and walls can touch."""
        solid = np.flatnonzero(self._model.geom_conaffinity & OBSTACLE_BIT)
        return [self._model.geom(geom).name or f"#{geom}" for geom in solid]

    def touches(self, geom: str, bits: int) -> bool:
        """Return whether a geom touches everything that has one of some bits."""
        affinity = int(self._model.geom(geom).conaffinity[0])
        return affinity & bits == bits

    def reach_m(self, geom: str, direction: Sequence[float]) -> float:
        """Return how far a geom reaches from the chassis' origin along a unit vector.

        Infinity for planes and height fields.
        """
        vector = np.array([*direction, 0.0, 0.0, 0.0])[:3]
        far_m = support_m(self._model, self._data, self._model.geom(geom).id, vector)
        return far_m - float(vector @ self.origin_m)

    def traction_N(self, motor: str, joints: Sequence[str], force_N: float) -> float:
        """Return the force of wheels on the ground as one motor is commanded `force_N`.

        That is what `simulation.drives` commands at rest; its ranges may cut it.
        """
        model, at = self._model, self._model.actuator(motor).id
        (moment,) = transmission(model)[[model.actuator_outadr[at]]]
        effort = force_N * self.radius_m(joints[0]) / moment.sum()
        control = (effort - model.actuator_biasprm[at, 0]) / model.actuator_gainprm[
            at, 0
        ]
        if model.actuator_ctrllimited[at]:
            control = np.clip(control, *model.actuator_ctrlrange[at])
        self._data.ctrl[:] = 0.0
        self._data.ctrl[model.actuator_ctrladr[at]] = control
        if model.actuator_actadr[at] >= 0:  # a filter, once it has settled
            self._data.act[model.actuator_actadr[at]] = control
        mujoco.mj_forward(model, self._data)
        forces_N = [
            self._data.joint(joint).qfrc_actuator[0] / self.radius_m(joint)
            for joint in joints
        ]
        return float(sum(forces_N))

    def yaw_inertia_kg_m2(self) -> float:
        """Return the inertia about the upright axis through the chassis' origin."""
        return float(self._model.joint(ROOT).M0[5])

    def drive_fault(self, actuator: str) -> str:
        """Return why an actuator cannot be commanded as a force; "" if it can."""
        at = self._model.actuator(actuator).id
        moment = transmission(self._model)[self._model.actuator_outadr[at]]
        return drive_fault(self._model, at, moment)

    def servo_gain(self, servo: str) -> float:
        """Return the angle a position servo holds for a control of 1; else 0."""
        actuator = self._model.actuator(servo)
        stiffness, gear = -float(actuator.biasprm[1]), float(actuator.gear[0])
        affine = actuator.biastype == mujoco.mjtBias.mjBIAS_AFFINE
        at_once = actuator.dyntype == mujoco.mjtDyn.mjDYN_NONE
        if not (affine and at_once and stiffness > 0.0 and gear):
            return 0.0
        return float(actuator.gainprm[0]) / stiffness / gear

    def servo_range_rad(self, servo: str) -> tuple[float, float]:
        """Return the angles a position servo can be given."""
        actuator = self._model.actuator(servo)
        low, high = _range(actuator.ctrllimited, actuator.ctrlrange)
        return self.servo_gain(servo) * low, self.servo_gain(servo) * high

    def tendon_per_rad_m(self, tendon: str, joint: str) -> float:
        """Return by how much a tendon grows when a wheel turns by one radian."""
        dof = self._model.joint(joint).dofadr[0]
        return float(tendon_moment(self._model)[self._model.tendon(tendon).id, dof])

    def _tyres(self, joint: str | int) -> list[int]:
        """Return the geoms of a wheel that touch the floor."""
        model = self._model
        body = model.body_weldid[model.joint(joint).bodyid[0]]
        return [
            int(geom)
            for geom in np.flatnonzero(model.geom_conaffinity & FLOOR_BIT)
            if model.body_weldid[model.geom_bodyid[geom]] == body
        ]


def support_m(model: Any, data: Any, geom: int, direction: np.ndarray) -> float:
    """Return the largest coordinate of a geom along a unit vector [m].

    Infinity for planes and height fields.
    """
    kinds = mujoco.mjtGeom
    kind, size = model.geom_type[geom], model.geom_size[geom]
    own = data.geom_xmat[geom].reshape(3, 3).T @ direction
    if kind == kinds.mjGEOM_SPHERE:
        reach = size[0]
    elif kind == kinds.mjGEOM_CAPSULE:
        reach = size[0] + size[1] * abs(own[2])
    elif kind == kinds.mjGEOM_CYLINDER:
        reach = size[0] * np.hypot(own[0], own[1]) + size[1] * abs(own[2])
    elif kind == kinds.mjGEOM_ELLIPSOID:
        reach = np.linalg.norm(size * own)
    elif kind == kinds.mjGEOM_BOX:
        reach = size @ np.abs(own)
    elif kind == kinds.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        reach = (model.mesh_vert[first : first + count] @ own).max()
    else:
        return float("inf")
    return float(reach + data.geom_xpos[geom] @ direction)


def mesh_of(model: Any, mesh: int) -> Any:
    """Return a mesh of a compiled model as a trimesh."""
    import trimesh

    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    start, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return trimesh.Trimesh(
        model.mesh_vert[first : first + count],
        model.mesh_face[start : start + faces],
        process=False,
    )


def _range(limited: bool, ends: np.ndarray) -> tuple[float, float]:
    low, high = map(float, ends)
    return (low, high) if limited else (-float("inf"), float("inf"))
