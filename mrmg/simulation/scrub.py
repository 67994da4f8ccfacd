"""The plant `scrub`: a ground contact that the energy model does not know.

The default plant takes its losses from the energy model's law, so that planned and
measured energies agree by construction. This one takes them wheel by wheel, from the
contact forces that MuJoCo found in the last physics step. With N the load of a tyre,
F its force along the ground, k and k_turn the terrain's factors under its own contact:

Rolling, load and speed dependent (SAE J2452), N_0 the robot's weight over its tyres:

    R = C_rr k N (N / N_0)^(beta - 1) (1 + c_v |v|)

Creep, by the brush model of a tyre with parabolic pressure (Fiala 1954; Pacejka, Tyre
and Vehicle Dynamics, 3rd ed. 2012, sec. 3.2), solved for the slip that carries F, both
lengthways (traction) and sideways (cornering). A wheel loses F sigma on each metre:

    sigma = 3 mu / c (1 - (1 - F / (mu N))^(1/3))

Sideways the tyres of an axle slip alike and share its force by their loads. MuJoCo's
rigid contacts know no such slip: wheels toed by a hair, as on the edges of a floor's
facets, push against each other with all their grip, which no tyre of stiffness c would.

Scrub, the drilling torque of a round patch of radius a that slides at sigma |v| while
it spins at the yaw rate omega (Zhuravlev 1998, uniform pressure). It is greatest on the
spot and fades in wide turns:

    M = 2/3 mu k_turn N a  a |omega| / (a |omega| + 8 / (3 pi) sigma |v|)

Rolling and creep are dry friction of the wheel's joint, and scrub that of the chassis'
yaw. A caster without a joint drags against its own way, by the force at the wheels and
the moment about their axle that this makes. The MJCF's `rolling_coefficient` is C_rr;
its `turning_coefficient` counts for nothing here.
"""

from __future__ import annotations

import numpy as np

from mrmg.energy.model import GRAVITY_M_S2
from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import FLOOR_BIT, ROOT
from mrmg.simulation.ground import Ground, TerrainUnderfoot
from mrmg.simulation.scenery import FLOOR
from mrmg.simulation.world_model import MujocoWorld

LOAD_EXPONENT = 0.9
"""beta; tyres of SAE J2452 have 0.8 to 1.0."""

SPEED_PER_M_S = 0.05
"""c_v; walking pace is slow, but the model has no speed in it."""

SLIP_STIFFNESS = 8.0
"""c, force over load per unit of slip; 8 to 12 for car tyres (Pacejka 2012), less for
soft ones."""

PATCH_SHARE = 0.2
"""Radius a of the patch over that of the wheel: a soft tyre pressed in by 2 % of its
radius touches the ground over 0.2 of it."""

_RELAXATION = 0.2
"""Share of a change of load that a tyre takes up in a tick: most of it in 0.1 s."""

_STILL_M_S = 1e-4
_NO_SPIN = -1


