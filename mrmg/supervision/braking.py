"""How one robot comes to rest soonest: full braking, steering held."""

from __future__ import annotations

import math

import numpy as np

from mrmg.motion.dynamics import DERIVATIVES, rk4_step
from mrmg.scene.robot_model import RobotModel

_REST = 1e-9


def brake_to_rest(
    model: RobotModel, state: np.ndarray, dt_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the motion of full braking, and of straightening the wheels after it.

    Args:
        model: of the robot; it brakes at the planner's share of its limits.
        state: (x, y, theta, v, psi) at the beginning, shape (5,).
        dt_s: length of a step.

    Returns:
        States after each step, shape (n, 5), and controls of each step, shape (n, 2).
    """
    limits = model.limits.scaled(model.planning_share)
    step = rk4_step(DERIVATIVES[model.motion_model](math.sin, math.cos, math.tan))
    turns_on_the_spot = model.motion_model == "unicycle"
    states, controls = [tuple(float(value) for value in state)], []
    while _moving(states[-1][3]) or _moving(states[-1][4]):
        v, w = states[-1][3:]
        u1 = _toward_zero(v, limits.u1_max_m_s2, dt_s)
        # A car holds its steering until it stands.
        free = turns_on_the_spot or not _moving(v)
        u2 = _toward_zero(w, limits.u2_max, dt_s) if free else 0.0
        states.append(step(states[-1], (u1, u2), model.wheelbase_m, dt_s))
        controls.append((u1, u2))
    return (
        np.array(states[1:], float).reshape(-1, 5),
        np.array(controls, float).reshape(-1, 2),
    )


def _moving(rate: float) -> bool:
    return abs(rate) > _REST


def _toward_zero(value: float, bound: float, dt_s: float) -> float:
    return max(-bound, min(bound, -value / dt_s))
