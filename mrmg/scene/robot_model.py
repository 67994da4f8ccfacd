"""One kind of robot: its shape, motion, limits, tyres and battery.

A model is a folder in `models/` with `robot.yaml` (this module's fields) and an MJCF
file; `scene.loading` reads the YAML, `simulation` compiles the MJCF.
"""

from __future__ import annotations

import math
from dataclasses import asdict, astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike

from mrmg.energy.model import GRAVITY_M_S2, EnergyModel, EnergyPreset
from mrmg.errors import Fault, SceneError
from mrmg.scene.content import ByContent, content, contents
from mrmg.scene.margins import (
    MOST_DEFAULT_M,
    STATES_NONE,
    Margins,
    TrackingError,
    default_margins,
)
from mrmg.scene.model_files import ModelFiles
from mrmg.scene.motor import Motor

MAX_CORNERS = 12
"""Largest number of corners of a footprint: what the planner's arrays hold."""

GRIP_SHARE = 0.8
"""Share of the driven axle's static grip that is used."""

DRIVEN_LOAD_SHARE = 0.5
"""Share of the weight the driven axle carries at least."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Bounds of state and control of a motion model.

    Attributes:
        v_min_m_s: fastest reverse speed, negative or zero.
        v_max_m_s: fastest forward speed.
        w_max: bound of |psi| [rad] (car) or |omega| [rad/s] (unicycle).
        u1_max_m_s2: bound of the acceleration |u1|.
        u2_max: bound of |u2|: steering rate [rad/s] or angular acceleration [rad/s^2].
    """

    v_min_m_s: float
    v_max_m_s: float
    w_max: float
    u1_max_m_s2: float
    u2_max: float

    def as_tuple(self) -> tuple[float, ...]:
        """Return (v_min, v_max, w_max, u1_max, u2_max)."""
        return astuple(self)

    def scaled(self, share: float) -> Limits:
        """Return the limits times `share`; the planner leaves the rest to control."""
        return Limits(**{name: share * most for name, most in asdict(self).items()})