class ScrubbingTyres:
    """The tyres of a fleet in a running simulation; a `Plant`."""

    def __init__(
        self, world: MujocoWorld, data: mujoco.MjData, rolling_N: np.ndarray
    ) -> None:
        """Find everything of the robots that touches the floor.

        Args:
            world: the compiled world; its frictions are changed at every tick.
            data: of the simulation.
            rolling_N: C_rr times the weight of each robot, shape (R,).
        """
        self._model, self._data = world.model, data
        model, robots = world.model, world.scene.robots
        self._terrain = TerrainUnderfoot(world.scene)
        self._floor = model.geom(FLOOR).id
        roots = model.body_rootid[model.geom_bodyid]
        touches = (model.geom_conaffinity & FLOOR_BIT) != 0
        owner = np.full(model.nbody, -1)
        owner[world.chassis] = np.arange(len(robots))
        tyres = np.flatnonzero(touches & (owner[roots] >= 0))
        self._tyre_of = np.full(model.ngeom, -1)
        self._tyre_of[tyres] = np.arange(len(tyres))
        self._tyres, self._owner = tyres, owner[roots[tyres]]
        self._tree = model.body_treeid[model.geom_bodyid[tyres]]
        self._spin = np.array([_spin_dof(model, int(geom)) for geom in tyres])
        self._rolls = self._spin != _NO_SPIN
        self._axles = _axles(model, tyres, self._owner)
        self._yaw = np.array(
            [model.joint(f"{robot.id}/{ROOT}").dofadr[0] + 5 for robot in robots]
        )
        radius_m = np.array([robot.model.wheel_radius_m for robot in robots])
        own_m = model.geom_size[tyres, 0]
        self._radius_m = np.where(self._rolls, radius_m[self._owner], own_m)
        weight_N = model.body_subtreemass[world.chassis] * GRAVITY_M_S2
        count = np.bincount(self._owner[self._rolls], minlength=len(robots))
        self._rolling = (rolling_N / weight_N)[self._owner]
        self._usual_N = (weight_N / np.maximum(count, 1))[self._owner]
        self._forces_N = np.array([self._usual_N, 0.0 * self._usual_N])
        self._wheels = count[self._owner]
        self._lead_m = np.abs(model.geom_pos[tyres, 0]) * ~self._rolls
        # All frictions are as stiff as the contacts.
        stiff = [2.0 * model.opt.timestep, 1.0]
        for dofs in (self._spin[self._rolls], self._yaw):
            model.dof_solref[dofs, :2] = stiff

    def resist(self, ground: Ground, level: np.ndarray) -> None:
        """Set all frictions for the coming tick, from the loads of the last step.

        Each tyre has ground of its own, and its load counts the slope: both arguments
        count for nothing.
        """
        model = self._model
        # A tyre gives way to a new load over some of its turn, not within a step.
        # MuJoCo finds no contacts of a robot that sleeps: its tyres keep their loads.
        taken = _RELAXATION * (self._data.tree_asleep[self._tree] < 0)
        self._forces_N += taken * (self._contact_forces() - self._forces_N)
        load_N, force_N = self._forces_N
        rolling, turning = self._terrain.under(*self._data.geom_xpos[self._tyres, :2].T)
        yaw_rad_s = np.abs(self._data.qvel[self._yaw])[self._owner]
        rolls, speed_m_s = self._rolls, self._speeds_m_s()
        grip = model.geom_friction[self._tyres, 0]
        used = np.clip(force_N / np.maximum(grip * load_N, 1.0), 0.0, 1.0)
        slip = 3.0 * grip / SLIP_STIFFNESS * (1.0 - np.cbrt(1.0 - used))
        share = (np.maximum(load_N, 1.0) / self._usual_N) ** (LOAD_EXPONENT - 1)
        drag_N = self._rolling * rolling * share * load_N
        drag_N *= 1.0 + SPEED_PER_M_S * speed_m_s
        patch_m = PATCH_SHARE * self._radius_m
        spun_m_s = patch_m * yaw_rad_s + _STILL_M_S
        slid_m_s = 8.0 / (3.0 * np.pi) * slip * speed_m_s
        scrub_Nm = 2.0 / 3.0 * turning * grip * load_N * patch_m
        scrub_Nm *= spun_m_s / (spun_m_s + slid_m_s)
        across_m_s = self._lead_m * yaw_rad_s
        ahead = (speed_m_s + _STILL_M_S) / np.hypot(speed_m_s + _STILL_M_S, across_m_s)
        swung_Nm = drag_N * self._lead_m * np.sqrt(np.maximum(1.0 - ahead**2, 0.0))
        self._set_frictions(
            np.where(rolls, drag_N + force_N * slip, 0.0),
            np.where(rolls, 0.0, drag_N * ahead),
            np.where(rolls, scrub_Nm, swung_Nm),
        )

    def _set_frictions(
        self, wheels_N: np.ndarray, casters_N: np.ndarray, yaw_Nm: np.ndarray
    ) -> None:
        """Set what wheels lose, what casters drag, and against turning, each (n,)."""
        robots, rolls = len(self._yaw), self._rolls
        dragged_N = np.bincount(self._owner, weights=casters_N, minlength=robots)
        torque_Nm = wheels_N + dragged_N[self._owner] / self._wheels
        torque_Nm *= self._radius_m
        friction = self._model.dof_frictionloss
        friction[self._spin[rolls]] = torque_Nm[rolls]
        friction[self._yaw] = np.bincount(self._owner, weights=yaw_Nm, minlength=robots)

    def _contact_forces(self) -> np.ndarray:
        """Return load and force along the ground of each tyre [N], shape (2, n)."""
        contact, efc_N = self._data.contact, self._data.efc_force
        geoms, row = contact.geom, contact.efc_address
        other = np.where(geoms[:, 0] == self._floor, geoms[:, 1], geoms[:, 0])
        tyre = np.where((geoms == self._floor).any(axis=1), self._tyre_of[other], -1)
        at = np.flatnonzero((tyre >= 0) & (row >= 0))
        tyre, row, number = tyre[at], row[at], len(self._tyres)
        load_N = np.bincount(tyre, weights=efc_N[row], minlength=number)
        rows = np.minimum(row[:, None] + [1, 2], len(efc_N) - 1)
        grip_N = np.where(contact.dim[at, None] > 1, efc_N[rows], 0.0)
        grip_N = np.einsum(
            "kc,kcx->kx", grip_N, contact.frame[at].reshape(-1, 3, 3)[:, 1:]
        )
        force_N = np.zeros((number, 3))
        np.add.at(force_N, tyre, grip_N)
        spin = self._model.dof_jntid[np.maximum(self._spin, 0)]
        sideways_N = (force_N * self._data.xaxis[spin]).sum(axis=1)
        ahead_N = np.sqrt(np.maximum((force_N**2).sum(axis=1) - sideways_N**2, 0.0))
        axle_N = np.bincount(self._axles, weights=sideways_N)
        carried_N = np.maximum(np.bincount(self._axles, weights=load_N), 1.0)
        share = load_N / carried_N[self._axles]
        return np.array([load_N, np.hypot(ahead_N, share * axle_N[self._axles])])

    def _speeds_m_s(self) -> np.ndarray:
        """Return how fast each tyre rolls; a caster as fast as its chassis, (n,)."""
        rates = self._data.qvel[np.maximum(self._spin, 0)]
        forward = np.hypot(
            self._data.qvel[self._yaw - 5], self._data.qvel[self._yaw - 4]
        )
        rolled = np.abs(rates) * self._radius_m
        return np.asarray(np.where(self._rolls, rolled, forward[self._owner]))


def _spin_dof(model: mujoco.MjModel, geom: int) -> int:
    """Return the address of a wheel's rolling velocity; _NO_SPIN for a caster."""
    body = model.geom_bodyid[geom]
    first = model.body_jntadr[body]
    for joint in range(first, first + model.body_jntnum[body]):
        across = abs(model.jnt_axis[joint, 1]) > 0.9
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE and across:
            return int(model.jnt_dofadr[joint])
    return _NO_SPIN


def _axles(model: mujoco.MjModel, tyres: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """Return the axle of each tyre: those of one robot that lie side by side, (n,)."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    root = model.body_rootid[model.geom_bodyid[tyres]]
    forward = data.xmat[root].reshape(-1, 3, 3)[:, :, 0]
    ahead_m = ((data.geom_xpos[tyres] - data.xpos[root]) * forward).sum(axis=1)
    places = np.stack([owner, ahead_m.round(2)], axis=1)
    return np.unique(places, axis=0, return_inverse=True)[1].ravel()
