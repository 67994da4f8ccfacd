"""Yaw rates on circles, driven alone on plain ground, against the kinematic model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from protocol import Row

from mrmg import shipped
from mrmg.mujoco_import import mujoco
from mrmg.scene.loading.models import load_model
from mrmg.scene.robot_model import Limits, RobotModel
from mrmg.simulation.log import ExecutionLog
from mrmg.studies.calibration.manoeuvres import CRUISE_S, STEP_S, circle
from mrmg.studies.calibration.measurement import drive, yaw_rate
from physics.figures import Figure, verdict

YAW_ERROR_PCT = 0.5

SPEEDS_M_S = (0.5, 1.0, 2.0, 3.0)
STEERS_RAD = (0.05, 0.2, 0.35, 0.5)
TURN_RATES_RAD_S = (0.2, 0.5, 1.0)


def yaw_figures() -> tuple[list[Figure], list[Row]]:
    """Print the error of the yaw rate over speed and turn; return the worst, and rows.

    Robots get the limits that the table's speeds and angles take.
    """
    speeds = " | ".join(f"{speed:g} m/s" for speed in SPEEDS_M_S)
    print(f"\nyaw rate against the kinematic model [%] | {speeds} | ")
    rows: list[Row] = []
    for name in shipped.model_names():
        model, _ = load_model(shipped.models_folder() / name)
        spins = model.motion_model == "unicycle"
        for turn in TURN_RATES_RAD_S if spins else STEERS_RAD:
            errors = [yaw_error_pct(model, speed, turn) for speed in SPEEDS_M_S]
            worst = max(map(abs, errors))
            faults = [f"{worst:.2f} > {YAW_ERROR_PCT}"] if worst > YAW_ERROR_PCT else []
            unit = "rad/s" if spins else "rad"
            shown = [f"{name} {turn:g} {unit}", *(f"{item:+.3f}" for item in errors)]
            print(" | ".join([*shown, verdict(faults)]), flush=True)
            circle_row: Row = {"robot": name, "turn": turn, "unit": unit}
            circle_row |= {"speeds_m_s": SPEEDS_M_S, "errors_pct": errors}
            rows.append(circle_row | {"worst_pct": worst})
    worst = max(row["worst_pct"] for row in rows)
    return [Figure.at_most("yaw rate, worst circle", worst, YAW_ERROR_PCT, " %")], rows


def yaw_error_pct(model: RobotModel, speed_m_s: float, turn: float) -> float:
    """Return by how much a robot turns faster than its wheels say, on a circle."""
    limits = Limits(
        v_min_m_s=0.0,
        v_max_m_s=1.2 * speed_m_s,
        w_max=max(1.2 * turn, model.limits.w_max),
        u1_max_m_s2=model.limits.u1_max_m_s2,
        u2_max=model.limits.u2_max,
    )
    ready = replace(model, limits=limits)
    course = circle(ready, limits, speed_m_s, turn)
    log = drive(ready, course)
    before = [piece.name for piece in course.pieces].index("cruise")
    start_s = STEP_S * sum(piece.steps for piece in course.pieces[:before])
    late_s = start_s + CRUISE_S * np.array([0.5, 1.0])
    first, last = np.searchsorted(log.clock_s, late_s)
    turned = float(log.state[0, last, 2] - log.state[0, first, 2])
    return 100.0 * (turned / rolled_rad(ready, log, first, last) - 1.0)


def rolled_rad(model: RobotModel, log: ExecutionLog, first: int, last: int) -> float:
    """Return the angle the robot turned between two ticks, by what its wheels did."""
    if model.motion_model == "unicycle":
        mjcf = mujoco.MjModel.from_xml_path(str(model.mjcf))
        left, right = (
            np.ptp(log.qpos[[first, last], mjcf.joint(f"spin_{side}").qposadr[0]])
            for side in "lr"
        )
        return float((right - left) * model.wheel_radius_m / model.track_m)
    rate = yaw_rate(model, log.state[0, first : last + 1])
    return float(np.trapezoid(rate, log.time_s[first : last + 1]))
