"""Parameters of a robot model: what a description states, and what must be assumed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrmg.energy.model import GRAVITY_M_S2
from mrmg.scene.importing.robots.description import Description, JointLimit
from mrmg.scene.importing.robots.survey import Survey
from mrmg.scene.robot_model import DRIVEN_LOAD_SHARE, GRIP_SHARE

WHEEL_RATE_RAD_S = 6.5
"""Assumed rate of wheels at top speed: 1 m/s with wheels of 0.15 m."""

RANGE_M = 500.0
"""Range on plain ground that the assumed battery gives."""

_GRIP_USED = 0.6
"""Share of what the tyres transmit that the assumed accelerations ask for."""

_EFFORT_USED = 0.9
"""Share of the joints' effort limits that the assumed accelerations ask for."""

_START_TIME_S = 0.6
"""Time to the top speed, and to the full turning rate, where grip allows it."""

_MOST_FRICTION = 3.0
"""Friction from which on a description means tyres that never slip."""

_ROLLING, _TURNING, _FRICTION, _EFFICIENCY = 0.05, 0.015, 1.0, 0.85
"""As of the shipped models: firm tyres on firm soil, rubber on dry ground."""


@dataclass(frozen=True)
class Parameter:
    """A value of `robot.yaml`.

    Attributes:
        value: as the file has it.
        unit: of it.
        source: where it was read; None if it is assumed.
        reason: why the assumed value is as it is.
    """

    value: Any
    unit: str
    source: str | None
    reason: str = ""


def parameters_of(found: Survey, description: Description) -> dict[str, Parameter]:
    """Return the parameters of a model by the keys of `robot.yaml`.

    Those of wheel and limits are called "wheel.radius" and so on.
    """
    wheels = (*found.driven, *found.steered)
    radius = float(np.mean([wheel.radius_m for wheel in wheels]))
    pairs = [found.driven, found.steered] if found.steered else [found.driven]
    tracks_m = [abs(left.place_m[1] - right.place_m[1]) for left, right in pairs]
    track = float(np.mean(tracks_m))
    spin = float(np.mean([wheel.inertia[0] + wheel.armature for wheel in wheels]))
    low, high = found.box_m
    half_width = float(max(-low[1], high[1], track / 2))
    back, front = float(min(low[0], -radius)), float(max(high[0], radius))
    outline = [[back, -half_width], [front, -half_width], [front, half_width]]
    outline.append([back, half_width])
    shapes, joints = "its shapes", "its joints"
    values = {
        "footprint": Parameter(_rounded(outline), "m", shapes),
        "height": Parameter(_rounded(high[2]), "m", shapes),
        "wheelbase": _wheelbase(found, back, front),
        "track": Parameter(_rounded(track), "m", joints),
        "mass": Parameter(_rounded(found.mass_kg), "kg", "its links"),
        "center_of_mass": Parameter(_rounded(found.lead_m), "m", "its links"),
        "wheel.radius": Parameter(_rounded(radius), "m", shapes),
        "wheel.inertia": Parameter(_rounded(spin), "kg m^2", "its links"),
        "wheel.count": Parameter(len(wheels), "", joints),
        "wheel.mass": Parameter(
            _rounded(np.mean([wheel.mass_kg for wheel in wheels])), "kg", "its links"
        ),
    }
    friction = _friction(found, description)
    values |= _limits(found, description.limits, radius, track, friction.value)
    share = "the controller keeps 15 % of every limit to correct with"
    push_N = _ROLLING * found.mass_kg * GRAVITY_M_S2
    capacity = push_N / _EFFICIENCY * RANGE_M
    return values | {
        "planning_share": Parameter(0.85, "", None, share),
        "rolling_coefficient": _numeric(description, "rolling_coefficient", _ROLLING),
        "turning_coefficient": _numeric(description, "turning_coefficient", _TURNING),
        "friction_coefficient": friction,
        "drive_efficiency": Parameter(_EFFICIENCY, "", None, "motor, gear, inverter"),
        "regeneration_efficiency": Parameter(0.0, "", None, "brakes by friction"),
        "idle_power": Parameter(0.0, "W", None, "not fed by this battery"),
        "battery_capacity": Parameter(
            _rounded(capacity), "J", None, f"{RANGE_M:g} m of plain ground"
        ),
    }


