"""The tracking problem without its bounds: a linear-quadratic one, solved exactly.

With e_k and d_k the deviations of state and control from their targets, A_k and B_k the
slopes of the motion model at the guess, and g_k the gap that the guess leaves there,

    min  sum_k e_k' Q e_k + d_k' R d_k + q_N e_N' Q e_N
    s.t. e_{k+1} = A_k e_k + B_k d_k + g_k,

the value function 1/2 e' P e + p' e follows backwards from the last stage (Riccati),
and d_k = K_k e_k + f_k forwards from the first. The bounded problem is strictly convex:
where this solution keeps the bounds, it is that of the bounded problem.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from mrmg.motion.dynamics import DERIVATIVES, NU, NX, rk4_step
from mrmg.simulation.controller import HORIZON, HORIZON_STEP_S

STAGE = NX + NU
"""Number of state and control components of one step of the horizon."""

SIZE = HORIZON * STAGE + NX
"""Number of components of a solution."""


def unbounded_solver(
    motion_model: str, wheelbase_m: float, weight: np.ndarray
) -> ca.Function:
    """Return (guess, target) -> solution, each (x_0, u_0, x_1, ..., x_N).

    The solution starts from the guess's x_0.

    Args:
        motion_model: key of `motion.dynamics.DERIVATIVES`.
        wheelbase_m: of the robot.
        weight: diagonals of Q and R stage by stage, and of the last state's, shape of
            the solution.
    """
    guess, target = ca.MX.sym("guess", SIZE), ca.MX.sym("target", SIZE)
    linearise = _stage_deviation(motion_model, wheelbase_m)
    backward = _backward(linearise.sparsity_out(0))
    stages = []
    for k in range(HORIZON):
        now = slice(k * STAGE, (k + 1) * STAGE)
        following = slice((k + 1) * STAGE, (k + 1) * STAGE + NX)
        stages.append(linearise(guess[now], target[now], target[following]))
    value, value_slope = ca.MX(ca.diag(ca.DM(weight[-NX:]))), ca.MX(ca.DM.zeros(NX))
    gains = []
    for k in reversed(range(HORIZON)):
        stage_weight = ca.DM(weight[k * STAGE : (k + 1) * STAGE])
        value, value_slope, gain, offset = backward(
            value, value_slope, *stages[k], stage_weight
        )
        gains.append((gain, offset))
    deviation = guess[:NX] - target[:NX]
    solution = [deviation]
    for (slope, gap), (gain, offset) in zip(stages, reversed(gains), strict=True):
        control = gain @ deviation + offset
        deviation = slope @ ca.vertcat(deviation, control) + gap
        solution += [control, deviation]
    later = target[NX:] + ca.vertcat(*solution[1:])
    name = f"unbounded_{motion_model}"
    return ca.Function(name, [guess, target], [ca.vertcat(guess[:NX], later)])


def linearised_step(motion_model: str, wheelbase_m: float) -> ca.Function:
    """Return (x, u) -> (x after a step of the horizon, its derivatives [A B])."""
    step = rk4_step(DERIVATIVES[motion_model](ca.sin, ca.cos, ca.tan))
    now = ca.SX.sym("now", STAGE)
    state, control = ca.vertsplit(now, [0, NX, STAGE])
    reached = ca.vertcat(
        *step(ca.vertsplit(state), ca.vertsplit(control), wheelbase_m, HORIZON_STEP_S)
    )
    return ca.Function("stage", [now], [reached, ca.jacobian(reached, now)])


def _stage_deviation(motion_model: str, wheelbase_m: float) -> ca.Function:
    """Return (guess, target, next target state) -> ([A B], g) of one stage."""
    guess, target = ca.SX.sym("guess", STAGE), ca.SX.sym("target", STAGE)
    following = ca.SX.sym("following", NX)
    reached, slope = linearised_step(motion_model, wheelbase_m)(guess)
    gap = reached + slope @ (target - guess) - following
    return ca.Function("linearise", [guess, target, following], [slope, gap])


def _backward(slope_sparsity: ca.Sparsity) -> ca.Function:
    """Return (P, p, [A B], g, weights) -> (P, p, K, f), one stage earlier."""
    value, value_slope = ca.SX.sym("P", NX, NX), ca.SX.sym("p", NX)
    slope, gap = ca.SX.sym("slope", slope_sparsity), ca.SX.sym("gap", NX)
    weight = ca.SX.sym("weight", STAGE)
    hessian = ca.diag(weight) + slope.T @ value @ slope
    gradient = slope.T @ (value @ gap + value_slope)
    inverse = _inverse(hessian[NX:, NX:])
    gain = -inverse @ hessian[NX:, :NX]
    offset = -inverse @ gradient[NX:]
    earlier = hessian[:NX, :NX] + hessian[:NX, NX:] @ gain
    earlier_slope = gradient[:NX] + hessian[:NX, NX:] @ offset
    return ca.Function(
        "backward",
        [value, value_slope, slope, gap, weight],
        [ca.densify(earlier), earlier_slope, ca.densify(gain), offset],
    )


def _inverse(matrix: ca.SX) -> ca.SX:
    """Return the inverse of a symmetric 2 x 2 matrix."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[1, 1]
    adjoint = ca.vertcat(ca.horzcat(c, -b), ca.horzcat(-b, a))
    return adjoint / (a * c - b * b)