@dataclass(frozen=True, slots=True)
class ModelOrigin:
    """Where a model was loaded from.

    Attributes:
        reference: what a scene file calls it: a shipped model's name, or a folder.
        text: of its `robot.yaml`.
        model: as that has it.
    """

    reference: str
    text: str
    model: RobotModel


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RobotModel(ByContent):
    """Everything the planner and the physics must agree on about one kind of robot.

    Attributes:
        name: folder name of the model.
        motion_model: key of `motion.dynamics.DERIVATIVES`, or the path of a Python file
            that defines the motion (`motion.user_motion`).
        footprint_m: convex outline in the robot's frame, counter-clockwise, shape
            (m, 2). The frame's origin is the reference point (x, y): the middle of the
            rear axle.
        height_m: height of the body.
        wheelbase_m: distance L of the axles.
        track_m: distance of the wheels of one axle.
        limits: what the robot can do.
        planning_share: share of the limits the planner uses; the controller keeps the
            rest.
        mass_kg: whole robot, wheels included.
        center_of_mass_m: how far ahead of the reference point the mass lies; what it
            climbs is the height of the ground there.
        wheel_radius_m: rolling radius.
        wheel_inertia_kg_m2: spin inertia of one wheel, armature included.
        wheel_count: number of wheels.
        rolling_coefficient: C_rr on plain ground.
        turning_coefficient: C_turn of the energy model.
        friction_coefficient: tyre on ground.
        drive_efficiency: battery to wheel.
        regeneration_efficiency: wheel to battery.
        idle_power_W: electronics.
        device_power_W: what it carries.
        energy_preset: which parts of the energy model count.
        battery_capacity_J: of the standard battery.
        mjcf: path of the MJCF file; None for a model that is only planned for.
        skid_track_m: track of the differential drive that turns like it, if its wheels
            skid in turns; None if they do not. Logs of wheel speeds are read by it.
        motor: of each side; None where nobody states it. Logs of currents are read by
            it.
        margins: that plans keep, as `robot.yaml` states them.
        tracking_error: largest one that the model has shown in MuJoCo; None where
            nobody measured it. The default margins follow from it.
        files: what the MJCF and a custom motion consist of, read when the model was
            made.
        origin: where it was loaded from; None for one made in memory.
        unit_m: unit of its lengths [m]: a metre, but for planning (`planning.frame`).
    """

    name: str
    motion_model: str
    footprint_m: np.ndarray
    height_m: float
    wheelbase_m: float
    track_m: float
    limits: Limits
    planning_share: float
    mass_kg: float
    center_of_mass_m: float
    wheel_radius_m: float
    wheel_inertia_kg_m2: float
    wheel_count: int
    rolling_coefficient: float
    turning_coefficient: float
    friction_coefficient: float
    drive_efficiency: float
    regeneration_efficiency: float
    idle_power_W: float
    device_power_W: float
    energy_preset: EnergyPreset
    battery_capacity_J: float
    mjcf: Path | None
    skid_track_m: float | None = None
    motor: Motor | None = None
    margins: Margins = STATES_NONE
    tracking_error: TrackingError | None = None
    files: ModelFiles = ModelFiles((), ())
    origin: ModelOrigin | None = None
    unit_m: float = 1.0

    def __post_init__(self) -> None:
        named = (self.mjcf, Path(self.motion_model) if self.has_custom_motion else None)
        roots = tuple(path for path in named if path is not None)
        if self.files.roots != roots:
            object.__setattr__(self, "files", ModelFiles.of(*roots))

    def require_unchanged_files(self) -> None:
        """Refuse a model whose files are not any more those that its digest is of.

        Raises:
            SceneError: naming the files.
        """
        changed = self.files.changed()
        if changed:
            message = "has changed since the scene was loaded; load the scene again"
            faults = [Fault(str(path), message) for path in changed]
            raise SceneError(f"model '{self.name}'", faults)

    def content(self) -> dict[str, Any]:
        """Return what counts for a digest: what the model states, not where it lies."""
        known = contents(self, without=("name", "mjcf", "origin", "tracking_error"))
        outline = content(shapely.Polygon(self.footprint_m))
        default = default_margins(self)
        if default.obstacle_m != MOST_DEFAULT_M:  # what models kept before they had any
            known["default_margins"] = content(default)
        as_loaded = self.origin.model.tracking_error if self.origin else None
        if self.tracking_error != as_loaded:
            known["tracking_error"] = content(self.tracking_error)
        return {**known, "motion_model": self.motion_name, "footprint_m": outline}

    @property
    def motion_name(self) -> str:
        """Name of the motion model: "car", "unicycle" or "custom"."""
        return "custom" if self.has_custom_motion else self.motion_model

    @property
    def has_custom_motion(self) -> bool:
        """Whether a Python file of the model's folder defines its motion."""
        return self.motion_model.endswith(".py")

    @property
    def effective_mass_kg(self) -> float:
        """Mass that resists acceleration along the road: m + n I_w / r^2."""
        spin = self.wheel_count * self.wheel_inertia_kg_m2 / self.wheel_radius_m**2
        return self.mass_kg + spin

    @property
    def energy_model(self) -> EnergyModel:
        """The energy model with this robot's coefficients."""
        weight_N = self.mass_kg * GRAVITY_M_S2 / self.unit_m
        full = EnergyModel(
            rolling_force_N=self.rolling_coefficient * weight_N,
            turning_force_N=self.turning_coefficient * weight_N,
            effective_mass_kg=self.effective_mass_kg,
            weight_N=weight_N,
            drive_efficiency=self.drive_efficiency,
            regeneration_efficiency=self.regeneration_efficiency,
            idle_power_W=self.idle_power_W,
            device_power_W=self.device_power_W,
        )
        return full.with_preset(self.energy_preset)

    @property
    def top_speed_m_s(self) -> float:
        """Speed that the robot exceeds in neither direction."""
        return max(self.limits.v_max_m_s, -self.limits.v_min_m_s)

    @property
    def planned_limits(self) -> Limits:
        """The share of the limits that plans use."""
        return self.limits.scaled(self.planning_share)

    @property
    def consumers_W(self) -> float:
        """Power that consumers draw at all times."""
        return self.energy_model.idle_power_W + self.energy_model.device_power_W

    def consumed_per_m(self, speed_m_s: float) -> float:
        """Return what consumers draw on a metre at a speed [m of plain ground]."""
        plain_J_per_m = self.energy_model.plain_ground_J_per_m()
        return self.consumers_W / (plain_J_per_m * speed_m_s)

    @property
    def top_kinetic_J(self) -> float:
        """Battery energy that the robot's motion at top speed is worth at most."""
        energy = self.energy_model
        kinetic_J = 0.5 * energy.effective_mass_kg * self.top_speed_m_s**2
        return kinetic_J / energy.drive_efficiency

    @property
    def usable_grip(self) -> float:
        """Force the driven axle may transmit, as a share of the weight."""
        return GRIP_SHARE * DRIVEN_LOAD_SHARE * self.friction_coefficient

    def footprint_at(self, poses: ArrayLike) -> np.ndarray:
        """Return the footprint's corners in the world's frame [m], shape (..., m, 2).

        Args:
            poses: (x [m], y [m], yaw [rad], ...), shape (..., 3 or more).
        """
        return placed(self.footprint_m, poses)

    @property
    def inscribed_radius_m(self) -> float:
        """Radius of the largest circle about the reference point in the footprint."""
        outline = shapely.Polygon(self.footprint_m).exterior
        return float(outline.distance(shapely.Point(0.0, 0.0)))

    @property
    def half_width_m(self) -> float:
        """Half the footprint's extent across the driving direction."""
        return float(np.abs(self.footprint_m[:, 1]).max())

    @property
    def circumscribed_radius_m(self) -> float:
        """Radius of the circle about the reference point that holds the footprint."""
        return float(np.hypot(self.footprint_m[:, 0], self.footprint_m[:, 1]).max())

    @property
    def middle_m(self) -> np.ndarray:
        """Middle of the footprint in the robot's frame [m], shape (2,)."""
        outline = self.footprint_m
        return np.asarray(0.5 * (outline.min(axis=0) + outline.max(axis=0)))

    @property
    def radius_m(self) -> float:
        """Radius of the circle about the footprint's middle that holds it."""
        return float(np.hypot(*(self.footprint_m - self.middle_m).T).max())

    @property
    def turning_radius_m(self) -> float:
        """Smallest turning radius of the reference point in the planner's limits."""
        if self.motion_model != "car":
            return 0.0
        return self.wheelbase_m / math.tan(self.planning_share * self.limits.w_max)


def placed(points: np.ndarray, poses: ArrayLike) -> np.ndarray:
    """Return points of a body's frame in the world's frame: p + R(yaw) b [m].

    Args:
        points: in the body's frame [m], shape (m, 2).
        poses: (x [m], y [m], yaw [rad], ...), shape (..., 3 or more).

    Returns:
        Shape (..., m, 2).
    """
    poses = np.asarray(poses)
    cos, sin = np.cos(poses[..., 2]), np.sin(poses[..., 2])
    turn = np.stack([np.stack([cos, sin], -1), np.stack([-sin, cos], -1)], axis=-2)
    return np.asarray(points @ turn + poses[..., None, :2])