def _limits(
    found: Survey,
    limits: Mapping[str, JointLimit],
    radius: float,
    track: float,
    friction: float,
) -> dict[str, Parameter]:
    own = [limits.get(name, JointLimit()) for w in found.driven for name in w.names]
    rate = min(limit.speed_rad_s for limit in own)
    speed = (WHEEL_RATE_RAD_S if math.isinf(rate) else rate) * radius
    read = None if math.isinf(rate) else "its joints' velocity limit"
    slow = f"wheels at {WHEEL_RATE_RAD_S:g} rad/s"
    grip = GRIP_SHARE * DRIVEN_LOAD_SHARE * friction * GRAVITY_M_S2
    rolling_N = _ROLLING * found.mass_kg * GRAVITY_M_S2
    push_N = _GRIP_USED * (grip * found.mass_kg - rolling_N)
    effort_N = _EFFORT_USED * sum(limit.effort_Nm for limit in own) / radius - rolling_N
    held = "what tyres hold"
    if 0.0 < effort_N < push_N:
        push_N, held = effort_N, "what tyres and its joints' effort limit hold"
    turning = sum(w.inertia[0] + w.armature for w in (*found.driven, *found.steered))
    push = push_N / (found.mass_kg + turning / radius**2)
    values = {
        "limits.v_min": Parameter(_rounded(-speed / 2), "m/s", None, "half as fast"),
        "limits.v_max": Parameter(_rounded(speed), "m/s", read, "" if read else slow),
        "limits.u1_max": Parameter(
            _rounded(min(push, speed / _START_TIME_S)), "m/s^2", None, held
        ),
    }
    if found.steered:
        length = float(np.mean([wheel.place_m[0] for wheel in found.steered]))
        inner = math.tan(0.98 * min(found.steering_rad, 1.2))
        turn = math.atan(inner / (1.0 + 0.5 * track / length * inner))
        where = "its steering joints' range, which the inner wheel uses up"
        values["limits.w_max"] = Parameter(_rounded(turn), "rad", where)
        rate, unit = turn / _START_TIME_S, "rad/s"
    else:
        turn = speed / track
        reason = "half of what the wheels allow on the spot"
        values["limits.w_max"] = Parameter(_rounded(turn), "rad/s", None, reason)
        moment = _GRIP_USED * grip * found.mass_kg * track / 2
        rate = min(turn / _START_TIME_S, moment / _yaw_inertia(found))
        unit = "rad/s^2"
    values["limits.u2_max"] = Parameter(_rounded(rate), unit, None, "full in 0.6 s")
    return values


def _numeric(description: Description, name: str, assumed: float) -> Parameter:
    model = description.model
    stated = [model.numeric(at) for at in range(model.nnumeric)]
    found = [float(item.data[0]) for item in stated if item.name == name]
    if found:
        return Parameter(_rounded(found[0]), "", f"its numeric '{name}'")
    return Parameter(assumed, "", None, "firm tyre on firm soil, as of shipped models")


def _friction(found: Survey, description: Description) -> Parameter:
    names = [description.model.body(b).name for w in found.driven for b in w.bodies]
    stated = [description.friction[n] for n in names if n in description.friction]
    if stated and min(stated) < _MOST_FRICTION:
        return Parameter(_rounded(min(stated)), "", "its wheels' friction")
    return Parameter(_FRICTION, "", None, "rubber on dry ground")


def _yaw_inertia(found: Survey) -> float:
    mass, center, inertia = found.chassis
    wheels = sum(
        wheel.inertia[1] + wheel.mass_kg * float(wheel.place_m[:2] @ wheel.place_m[:2])
        for wheel in found.driven
    )
    return float(inertia[2, 2] + mass * (center[:2] @ center[:2]) + wheels)


def _wheelbase(found: Survey, back: float, front: float) -> Parameter:
    if found.steered:
        length = float(np.mean([wheel.place_m[0] for wheel in found.steered]))
        return Parameter(_rounded(length), "m", "its joints")
    supports = [abs(x) for x in found.supports_m if abs(x) > 1e-3]
    if supports:
        length = max(supports)
        return Parameter(_rounded(length), "m", "its supports: driven axle to caster")
    reason = "driven axle to the farther end of the footprint; no caster was found"
    return Parameter(_rounded(max(-back, front)), "m", None, reason)


def _rounded(value: Any) -> Any:
    """Return numbers with six significant digits."""
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return float(f"{float(value):.6g}") + 0.0
