"""The equations of motion, stated once.

Each factory takes the elementary functions it needs and returns the derivative of one
motion model as a function of scalars. `math` gives the plain Python form (the
verifier), numba compiles that form for the planner, and CasADi traces it for the
controller.

State and control of both models (SI units):

- `car`, the second-order car: state (x, y, theta, v, psi), control (u1, u2);
  x' = v cos theta, y' = v sin theta, theta' = v / L tan psi, v' = u1, psi' = u2.
- `unicycle`, the second-order differential drive: state (x, y, theta, v, omega),
  control (u1, u2); x' = v cos theta, y' = v sin theta, theta' = omega, v' = u1,
  omega' = u2.

The paper prints x' = cos theta and theta' = psi in eq. (1), which drops v and L; read
as a second-order unicycle it is the second model.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

NX = 5
"""Number of state components of every motion model."""

NU = 2
"""Number of control components of every motion model."""

Derivative = Callable[..., Any]


def car_derivative(sin: Any, cos: Any, tan: Any) -> Derivative:
    """Return f(theta, v, psi, u1, u2, L) -> (x', y', theta', v', psi')."""

    def derivative(theta, v, psi, u1, u2, wheelbase):
        return (
            v * cos(theta),
            v * sin(theta),
            v * tan(psi) / wheelbase,
            u1,
            u2,
        )

    return derivative


def unicycle_derivative(sin: Any, cos: Any, tan: Any) -> Derivative:
    """Return f(theta, v, omega, u1, u2, L) -> (x', y', theta', v', omega').

    L is unused.
    """

    def derivative(theta, v, omega, u1, u2, wheelbase):
        return (v * cos(theta), v * sin(theta), omega, u1, u2)

    return derivative


def rk4_step(derivative: Derivative) -> Derivative:
    """Return step(state, control, L, dt) -> state: one classic Runge-Kutta step.

    State is (x, y, theta, v, w), control (u1, u2), as a user's motion has them;
    v and w (psi or omega) are integrals of the held control, so their stages are exact.
    """

    def step(state, control, wheelbase, dt):
        x, y, theta, v, w = state
        u1, u2 = control
        half = 0.5 * dt
        ax, ay, at, _, _ = derivative(theta, v, w, u1, u2, wheelbase)
        vm = v + half * u1
        wm = w + half * u2
        bx, by, bt, _, _ = derivative(theta + half * at, vm, wm, u1, u2, wheelbase)
        cx, cy, ct, _, _ = derivative(theta + half * bt, vm, wm, u1, u2, wheelbase)
        ve = v + dt * u1
        we = w + dt * u2
        dx, dy, d_t, _, _ = derivative(theta + dt * ct, ve, we, u1, u2, wheelbase)
        sixth = dt / 6.0
        return (
            x + sixth * (ax + 2.0 * bx + 2.0 * cx + dx),
            y + sixth * (ay + 2.0 * by + 2.0 * cy + dy),
            theta + sixth * (at + 2.0 * bt + 2.0 * ct + d_t),
            ve,
            we,
        )

    return step


def car_turn_speed(tan: Any) -> Callable[..., Any]:
    """Return L |theta'| of a car [m/s] from (v, psi, track): |v tan psi|."""

    def turn_speed(v, psi, track):
        return abs(v * tan(psi))

    return turn_speed


def unicycle_turn_speed(tan: Any) -> Callable[..., Any]:
    """Return L |theta'| of a differential drive [m/s] from (v, omega, track).

    L is the track, as its wheels scrub by what they turn about each other; tan and v
    are unused.
    """

    def turn_speed(v, omega, track):
        return track * abs(omega)

    return turn_speed


DERIVATIVES: dict[str, Callable[[Any, Any, Any], Derivative]] = {
    "car": car_derivative,
    "unicycle": unicycle_derivative,
}
"""Derivative factories by the name of the motion model."""

TURN_SPEEDS: dict[str, Callable[[Any], Callable[..., Any]]] = {
    "car": car_turn_speed,
    "unicycle": unicycle_turn_speed,
}
"""Factories of L |theta'|, what turning costs by, by the name of the motion model."""

SPEED_STATES: dict[str, tuple[int, ...]] = {"car": (3,), "unicycle": (3, 4)}
"""Indices of the states that are speeds, by the name of the motion model.

They are zero at rest, and run at half its pace a motion has half of them.
"""
