"""Whether the wheels and actuators of an MJCF are those that `robot.yaml` describes."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mrmg.energy.model import GRAVITY_M_S2
from mrmg.errors import Fault
from mrmg.scene.driven_parts import DrivenParts
from mrmg.scene.loading.mjcf import CompiledRobot
from mrmg.scene.robot_model import RobotModel

INERTIA_SHARE = 0.05
"""Allowed difference of the effective mass by the inertia of the wheels: it counts only
when speeds change, and calibration may set it to what the robot was found to have."""

LENGTH_SHARE = 0.01
"""Allowed difference of wheelbase, track and wheel radius: of yaw rate and speed."""

PLACE_M = 0.01
"""How far the driven axle may be from the reference point, and wheels off the
footprint: half of the default noise of measured positions."""

FORCE_SHARE = 0.01
"""By how much less than what the limits require a drive may give."""

GRIP_SHARE_MISSING = 0.05
"""By how much less the simulated tyres may grip than `robot.yaml` says."""


def wheel_faults(
    model: RobotModel, robot: CompiledRobot, parts: DrivenParts
) -> Iterator[Fault]:
    """Yield differences of axles, wheels and tyres."""
    axle = np.mean([robot.place_m(name) for name in parts.spin], axis=0)
    if abs(axle[0]) > PLACE_M or abs(axle[1]) > PLACE_M:
        message = (
            f"the driven axle of {robot.file} is at ({axle[0]:.4g}, {axle[1]:.4g}) m; "
            f"it must be at the chassis' origin (allowed: {PLACE_M:g} m)"
        )
        yield Fault("mjcf", message)
    lengths = [("track", model.track_m, _gap_m(robot, parts.spin))]
    if parts.steer:
        front = np.mean([robot.place_m(name) for name in parts.steer], axis=0)
        lengths += [
            ("wheelbase", model.wheelbase_m, float(front[0] - axle[0])),
            ("track", model.track_m, _gap_m(robot, parts.steer)),
        ]
    lengths += [
        ("wheel.radius", model.wheel_radius_m, robot.radius_m(name))
        for name in robot.wheels
    ]
    yield from dict.fromkeys(  # wheels that are wrong alike are one fault
        difference(key, stated_m, found_m, "m", f"{LENGTH_SHARE:.0%}", robot.file)
        for key, stated_m, found_m in lengths
        if apart(found_m, stated_m, LENGTH_SHARE * stated_m)
    )
    yield from _tendons(model, robot, parts)
    yield from _spin(model, robot)
    grip = min(robot.grip(name) for name in parts.spin)
    if grip < (1.0 - GRIP_SHARE_MISSING) * model.friction_coefficient:
        yield difference(
            "friction_coefficient",
            model.friction_coefficient,
            grip,
            "for driven tyres",
            f"{GRIP_SHARE_MISSING:.0%} less",
            robot.file,
        )


def _gap_m(robot: CompiledRobot, pair: tuple[str, ...]) -> float:
    left, right = (robot.place_m(name)[1] for name in pair)
    return float(left - right)


def _tendons(
    model: RobotModel, robot: CompiledRobot, parts: DrivenParts
) -> Iterator[Fault]:
    """Yield tendons whose lengths are not the ways rolled that they stand for."""
    radius_m = model.wheel_radius_m
    ways_m = ((radius_m / 2, radius_m / 2), (-radius_m, radius_m))
    for tendon, per_rad_m in zip(parts.tendons, ways_m, strict=False):
        for joint, wanted_m in zip(parts.spin, per_rad_m, strict=True):
            found_m = robot.tendon_per_rad_m(tendon, joint)
            if apart(found_m, wanted_m, LENGTH_SHARE * radius_m):
                yield Fault(
                    "wheel.radius",
                    f"with {radius_m:g} m, tendon '{tendon}' of {robot.file} must "
                    f"have a coefficient of {wanted_m:.4g} m for joint '{joint}', not "
                    f"{found_m:.4g} m (at most {LENGTH_SHARE:.0%} apart); correct "
                    "the one that is wrong",
                )


def _spin(model: RobotModel, robot: CompiledRobot) -> Iterator[Fault]:
    """Yield differences of the number of wheels, or else of their inertia."""
    count = len(robot.wheels)
    if count != model.wheel_count:
        stated = float(model.wheel_count)
        yield difference("wheel.count", stated, count, "wheels", "0", robot.file)
        return
    inertia = [robot.spin_inertia_kg_m2(name) for name in robot.wheels]
    mean_kg_m2 = float(np.mean(inertia))
    allowed_kg_m2 = (
        INERTIA_SHARE * model.effective_mass_kg * model.wheel_radius_m**2 / count
    )
    if apart(mean_kg_m2, model.wheel_inertia_kg_m2, allowed_kg_m2):
        yield difference(
            "wheel.inertia",
            model.wheel_inertia_kg_m2,
            mean_kg_m2,
            "kg m^2 a wheel",
            f"{allowed_kg_m2:.2g} kg m^2",
            robot.file,
        )


def steering_faults(
    model: RobotModel, robot: CompiledRobot, parts: DrivenParts
) -> Iterator[Fault]:
    """Yield what keeps the steered wheels from the angles that `w_max` asks for."""
    if not parts.steer:
        return
    tan_psi = math.tan(model.limits.w_max)
    inward = 1.0 - model.track_m / model.wheelbase_m / 2 * tan_psi
    psi = f"{model.limits.w_max:g} rad"
    if inward <= 0.0:
        message = f"{psi} would have the car turn about a point between its wheels"
        yield Fault("limits.w_max", f"{message}; lower it")
        return
    wanted = math.atan(tan_psi / inward)
    narrow: dict[tuple[float, float], list[str]] = {}
    for name in (*parts.steer, *parts.servos):
        joint = name in parts.steer
        low, high = (
            robot.joint_range_rad(name) if joint else robot.servo_range_rad(name)
        )
        if min(-low, high) < wanted * (1.0 - 1e-3):
            narrow.setdefault((low, high), []).append(name)
    for (low, high), names in narrow.items():
        yield Fault(
            "limits.w_max",
            f"{psi} asks the inner wheel for {wanted:.4g} rad, but {', '.join(names)} "
            f"of {robot.file} may only go from {low:.4g} to {high:.4g} rad; lower "
            "w_max or widen the range",
        )


def traction_faults(
    model: RobotModel, robot: CompiledRobot, parts: DrivenParts
) -> Iterator[Fault]:
    """Yield what keeps the drive from the acceleration that plans use."""
    limits = model.planned_limits
    energy = model.energy_model
    most_N = model.usable_grip * model.mass_kg * GRAVITY_M_S2
    needed_N = model.effective_mass_kg * limits.u1_max_m_s2 + energy.rolling_force_N
    asked = (
        f"{limits.u1_max_m_s2:.3g} m/s^2 (planning_share included) asks for "
        f"{{:.0f}} N of traction on plain ground, but "
    )
    if needed_N > most_N * (1.0 + FORCE_SHARE):
        yield Fault(
            "limits.u1_max",
            f"{asked.format(needed_N)}the drive control holds what tyres of friction "
            f"{model.friction_coefficient:g} transmit, {most_N:.0f} N; lower the limit",
        )
    # What scrub takes is fed forward without a limit; see `simulation.drive`.
    swing_Nm = robot.yaw_inertia_kg_m2() * limits.u2_max
    most_Nm = most_N * model.track_m / 2
    if not parts.steer and swing_Nm > most_Nm * (1.0 + FORCE_SHARE):
        yield Fault(
            "limits.u2_max",
            f"{limits.u2_max:.3g} rad/s^2 (planning_share included) asks for "
            f"{swing_Nm:.3g} N m about the upright axis of {robot.file}, but the drive "
            f"control holds what the tyres transmit, {most_Nm:.3g} N m; lower the "
            "limit",
        )
    asked_N = min(needed_N, most_N)
    share = len(parts.motors)
    groups = [parts.spin] if share == 1 else [(name,) for name in parts.spin]
    for motor, joints in zip(parts.motors, groups, strict=True):
        forward_N = robot.traction_N(motor, joints, most_N / share)
        backward_N = -robot.traction_N(motor, joints, -most_N / share)
        least_N = min(forward_N, backward_N)
        if least_N < asked_N / share * (1.0 - FORCE_SHARE):
            yield Fault(
                "limits.u1_max",
                f"{asked.format(asked_N / share)}actuator '{motor}' of {robot.file} "
                f"gives {least_N:.0f} N at most; lower the limit or strengthen the "
                "drive",
            )


def apart(found: float, stated: float, allowed: float) -> bool:
    """Return whether two values differ by more than is allowed, or one is NaN."""
    return not abs(found - stated) <= allowed + 1e-9


def difference(
    key: str, stated: float, found: float, unit: str, allowed: str, file: str
) -> Fault:
    """Return the fault of a value that both files state differently."""
    return Fault(
        key,
        f"robot.yaml says {stated:.6g} {unit}, {file} has {found:.6g} {unit} (allowed "
        f"difference: {allowed}); correct the one that is wrong",
    )
