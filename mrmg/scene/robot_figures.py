"""The figures of a robot model that a person wants to see."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from mrmg.scene.driven_parts import why_not_driven
from mrmg.scene.robot_model import RobotModel

_MOTIONS = {
    "car": "car: front steering, rear drive",
    "unicycle": "unicycle: two driven wheels",
}

_AS_STATED = (
    *("motion_model", "mass_kg", "height_m", "wheelbase_m", "track_m"),
    *("wheel_radius_m", "planning_share", "battery_capacity_J"),
)
"""Figures that are values of the model."""


def robot_figures(model: RobotModel) -> dict[str, Any]:
    """Return the figures of a model as JSON data, by names with units."""
    length_m, width_m = np.ptp(model.footprint_m, axis=0).tolist()
    plain_J_per_m = model.energy_model.plain_ground_J_per_m()
    full_lock_m = None
    if model.motion_model == "car":
        full_lock_m = model.wheelbase_m / math.tan(model.limits.w_max)
    return {
        **{name: getattr(model, name) for name in _AS_STATED},
        **asdict(model.limits),
        "length_m": round(length_m, 9),
        "width_m": round(width_m, 9),
        "turning_radius_m": model.turning_radius_m,
        "turning_radius_at_full_lock_m": full_lock_m,
        "plain_ground_J_per_m": plain_J_per_m,
        "battery_range_m": model.battery_capacity_J / plain_J_per_m,
        "mjcf": None if model.mjcf is None else model.mjcf.name,
        "only_planned_for": why_not_driven(model),
    }


def figure_lines(model: RobotModel) -> list[str]:
    """Return the figures as lines of text, named on the left."""
    found = robot_figures(model)
    limits, share = model.limits, model.planning_share
    car = model.motion_model == "car"
    second, rate = ("steering", "rad/s") if car else ("turning", "rad/s^2")
    turning = "turns on the spot"
    if found["turning_radius_at_full_lock_m"] is not None:
        turning = f"{found['turning_radius_m']:.2f} m in plans, "
        turning += f"{found['turning_radius_at_full_lock_m']:.2f} m at full lock"
    elif model.has_custom_motion:
        turning = "by its own motion"
    reason = found["only_planned_for"]
    driven = f"driven by {found['mjcf']}, which agrees with robot.yaml"
    if reason is not None:
        driven = f"has {reason}: can be planned for, but not driven"
    consumed = model.consumed_per_m(model.planned_limits.v_max_m_s)
    with_consumers = ""
    if consumed > 0.0:
        least_m = found["battery_range_m"] / (1.0 + consumed)
        with_consumers = f", {least_m:.0f} m with what its consumers draw at top speed"
    rows = {
        "motion": _MOTIONS.get(model.motion_model, model.motion_model),
        "mass": f"{model.mass_kg:g} kg",
        "footprint": f"{found['length_m']:g} x {found['width_m']:g} m, "
        f"{model.height_m:g} m high, {len(model.footprint_m)} corners",
        "wheels": f"{model.wheel_count} of {model.wheel_radius_m:g} m radius, "
        f"wheelbase {model.wheelbase_m:g} m, track {model.track_m:g} m",
        "top speed": f"{limits.v_max_m_s:g} m/s, backwards {-limits.v_min_m_s:g} m/s; "
        f"plans use {share:.0%} of all limits",
        "limits": f"{limits.u1_max_m_s2:g} m/s^2, {second} {limits.w_max:g} "
        f"{'rad' if car else 'rad/s'} at {limits.u2_max:g} {rate}",
        "turning radius": turning,
        "plain ground": f"{found['plain_ground_J_per_m']:.4g} J/m",
        "battery": f"{model.battery_capacity_J / 1000:g} kJ: "
        f"{found['battery_range_m']:.0f} m of plain ground{with_consumers}",
        "simulation": driven,
    }
    return [f"{name:<15}{text}" for name, text in rows.items()]
