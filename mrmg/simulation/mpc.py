"""Tracking model predictive control: one Gauss-Newton QP a call (real-time iteration).

    min  sum_k |x_k - r_k|^2_Q + |u_k - w_k|^2_R + |x_N - r_N|^2_(q_N Q)
    s.t. x_{k+1} = f(x_k, u_k) linearised about the previous solution,
         v, psi, u1, u2 within the robot's limits,

with r the reference and w its mean controls (Diehl et al. 2005; Gros et al. 2020). v
and psi are pure integrals of u, so that u = 0 is feasible and no slack is needed.

Most often no bound is active. The problem is therefore solved without them first, by a
Riccati recursion; only a solution that breaks a bound is found anew with them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import casadi as ca
import numpy as np

from mrmg.motion.dynamics import NU, NX
from mrmg.scene.robot_model import Limits, RobotModel
from mrmg.simulation.controller import HORIZON, HORIZON_STEP_S
from mrmg.simulation.native_code import compiled
from mrmg.simulation.riccati import SIZE, STAGE, linearised_step, unbounded_solver

STATE_WEIGHTS = (10.0, 10.0, 4.0, 0.5, 0.5)
"""Per (x, y [1/m^2], theta [1/rad^2], v [s^2/m^2], psi [1/rad^2])."""

CONTROL_WEIGHTS = (0.2, 0.2)
"""Per (u1 [s^4/m^2], u2 [s^2/rad^2])."""

TERMINAL_FACTOR = 3.0
"""Weight of the last state over the others."""

WEIGHTS = np.array(
    [*STATE_WEIGHTS, *CONTROL_WEIGHTS] * HORIZON
    + [TERMINAL_FACTOR * value for value in STATE_WEIGHTS]
)
"""Of (x_0, u_0, x_1, ..., x_N) in the tracking cost."""


class TrackingMpc:
    """Model predictive tracking of one robot.

    Attributes:
        branch: what solved the last problem: "riccati", where no bound was active, or
            "qp".
    """

    def __init__(self, model: RobotModel) -> None:
        """Set up the problem for a robot of `model`."""
        kind = (model.motion_model, model.wheelbase_m)
        self._lower, self._upper = _bounds(model.limits)
        self.branch = "riccati"
        self._deviation = np.zeros(SIZE)
        self._guess = np.zeros(SIZE)
        self._target = np.zeros(SIZE)
        self._solution = np.zeros(SIZE)
        question = (self._guess, self._target)
        bounds = (self._lower, self._upper)
        self._solve_unbounded = _in_place(
            _unbounded_solver(*kind), question, self._solution
        )
        self._solve_bounded = _in_place(
            _solver(*kind), (*question, *bounds), self._solution
        )

    def correct(self, state: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Return the first control of the optimum less the reference's."""
        stages = self._target[:-NX].reshape(HORIZON, STAGE)
        stages[:, :NX] = reference[:-1]
        stages[:, NX:] = (reference[1:, 3:] - reference[:-1, 3:]) / HORIZON_STEP_S
        self._target[-NX:] = reference[-1]
        np.add(self._target, self._deviation, out=self._guess)
        first = state.clip(self._lower[-NX:], self._upper[-NX:])
        for each in (self._lower, self._upper, self._guess):
            each[:NX] = first
        if not self._solve():
            self._deviation[:] = 0.0
            return np.zeros(NU)
        np.subtract(self._solution, self._target, out=self._deviation)
        return self._deviation[NX:STAGE].copy()

    def _solve(self) -> bool:
        """Solve the QP; return whether question and answer are all numbers."""
        if not np.isfinite(self._guess).all():
            return False
        self._solve_unbounded()
        self.branch = "riccati" if self._keeps_bounds() else "qp"
        if self.branch == "riccati":
            return True
        self._solve_bounded()
        return bool(np.isfinite(self._solution).all())

    def _keeps_bounds(self) -> bool:
        """Return whether the solution keeps all bounds, which nan does not."""
        above, below = self._solution >= self._lower, self._solution <= self._upper
        return bool((above & below).all())


def _in_place(
    function: ca.Function, arguments: Sequence[np.ndarray], result: np.ndarray
) -> Callable[[], None]:
    """Return what calls a CasADi function on arrays and writes its only result."""
    buffer, evaluate = function.buffer()
    for index, array in enumerate(arguments):
        buffer.set_arg(index, memoryview(array))  # type: ignore
    buffer.set_res(0, memoryview(result))  # type: ignore

    # The buffer must outlive the calls that work on it.
    def call(_buffer: ca.FunctionBuffer = buffer) -> None:
        evaluate()

    return call


def _bounds(limits: Limits) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds of the decision (x_0, u_0, x_1, ..., x_N), each of shape (n,)."""
    upper = [np.inf, np.inf, np.inf, limits.v_max_m_s, limits.w_max]
    lower = [-np.inf, -np.inf, -np.inf, limits.v_min_m_s, -limits.w_max]
    control = [limits.u1_max_m_s2, limits.u2_max]
    return (
        np.array([*lower, *(-bound for bound in control)] * HORIZON + lower),
        np.array([*upper, *control] * HORIZON + upper),
    )


@cache
def _unbounded_solver(motion_model: str, wheelbase_m: float) -> ca.Function:
    """Return (guess, target) -> solution where no bound is active."""
    return compiled(unbounded_solver(motion_model, wheelbase_m, WEIGHTS))


@cache
def _solver(motion_model: str, wheelbase_m: float) -> ca.Function:
    """Return (guess, target, lower, upper) -> solution of the linearised problem."""
    guess = ca.MX.sym("guess", SIZE)
    target = ca.MX.sym("target", SIZE)
    lower = ca.MX.sym("lower", SIZE)
    upper = ca.MX.sym("upper", SIZE)
    linearise = compiled(_linearised_gaps(motion_model, wheelbase_m))
    jacobian, gap = linearise(guess)
    # J z = J z_guess - gap(z_guess): the gaps close to first order.
    right_side = jacobian @ guess - gap
    qp = ca.conic(
        "tracking",
        "piqp",
        {"h": ca.Sparsity.diag(SIZE), "a": linearise.sparsity_out(0)},
        {"error_on_fail": False},
    )
    solution = qp(
        h=ca.diag(ca.DM(WEIGHTS)),
        g=-WEIGHTS * target,
        a=jacobian,
        lba=right_side,
        uba=right_side,
        lbx=lower,
        ubx=upper,
        x0=guess,
    )["x"]
    return ca.Function("mpc_step", [guess, target, lower, upper], [solution])


def _linearised_gaps(motion_model: str, wheelbase_m: float) -> ca.Function:
    """Return z -> (Jacobian, value) of the gaps x_{k+1} - f(x_k, u_k)."""
    z = ca.MX.sym("z", SIZE)
    stages = ca.reshape(z[:-NX], STAGE, HORIZON)
    step = linearised_step(motion_model, wheelbase_m)
    after, slopes = step.map(HORIZON)(stages)
    following = ca.horzcat(stages[:NX, 1:], z[-NX:])
    last = ca.MX(NX * HORIZON, NX)
    slope = ca.horzcat(ca.diagcat(*ca.horzsplit(slopes, STAGE)), last)
    selected = [ca.horzcat(ca.DM.eye(NX), ca.DM(NX, NU))] * (HORIZON - 1)
    first = ca.DM(NX * HORIZON, STAGE)
    identity = ca.horzcat(first, ca.diagcat(*selected, ca.DM.eye(NX)))
    name = f"gaps_{motion_model}"
    return ca.Function(name, [z], [identity - slope, ca.vec(following - after)])
