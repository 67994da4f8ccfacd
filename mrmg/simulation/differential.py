"""The chassis of a differential drive: two driven wheels, and casters without drag.

The MJCF names its parts as `scene.driven_parts` has them: the joints of the wheels,
motors whose controls are the traction forces of the wheels, and tendons as long as the
way rolled by the middle of the axle, and as the way rolled by the right wheel less that
of the left. The tendons carry dry friction: rolling resistance on the first, what
turning takes on the second, so that both losses add up as in the energy model.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.energy.model import GRAVITY_M_S2
from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import CHASSIS, PARTS, ROOT
from mrmg.scene.types import Robot
from mrmg.simulation.chassis import Chassis, part_ids
from mrmg.simulation.drive import SpeedLoop
from mrmg.simulation.drives import ForceDrives

_LEVEL = 1e-3
"""Cross slope that dry friction holds."""


class DifferentialChassis(Chassis):
    """All differential drives of a running simulation."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[Robot]
    ) -> None:
        """Find the parts of `robots`.

        Raises:
            FileError: if a drive cannot be commanded as a force.
        """
        parts = PARTS["unicycle"]
        super().__init__(model, data, robots, parts)
        models = [robot.model for robot in robots]
        self._track_m = np.array([item.track_m for item in models])
        root = part_ids(model.joint, robots, (ROOT,))[:, 0]
        self._yaw_v = model.jnt_dofadr[root] + 5
        motors = part_ids(model.actuator, robots, parts.motors)
        each = [robot for robot in robots for _ in range(2)]
        self._drives = ForceDrives(model, data, each, motors.ravel())
        self._tendon = part_ids(model.tendon, robots, parts.tendons)
        self._turning_N = np.array(
            [item.energy_model.turning_force_N for item in models]
        )
        grip_N = np.array(
            [item.usable_grip * item.mass_kg * GRAVITY_M_S2 for item in models]
        )
        spin = np.array([item.wheel_inertia_kg_m2 for item in models])
        wheels_kg_m2 = 0.5 * spin * (self._track_m / self._radius_m) ** 2
        self._body = part_ids(model.body, robots, (CHASSIS,))[:, 0]
        yaw_kg_m2, self._lead_kg_m = self._inertia_about_axle()
        self._loop = SpeedLoop(
            inertia=yaw_kg_m2 + wheels_kg_m2,
            # Errors of the resistance to turning must be within reach, too.
            limit=grip_N * self._track_m / 2 + self._turning_N * self._track_m,
            # A mass ahead of the axle wants to go down a cross slope.
            weight=self._lead_kg_m * GRAVITY_M_S2,
            level=_LEVEL,
        )

    def fifth_state(self) -> np.ndarray:
        """Return the true omega, shape (K,)."""
        return np.asarray(self._data.qvel[self._yaw_v])

    def set_resistance(self, resistance_N: np.ndarray, swing_N: np.ndarray) -> None:
        """Set the dry friction of both tendons."""
        friction = np.stack([resistance_N, swing_N], axis=1)
        self._model.tendon_frictionloss[self._tendon] = friction

    def command(
        self,
        force_N: np.ndarray,
        w_from: np.ndarray,
        w_to: np.ndarray,
        steps: int,
        turning_multiplier: np.ndarray,
    ) -> None:
        """Hold the traction force, and the moment that follows the ramp of omega."""
        speed = self._wheel_speed_m_s()
        # The vertical part of the axle: 0 on level ground, but for the tyres' give.
        cross_slope = self._data.xmat[self._body, 7]
        moment_Nm = self._loop.force(
            (speed[:, 1] - speed[:, 0]) / self._track_m,
            w_from,
            w_to,
            turning_multiplier * self._turning_N * self._track_m,
            cross_slope,
            steps * self._model.opt.timestep,
        )
        # A mass ahead of the axle wants to go straight on.
        moment_Nm += self._lead_kg_m * speed.mean(axis=1) * 0.5 * (w_from + w_to)
        swing_N = moment_Nm / self._track_m
        wheels_N = 0.5 * force_N[:, None] + np.stack([-swing_N, swing_N], axis=1)
        self._drives.command(wheels_N.ravel())

    def _inertia_about_axle(self) -> tuple[np.ndarray, np.ndarray]:
        """Return yaw inertias about the axles' middles, and masses times their leads.

        Returns:
            Inertia of each robot as a rigid body [kg m^2], shape (K,), and mass times
            the distance by which its centre is ahead of the axle [kg m], shape (K,).
        """
        model, still, body = self._model, mujoco.MjData(self._model), self._body
        mujoco.mj_forward(model, still)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, still, inertia)
        forward = still.xmat[body].reshape(-1, 3, 3)[:, :, 0]
        lead_m = ((still.subtree_com[body] - still.xpos[body]) * forward).sum(axis=1)
        return inertia[self._yaw_v, self._yaw_v], model.body_subtreemass[body] * lead_m
