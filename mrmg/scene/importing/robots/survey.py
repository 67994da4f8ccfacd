"""What a compiled robot description shows of wheels, masses and shapes.

Frame: x forward, y left, z up, as in REP 103; results are relative to the middle of
the driven axle on the ground.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mrmg.errors import Fault, SceneError
from mrmg.scene.importing.robots.description import Description
from mrmg.scene.loading.mjcf import support_m
from mrmg.scene.loading.wheel_consistency import LENGTH_SHARE, PLACE_M

_ALONG = 0.9
"""Least share of a joint's axis along z (steering), or y (wheels)."""

_GROUND_SHARE = 0.3
"""How far above the ground wheels and supports may end, as a share of the radius."""

_SWIVEL = re.compile("caster|castor|swivel", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Wheel:
    """A wheel, or several of one side as one in their middle.

    Attributes:
        place_m: of its centre, shape (3,).
        radius_m: of its tyre.
        mass_kg: of what turns.
        inertia: about its axis and across it [kg m^2], shape (2,).
        armature: inertia of its drive, about the axis [kg m^2].
        names: of its joints.
        bodies: that turn with it.
    """

    place_m: np.ndarray
    radius_m: float
    mass_kg: float
    inertia: np.ndarray
    armature: float
    names: tuple[str, ...]
    bodies: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Survey:
    """A robot as measured in its description.

    Attributes:
        bodies: of the robot, as numbered in its description.
        driven: left and right wheel of the fixed axle.
        steered: left and right steered wheel; none of a differential drive.
        steering_rad: least range of the steering joints to either side.
        origin_m: of the robot's frame in that of the description, shape (3,).
        mass_kg: of the whole robot.
        chassis: mass [kg], centre [m] and inertia [kg m^2] of all but the wheels.
        box_m: least and greatest corner of its shapes, shape (2, 3).
        supports_m: x of what else stands on the ground.
        lead_m: by which the centre of all masses is ahead of the axle.
        notes: what was assumed of its parts.
    """

    bodies: tuple[int, ...]
    driven: tuple[Wheel, Wheel]
    steered: tuple[Wheel, ...]
    steering_rad: float
    origin_m: np.ndarray
    mass_kg: float
    chassis: tuple[float, np.ndarray, np.ndarray]
    box_m: np.ndarray
    supports_m: tuple[float, ...]
    lead_m: float
    notes: tuple[str, ...]


class _Scan:
    """A compiled description at rest."""

    def __init__(self, description: Description) -> None:
        self.model, self.data = description.model, description.data

    @cached_property
    def hinges(self) -> dict[str, int]:
        """Joints that turn, by name."""
        from mrmg.mujoco_import import mujoco

        hinge = mujoco.mjtJoint.mjJNT_HINGE
        return {
            self.model.joint(at).name or f"#{at}": at
            for at in range(self.model.njnt)
            if self.model.jnt_type[at] == hinge
        }

    def is_along(self, joint: int, axis: str) -> bool:
        """Return whether a joint turns about an axis: x, y or z."""
        return bool(abs(self.data.xaxis[joint]["xyz".index(axis)]) > _ALONG)

    def above(self, joint: int) -> list[int]:
        """Return the hinges between a joint's body and the root, nearest first."""
        found, body = [], int(self.model.jnt_bodyid[joint])
        while body:
            first, count = self.model.body_jntadr[body], self.model.body_jntnum[body]
            found += [at for at in range(first, first + count) if at != joint]
            body = int(self.model.body_parentid[body])
        return [at for at in found if at in self.hinges.values()]

    def subtree(self, joint: int) -> tuple[int, ...]:
        """Return the bodies that a joint moves."""
        moved = {int(self.model.jnt_bodyid[joint])}
        for body in range(1, self.model.nbody):
            if int(self.model.body_parentid[body]) in moved:
                moved.add(body)
        return tuple(sorted(moved))

    def corners(self, geoms: Iterable[int]) -> np.ndarray:
        """Return least and greatest corners of the boxes about geoms, shape (n, 3)."""
        axes = np.eye(3)
        points = [
            [end * support_m(self.model, self.data, geom, end * axis) for axis in axes]
            for geom in geoms
            for end in (-1.0, 1.0)
        ]
        corners = np.array(points).reshape(-1, 3)
        return np.asarray(corners[np.isfinite(corners).all(axis=1)])

    def geoms(self, bodies: Sequence[int]) -> list[int]:
        """Return the shapes of bodies that collide; drawn ones if none does."""
        own = np.isin(self.model.geom_bodyid, bodies)
        solid = own & ((self.model.geom_contype | self.model.geom_conaffinity) != 0)
        return list(np.flatnonzero(solid if solid.any() else own).tolist())

    def mass(self, bodies: Sequence[int]) -> tuple[float, np.ndarray, np.ndarray]:
        """Return mass, centre and inertia about it of bodies that move as one."""
        model, data, bodies = self.model, self.data, list(bodies)
        mass = model.body_mass[bodies]
        total = float(mass.sum())
        if total <= 0.0:
            return 0.0, np.zeros(3), np.zeros((3, 3))
        places = data.xipos[bodies]
        center = mass @ places / total
        inertia = np.zeros((3, 3))
        for body, own, place in zip(bodies, mass, places, strict=True):
            turn = data.ximat[body].reshape(3, 3)
            arm = place - center
            inertia += turn @ np.diag(model.body_inertia[body]) @ turn.T
            inertia += own * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        return total, center, inertia

    def wheel(self, joint: int) -> Wheel | None:
        """Return the wheel that turns about a joint, if it has a shape."""
        bodies = self.subtree(joint)
        points = self.corners(self.geoms(bodies)) - self.data.xanchor[joint]
        if not len(points):
            return None
        mass, _, inertia = self.mass(bodies)
        axis = self.data.xaxis[joint]
        spin = float(axis @ inertia @ axis)
        across = 0.5 * (float(np.trace(inertia)) - spin)
        name = next(name for name, at in self.hinges.items() if at == joint)
        radius = float(-points[:, 2].min())
        place = np.array(self.data.xanchor[joint])
        armature = float(self.model.dof_armature[self.model.jnt_dofadr[joint]])
        own = np.array([spin, across])
        return Wheel(place, radius, mass, own, armature, (name,), bodies)


def survey(
    description: Description, source: str, drive: Sequence[str], steer: Sequence[str]
) -> Survey:
    """Measure a robot.

    Args:
        description: of the robot.
        source: what error messages call it.
        drive: joints of the driven wheels, left and right; () to find them.
        steer: joints that steer, left and right; () to find them.

    Raises:
        SceneError: if its wheels are not found; names the joints there are.
    """
    scan = _Scan(description)
    _require_known(scan, source, (*drive, *steer))
    fixed, steered, steering = _wheels(scan, drive, steer)
    left = [wheel for wheel in fixed if wheel.place_m[1] > _middle_y(fixed)]
    right = [wheel for wheel in fixed if wheel not in left]
    if not left or len(left) != len(right) or len(steered) not in (0, 2):
        raise SceneError(source, [Fault("joints", _not_found(scan, fixed, steered))])
    driven = (_as_one(left), _as_one(right))
    if steered:
        _require_car(driven, steered, source)
    notes = []
    if len(fixed) > 2:
        notes.append(
            f"{len(fixed)} wheels that do not steer were taken as one pair in their "
            "middle; what their scrubbing costs is to be calibrated (mrmg calibrate)"
        )
    middle = np.mean([wheel.place_m for wheel in driven], axis=0)
    radius = float(np.mean([wheel.radius_m for wheel in driven]))
    origin = middle - [0.0, 0.0, radius]
    turning = {body for wheel in (*fixed, *steered) for body in wheel.bodies}
    bodies = _tree_of(turning, description.model, source)
    still = [body for body in bodies if body not in turning]
    whole = scan.mass(bodies)
    own = scan.mass(still)
    if own[0] <= 0.0:
        message = "its chassis has no mass; state <inertial> of its links"
        raise SceneError(source, [Fault("mass", message)])
    points = scan.corners(scan.geoms(bodies)) - origin
    return Survey(
        bodies=bodies,
        driven=_moved(driven, origin),
        steered=_moved(sorted(steered, key=lambda wheel: -wheel.place_m[1]), origin),
        steering_rad=steering,
        origin_m=origin,
        mass_kg=whole[0],
        chassis=(own[0], own[1] - origin, own[2]),
        box_m=np.stack([points.min(axis=0), points.max(axis=0)]),
        supports_m=tuple(_supports(scan, still, origin, radius)),
        lead_m=float(whole[1][0] - origin[0]),
        notes=tuple(notes),
    )


def _tree_of(bodies: Collection[int], model: Any, source: str) -> tuple[int, ...]:
    """Return all bodies of the robot that some of them belong to."""
    roots = {int(model.body_rootid[body]) for body in bodies}
    if len(roots) > 1:
        names = ", ".join(model.body(root).name or f"#{root}" for root in sorted(roots))
        message = f"has the wheels of {len(roots)} robots ({names}); leave one in it"
        raise SceneError(source, [Fault("bodies", message)])
    return tuple(np.flatnonzero(np.isin(model.body_rootid, list(roots))).tolist())


def _wheels(
    scan: _Scan, drive: Sequence[str], steer: Sequence[str]
) -> tuple[list[Wheel], list[Wheel], float]:
    """Return wheels that do not steer, those that do, and the range of steering."""
    fixed, steered, ranges = [], [], []
    across = [at for at in scan.hinges.values() if scan.is_along(at, "y")]
    wheels = [(at, wheel) for at in across if (wheel := scan.wheel(at)) is not None]
    ground = min((w.place_m[2] - w.radius_m for _, w in wheels), default=0.0)
    for joint, wheel in wheels:
        name, hinges = wheel.names[0], scan.above(joint)
        upright = [at for at in hinges if scan.is_along(at, "z")]
        limited = [at for at in upright if scan.model.jnt_limited[at]]
        bottom = wheel.place_m[2] - wheel.radius_m - ground
        if drive and name in drive:
            fixed.append(wheel)
        elif steer and any(scan.hinges[own] in upright for own in steer):
            steered.append(wheel)
            ranges += [scan.model.jnt_range[scan.hinges[own]] for own in steer]
        elif not steer and limited and not _SWIVEL.search(name):
            steered.append(wheel)
            ranges.append(scan.model.jnt_range[limited[0]])
        elif (
            not drive
            and not upright
            and not scan.model.jnt_limited[joint]
            and not _SWIVEL.search(name)
            and bottom < _GROUND_SHARE * wheel.radius_m
        ):
            fixed.append(wheel)
    reach = [min(-low, high) for low, high in ranges if low < high]
    return fixed, steered, float(min(reach, default=np.pi / 4))


def _require_known(scan: _Scan, source: str, names: Sequence[str]) -> None:
    unknown = [name for name in names if name not in scan.hinges]
    if unknown:
        message = f"no hinge joint '{unknown[0]}'; there are: {_listed(scan)}"
        raise SceneError(source, [Fault("joints", message)])


def _listed(scan: _Scan) -> str:
    return ", ".join(scan.hinges) or "none"


def _not_found(scan: _Scan, fixed: Sequence[Wheel], steered: Sequence[Wheel]) -> str:
    found = ", ".join(wheel.names[0] for wheel in (*fixed, *steered)) or "none"
    return (
        "expected as many wheels on the left as on the right, and two that steer or "
        f"none; found {found}. --drive LEFT RIGHT, and --steer LEFT RIGHT for the "
        f"joints that steer, name them; hinge joints: {_listed(scan)}"
    )


def _require_car(
    driven: Sequence[Wheel], steered: Sequence[Wheel], source: str
) -> None:
    """Refuse what no model of a car can have: two tracks, or no wheelbase."""
    (track_m, axle_m), (steered_m, front_m) = (
        (abs(left[1] - right[1]), 0.5 * (left[0] + right[0]))
        for left, right in ([w.place_m for w in pair] for pair in (driven, steered))
    )
    if abs(track_m - steered_m) > LENGTH_SHARE * (track_m + steered_m):
        message = (
            f"its driven wheels are {track_m:.4g} m apart, those that steer "
            f"{steered_m:.4g} m; a model of a car has one track, which both must be "
            f"within {LENGTH_SHARE:.0%} of: make them equal in a copy of the file"
        )
    elif front_m - axle_m <= PLACE_M:
        message = (
            f"its steered wheels are at x = {front_m:.4g} m, its driven axle is at "
            f"{axle_m:.4g} m; a model of a car steers ahead of the driven axle"
        )
    else:
        return
    raise SceneError(source, [Fault("joints", message)])


def _middle_y(wheels: Sequence[Wheel]) -> float:
    across = [wheel.place_m[1] for wheel in wheels]
    return 0.5 * (min(across, default=0.0) + max(across, default=0.0))


def _as_one(wheels: Sequence[Wheel]) -> Wheel:
    return Wheel(
        np.mean([wheel.place_m for wheel in wheels], axis=0),
        float(np.mean([wheel.radius_m for wheel in wheels])),
        sum(wheel.mass_kg for wheel in wheels),
        np.sum([wheel.inertia for wheel in wheels], axis=0),
        sum(wheel.armature for wheel in wheels),
        tuple(name for wheel in wheels for name in wheel.names),
        tuple(body for wheel in wheels for body in wheel.bodies),
    )


def _moved(wheels: Sequence[Wheel], origin: np.ndarray) -> Any:
    return tuple(replace(w, place_m=w.place_m - origin) for w in wheels)


def _supports(
    scan: _Scan, bodies: Sequence[int], origin: np.ndarray, radius: float
) -> Iterable[float]:
    """Yield x of shapes of the chassis that reach down to the ground."""
    for geom in scan.geoms(bodies):
        points = scan.corners([geom]) - origin
        if len(points) and points[:, 2].min() < _GROUND_SHARE * radius:
            low, high = points.min(axis=0), points.max(axis=0)
            if high[2] - low[2] < 2.0 * radius:
                yield float(0.5 * (low[0] + high[0]))
