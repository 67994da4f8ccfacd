"""The motion models compiled for the planner, from the equations in `dynamics`."""

from __future__ import annotations

from math import cos, sin, tan

import numba

from mrmg.compilation import kernel
from mrmg.motion.dynamics import (
    car_derivative,
    car_turn_speed,
    rk4_step,
    unicycle_derivative,
    unicycle_turn_speed,
)

CAR = 0
UNICYCLE = 1
MODEL_ID = {"car": CAR, "unicycle": UNICYCLE}

# Closures cannot be cached on their own (their cells hold compiled functions); the
# kernels that call them are.
_car_step = numba.njit(rk4_step(numba.njit(car_derivative(sin, cos, tan))))
_unicycle_step = numba.njit(rk4_step(numba.njit(unicycle_derivative(sin, cos, tan))))
_car_turn_speed = numba.njit(car_turn_speed(tan))
_unicycle_turn_speed = numba.njit(unicycle_turn_speed(tan))


@kernel
def step(model, state, u1, u2, wheelbase, dt, out):
    """Write the state after `dt` under held controls into `out`, shape (5,)."""
    if model == CAR:
        x, y, theta, v, w = _car_step(
            state[0], state[1], state[2], state[3], state[4], u1, u2, wheelbase, dt
        )
    else:
        x, y, theta, v, w = _unicycle_step(
            state[0], state[1], state[2], state[3], state[4], u1, u2, wheelbase, dt
        )
    out[0], out[1], out[2], out[3], out[4] = x, y, theta, v, w


@kernel
def turn_speed(model, v, w, track):
    """Return L |theta'| for the energy model's turning part [m/s]."""
    if model == CAR:
        return _car_turn_speed(v, w, track)
    return _unicycle_turn_speed(v, w, track)
