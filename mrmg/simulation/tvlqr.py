"""Time-varying linear-quadratic regulator about the plan: a baseline without solver.

The discrete Riccati recursion runs backwards over the horizon,

    K = (R + B'PB)^-1 B'PA,    P <- Q + A'P(A - BK),

with A, B the motion model's derivatives at the reference; the correction is -K (x - r),
which knows no limits (they are imposed on the set-points).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np

from mrmg.motion.dynamics import DERIVATIVES, NU, NX, rk4_step
from mrmg.scene.robot_model import RobotModel
from mrmg.simulation.controller import HORIZON, HORIZON_STEP_S


@dataclass(frozen=True, slots=True)
class TvlqrParams:
    """Weights of the quadratic cost.

    Attributes:
        state: per (x, y [1/m^2], theta [1/rad^2], v [s^2/m^2], psi [1/rad^2]).
        control: per (u1 [s^4/m^2], u2 [s^2/rad^2]).
    """

    state: tuple[float, ...] = (10.0, 10.0, 4.0, 0.5, 0.5)
    control: tuple[float, ...] = (0.5, 0.5)


class Tvlqr:
    """Linear-quadratic tracking of one robot."""

    def __init__(self, model: RobotModel, params: TvlqrParams | None = None) -> None:
        """Set up the recursion for a robot of `model`."""
        self._gain = _first_gain(
            model.motion_model, model.wheelbase_m, params or TvlqrParams()
        )

    def correct(self, state: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Return -K (x - r) with the gain of the horizon's first step."""
        control = np.diff(reference[:, 3:], axis=0) / HORIZON_STEP_S
        gain = self._gain(reference[:-1].T, control.T).full()
        return np.asarray(-gain @ (state - reference[0]))


@cache
def _first_gain(
    motion_model: str, wheelbase_m: float, params: TvlqrParams
) -> ca.Function:
    """Return (states (5, N), controls (2, N)) -> K of the first step, shape (2, 5)."""
    slopes = _slopes(motion_model, wheelbase_m)
    states = ca.MX.sym("states", NX, HORIZON)
    controls = ca.MX.sym("controls", NU, HORIZON)
    weight, effort = ca.diag(ca.DM(params.state)), ca.diag(ca.DM(params.control))
    to_go = ca.MX(weight)
    gain = ca.MX(NU, NX)
    for k in reversed(range(HORIZON)):
        a, b = slopes(states[:, k], controls[:, k])
        gain = ca.inv(effort + b.T @ to_go @ b) @ (b.T @ to_go @ a)
        to_go = weight + a.T @ to_go @ (a - b @ gain)
    return ca.Function("first_gain", [states, controls], [ca.densify(gain)])


def _slopes(motion_model: str, wheelbase_m: float) -> ca.Function:
    """Return (x, u) -> (df/dx, df/du) of one step of the horizon."""
    step = rk4_step(DERIVATIVES[motion_model](ca.sin, ca.cos, ca.tan))
    x, u = ca.SX.sym("x", NX), ca.SX.sym("u", NU)
    reached = ca.vertcat(
        *step(ca.vertsplit(x), ca.vertsplit(u), wheelbase_m, HORIZON_STEP_S)
    )
    return ca.Function(
        "slopes", [x, u], [ca.jacobian(reached, x), ca.jacobian(reached, u)]
    )
