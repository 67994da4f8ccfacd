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
    side = max(-low[1], high[1], track / 2)
    back, front = min(low[0], -radius), max(high[0], radius)
    outline = [[back, -side], [front, -side], [front, side], [back, side]]
    shapes, joints = "its shapes", "its joints"
    values = {
        "footprint": _read(outline, "m", shapes),
        "height": _read(high[2], "m", shapes),
        "wheelbase": _wheelbase(found, back, front),
        "track": _read(track, "m", joints),
        "mass": _read(found.mass_kg, "kg", "its links"),
        "center_of_mass": _read(found.lead_m, "m", "its links"),
        "wheel.radius": _read(radius, "m", shapes),
        "wheel.inertia": _read(spin, "kg m^2", "its links"),
        "wheel.count": Parameter(len(wheels), "", joints),
        "wheel.mass": _read(np.mean([w.mass_kg for w in wheels]), "kg", "its links"),
    }
    friction = _friction(found, description)
    values |= _limits(found, description.limits, radius, track, friction.value)
    share = "the controller keeps 15 % of every limit to correct with"
    push_N = _ROLLING * found.mass_kg * GRAVITY_M_S2
    capacity = push_N / _EFFICIENCY * RANGE_M
    return values | {
        "planning_share": _assumed(0.85, "", share),
        "rolling_coefficient": _numeric(description, "rolling_coefficient", _ROLLING),
        "turning_coefficient": _numeric(description, "turning_coefficient", _TURNING),
        "friction_coefficient": friction,
        "drive_efficiency": _assumed(_EFFICIENCY, "", "motor, gear, inverter"),
        "regeneration_efficiency": _assumed(0.0, "", "brakes by friction"),
        "idle_power": _assumed(0.0, "W", "not fed by this battery"),
        "battery_capacity": _assumed(capacity, "J", f"{RANGE_M:g} m of plain ground"),
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
        "limits.v_min": _assumed(-speed / 2, "m/s", "half as fast"),
        "limits.v_max": Parameter(_rounded(speed), "m/s", read, "" if read else slow),
        "limits.u1_max": _assumed(min(push, speed / _START_TIME_S), "m/s^2", held),
    }
    if found.steered:
        length = float(np.mean([wheel.place_m[0] for wheel in found.steered]))
        inner = math.tan(0.98 * min(found.steering_rad, 1.2))
        turn = math.atan(inner / (1.0 + 0.5 * track / length * inner))
        where = "its steering joints' range, which the inner wheel uses up"
        values["limits.w_max"] = _read(turn, "rad", where)
        rate, unit = turn / _START_TIME_S, "rad/s"
    else:
        turn = speed / track
        reason = "half of what the wheels allow on the spot"
        values["limits.w_max"] = _assumed(turn, "rad/s", reason)
        moment = _GRIP_USED * grip * found.mass_kg * track / 2
        rate = min(turn / _START_TIME_S, moment / _yaw_inertia(found))
        unit = "rad/s^2"
    values["limits.u2_max"] = _assumed(rate, unit, "full in 0.6 s")
    return values


def _numeric(description: Description, name: str, assumed: float) -> Parameter:
    model = description.model
    stated = [model.numeric(at) for at in range(model.nnumeric)]
    found = [float(item.data[0]) for item in stated if item.name == name]
    if found:
        return _read(found[0], "", f"its numeric '{name}'")
    return _assumed(assumed, "", "firm tyre on firm soil, as of shipped models")


def _friction(found: Survey, description: Description) -> Parameter:
    names = [description.model.body(b).name for w in found.driven for b in w.bodies]
    stated = [description.friction[n] for n in names if n in description.friction]
    if stated and min(stated) < _MOST_FRICTION:
        return _read(min(stated), "", "its wheels' friction")
    return _assumed(_FRICTION, "", "rubber on dry ground")


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
        return _read(length, "m", "its joints")
    supports = [abs(x) for x in found.supports_m if abs(x) > 1e-3]
    if supports:
        length = max(supports)
        return _read(length, "m", "its supports: driven axle to caster")
    reason = "driven axle to the farther end of the footprint; no caster was found"
    return _assumed(max(-back, front), "m", reason)


def _read(value: Any, unit: str, source: str) -> Parameter:
    return Parameter(_rounded(value), unit, source)


def _assumed(value: float, unit: str, reason: str) -> Parameter:
    return Parameter(_rounded(value), unit, None, reason)


def _rounded(value: Any) -> Any:
    """Return numbers with six significant digits."""
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return float(f"{float(value):.6g}") + 0.0
