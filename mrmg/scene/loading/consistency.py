"""Whether `robot.yaml` and the MJCF of a model describe the same robot.

The planner, the drive control and the energy model go by `robot.yaml`, the simulation
by the MJCF. What both state must agree; all differences are faults of the model. The
coefficients of rolling and turning are not compared: those of the MJCF are what the
tyres lose, those of `robot.yaml` what is believed, and calibration finds the former.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mrmg.errors import Fault
from mrmg.scene.driven_parts import (
    CHASSIS,
    HULL,
    HULL_BIT,
    NUMERICS,
    OBSTACLE_BIT,
    PARTS,
    ROOT,
    DrivenParts,
)
from mrmg.scene.loading.mjcf import CompiledRobot, no_warning_file
from mrmg.scene.loading.wheel_consistency import (
    LENGTH_SHARE,
    PLACE_M,
    apart,
    difference,
    steering_faults,
    traction_faults,
    wheel_faults,
)
from mrmg.scene.robot_model import RobotModel

MASS_SHARE = 0.01
"""Allowed difference of mass. Planned energy is proportional to
mass, and measured within 2 % of it; half of that may come from the model. Of all wheels
together the masses may differ by as much."""

HULL_BEYOND_M = 0.005
"""How far the hull may reach beyond the footprint: a third of how far robots as
modelled stray from their plans, which is what clearances have to take in anyway."""

FOOTPRINT_BEYOND_SHARE, FOOTPRINT_BEYOND_M = 0.1, 0.1
"""How far the footprint may reach beyond the hull, as a share of its extent that way
and at least: padding is sensible, gaps given up for nothing are not."""

HEIGHT_SHARE = 0.05
"""Allowed difference of heights, which decide what is drawn and what a robot that
broke down is as an obstacle."""

CENTER_SHARE = 0.02
"""Allowed difference of the centre of mass, as a share of the wheelbase: it is where
the height of the ground counts."""

_AXIS_COSINE = 0.999


@no_warning_file()
def mjcf_faults(
    model: RobotModel,
    path: Path,
    wheel_mass_kg: float | None = None,
    *,
    center_stated: bool = True,
) -> list[Fault]:
    """Return what keeps a model from being driven, and where its two files differ.

    Args:
        model: as `robot.yaml` has it; its motion is one of `PARTS`.
        path: of the MJCF file.
        wheel_mass_kg: what `robot.yaml` states of one wheel, which no model holds.
        center_stated: whether `robot.yaml` states the centre of mass.
    """
    try:
        robot = CompiledRobot(path)
    except (ValueError, OSError) as error:
        reason = " ".join(str(error).split())
        return [Fault("mjcf", f"MuJoCo cannot use {path.name}: {reason}")]
    parts = PARTS[model.motion_model]
    missing = [
        _missing(robot.file, kind, name)
        for kind, name in _needed(parts)
        if not robot.has(kind, name)
    ]
    if missing:
        return missing
    wrong = list(_wrong_parts(robot, parts))
    if wrong:
        return wrong
    return [
        *_mass(model, robot, center_stated),
        *_wheel_mass(model, robot, wheel_mass_kg),
        *_hull(model, robot, parts),
        *wheel_faults(model, robot, parts),
        *steering_faults(model, robot, parts),
        *traction_faults(model, robot, parts),
    ]


def _needed(parts: DrivenParts) -> Iterator[tuple[str, str]]:
    yield from (("body", CHASSIS), ("joint", ROOT), ("geom", HULL))
    yield from (("joint", name) for name in (*parts.spin, *parts.steer))
    yield from (("actuator", name) for name in (*parts.motors, *parts.servos))
    yield from (("tendon", name) for name in parts.tendons)
    yield from (("numeric", name) for name in NUMERICS)


def _missing(file: str, kind: str, name: str) -> Fault:
    message = f"{file} has no {kind} '{name}', which a robot of its kind needs"
    if kind == "numeric":
        message += (
            f'; add <custom><numeric name="{name}" data="..."/></custom>: the force '
            "over the weight that the simulated tyres lose"
        )
    return Fault("mjcf", message)


def _wrong_parts(robot: CompiledRobot, parts: DrivenParts) -> Iterator[Fault]:
    """Yield parts that are there, but not what the simulation takes them for."""
    if not robot.has_free_root():
        yield Fault("mjcf", f"joint '{ROOT}' must be a free joint of body '{CHASSIS}'")
    off_m = float(np.hypot(*robot.origin_m[:2]))
    if off_m > PLACE_M or robot.heading[0] < _AXIS_COSINE:
        x, y, _ = robot.origin_m
        message = f"body '{CHASSIS}' stands at ({x:g}, {y:g}) m; it must stand at "
        yield Fault("mjcf", message + "(0, 0) and look along x")
    for names, axis in ((parts.spin, (0, 1, 0)), (parts.steer, (0, 0, 1))):
        for name in names:
            found = robot.axis(name)
            if found @ axis < _AXIS_COSINE:
                is_axis = ", ".join(f"{value:.3g}" for value in found)
                message = f"joint '{name}' turns about ({is_axis})"
                message += f"; it must be a hinge about {axis}"
                yield Fault("mjcf", message)
    for name in parts.spin:
        if name not in robot.wheels and robot.axis(name)[1] >= _AXIS_COSINE:
            message = f"the wheel of joint '{name}' has no geom that touches the floor"
            yield Fault("mjcf", f"{message}; give its tyre conaffinity=1")
    for name in parts.motors:
        fault = robot.drive_fault(name)
        if fault:
            yield Fault("mjcf", f"actuator '{name}' {fault}")
    for name in parts.servos:
        if abs(robot.servo_gain(name) - 1.0) > LENGTH_SHARE:
            message = f"actuator '{name}' must be a position servo that holds the angle"
            yield Fault("mjcf", f"{message} of its control (gear 1)")
    if not robot.touches(HULL, HULL_BIT | OBSTACLE_BIT):
        message = f"obstacles and other robots cannot touch geom '{HULL}'; give it "
        yield Fault("mjcf", message + f"contype={HULL_BIT} conaffinity=6")
    for name in robot.touching():
        if name != HULL:
            message = f"obstacles can touch geom '{name}', but only touches of '{HULL}'"
            message += " are seen; let that one hold it, and give it conaffinity=0"
            yield Fault("mjcf", message)


def _mass(
    model: RobotModel, robot: CompiledRobot, center_stated: bool
) -> Iterator[Fault]:
    if abs(robot.mass_kg - model.mass_kg) > MASS_SHARE * model.mass_kg:
        yield difference(
            "mass", model.mass_kg, robot.mass_kg, "kg", f"{MASS_SHARE:.0%}", robot.file
        )
    allowed_m = CENTER_SHARE * model.wheelbase_m
    lead_m = robot.center_of_mass_m
    if center_stated and apart(lead_m, model.center_of_mass_m, allowed_m):
        yield difference(
            "center_of_mass",
            model.center_of_mass_m,
            lead_m,
            "m ahead of the driven axle",
            f"{allowed_m:.2g} m",
            robot.file,
        )


def _wheel_mass(
    model: RobotModel, robot: CompiledRobot, stated_kg: float | None
) -> Iterator[Fault]:
    mean_kg = float(np.mean([robot.wheel_mass_kg(name) for name in robot.wheels]))
    allowed_kg = MASS_SHARE * model.mass_kg / len(robot.wheels)
    if stated_kg is not None and apart(mean_kg, stated_kg, allowed_kg):
        allowed = f"{allowed_kg:.2g} kg"
        yield difference(
            "wheel.mass", stated_kg, mean_kg, "kg a wheel", allowed, robot.file
        )


def _hull(
    model: RobotModel, robot: CompiledRobot, parts: DrivenParts
) -> Iterator[Fault]:
    start = model.footprint_m
    edge = np.roll(start, -1, axis=0) - start
    start, edge = start[edge.any(axis=1)], edge[edge.any(axis=1)]
    normals = np.stack([edge[:, 1], -edge[:, 0]], axis=1)
    normals /= np.hypot(edge[:, 0], edge[:, 1])[:, None]
    wheels = [robot.place_m(name)[:2] for name in (*parts.spin, *parts.steer)]
    for normal, corner in zip(normals, start, strict=True):
        outline_m = float(normal @ corner)
        hull_m = robot.reach_m(HULL, normal)
        wheels_m = max(float(normal @ place) for place in wheels)
        allowed_m = max(
            FOOTPRINT_BEYOND_M, FOOTPRINT_BEYOND_SHARE * float(np.ptp(start @ normal))
        )
        if hull_m - outline_m > HULL_BEYOND_M:
            found = (
                f"the hull of {robot.file} reaches {hull_m:.4g} m: clearances would be "
                f"worth nothing (allowed: {HULL_BEYOND_M:g} m); enlarge the footprint "
                "or shrink the hull"
            )
        elif outline_m - hull_m > allowed_m:
            found = (
                f"the hull of {robot.file} reaches only {hull_m:.4g} m (allowed: "
                f"{allowed_m:.2g} m less); shrink the footprint or enlarge the hull"
            )
        elif wheels_m - outline_m > PLACE_M:
            found = (
                f"a wheel of {robot.file} stands at {wheels_m:.4g} m (allowed: "
                f"{PLACE_M:g} m more); enlarge the footprint"
            )
        else:
            continue
        ends = f"{_side(normal)} it ends {outline_m:.4g} m from the reference point"
        yield Fault("footprint", f"{ends}, but {found}")
    top_m = robot.reach_m(HULL, (0.0, 0.0, 1.0)) + float(robot.origin_m[2])
    if apart(top_m, model.height_m, HEIGHT_SHARE * model.height_m):
        allowed = f"{HEIGHT_SHARE:.0%}"
        yield difference("height", model.height_m, top_m, "m", allowed, robot.file)


def _side(normal: np.ndarray) -> str:
    """Return where a side of the footprint is that looks along `normal`."""
    x, y = normal
    if abs(x) < 0.1 or abs(y) < 0.1:
        if abs(x) > abs(y):
            return "in front" if x > 0 else "behind"
        return "on the left" if y > 0 else "on the right"
    return f"towards ({x:.2f}, {y:.2f})"
