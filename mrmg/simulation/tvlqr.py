"""Time-varying linear-quadratic regulator about the plan: a baseline without solver.

The discrete Riccati recursion runs backwards over the horizon,

    K = (R + B'PB)^-1 B'PA,    P <- Q + A'P(A - BK),

with A, B the motion model's derivatives at the reference; the correction is -K (x - r),
which knows no limits (they are imposed on the set-points).
"""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np

from mrmg.motion.dynamics import NU, NX
from mrmg.scene.robot_model import RobotModel
from mrmg.simulation.controller import HORIZON, HORIZON_STEP_S
from mrmg.simulation.riccati import STAGE, linearised_step

STATE_WEIGHTS = (10.0, 10.0, 4.0, 0.5, 0.5)
"""Per (x, y [1/m^2], theta [1/rad^2], v [s^2/m^2], psi [1/rad^2])."""

CONTROL_WEIGHTS = (0.5, 0.5)
"""Per (u1 [s^4/m^2], u2 [s^2/rad^2])."""


class Tvlqr:
    """Linear-quadratic tracking of one robot."""

    def __init__(self, model: RobotModel) -> None:
        """Set up the recursion for a robot of `model`."""
        self._gain = _first_gain(model.motion_model, model.wheelbase_m)

    def correct(self, state: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Return -K (x - r) with the gain of the horizon's first step."""
        control = np.diff(reference[:, 3:], axis=0) / HORIZON_STEP_S
        gain = self._gain(np.hstack([reference[:-1], control]).T).full()
        return np.asarray(-gain @ (state - reference[0]))


@cache
def _first_gain(motion_model: str, wheelbase_m: float) -> ca.Function:
    """Return states and controls, shape (7, N) -> K of the first step, shape (2, 5)."""
    step = linearised_step(motion_model, wheelbase_m)
    stages = ca.MX.sym("stages", STAGE, HORIZON)
    weight, effort = ca.diag(ca.DM(STATE_WEIGHTS)), ca.diag(ca.DM(CONTROL_WEIGHTS))
    to_go = ca.MX(weight)
    gain = ca.MX(NU, NX)
    for k in reversed(range(HORIZON)):
        _, slope = step(stages[:, k])
        a, b = ca.horzsplit(slope, [0, NX, STAGE])
        gain = ca.inv(effort + b.T @ to_go @ b) @ (b.T @ to_go @ a)
        to_go = weight + a.T @ to_go @ (a - b @ gain)
    return ca.Function("first_gain", [stages], [ca.densify(gain)])
