"""The motion models compiled for the planner, from the equations in `dynamics`."""

from __future__ import annotations

from math import cos, sin, tan

import numba

from mrmg.compilation import kernel
from mrmg.motion._pointer_kernels import call_steer, call_step
from mrmg.motion.dynamics import (
    car_derivative,
    car_turn_speed,
    rk4_step,
    unicycle_derivative,
    unicycle_turn_speed,
)

CAR, UNICYCLE, USER = range(3)
"""Motion models: the shipped ones, and any that is called through its addresses."""

MODEL_ID = {"car": CAR, "unicycle": UNICYCLE}

# Closures cannot be cached on their own (their cells hold compiled functions); the
# kernels that call them are.
_car_step = numba.njit(rk4_step(numba.njit(car_derivative(sin, cos, tan))))
_unicycle_step = numba.njit(rk4_step(numba.njit(unicycle_derivative(sin, cos, tan))))
_car_turn_speed = numba.njit(car_turn_speed(tan))
_unicycle_turn_speed = numba.njit(unicycle_turn_speed(tan))


@kernel
def step(robot, state, u1, u2, dt, out):
    """Write the state after `dt` under held controls into `out`, shape (5,).

    `robot` is a record with `model`, `wheelbase` and, for a user's model, `step_at`.
    """
    now, control = (state[0], state[1], state[2], state[3], state[4]), (u1, u2)
    if robot.model == USER:
        then = call_step(robot.step_at, now, control, robot.wheelbase, dt)
    elif robot.model == CAR:
        then = _car_step(now, control, robot.wheelbase, dt)
    else:
        then = _unicycle_step(now, control, robot.wheelbase, dt)
    out[0], out[1], out[2], out[3], out[4] = then


@kernel
def write_states(robot, dt, control, state):
    """Write the states that controls, shape (n, 2), lead to from state[0]."""
    for k in range(len(control)):
        step(robot, state[k], control[k, 0], control[k, 1], dt, state[k + 1])


@kernel
def turn_speed(model, v, w, track):
    """Return L |theta'| for the energy model's turning part [m/s]."""
    if model == CAR:
        return _car_turn_speed(v, w, track)
    return _unicycle_turn_speed(v, w, track)


@kernel
def copy_numbers(source, target):
    """Copy numbers element by element into an array that is at least as long.

    Assigning to a slice would compile the text of an error for arrays that do not fit,
    which takes longer than all the rest.
    """
    for i in range(len(source)):
        target[i] = source[i]


@kernel
def steer_user(robot, state, wx, wy, share, dt):
    """Return a user's model's control (u1, u2) towards a waypoint.

    `share` of the top speed is wanted; 0 requires braking.
    """
    return call_steer(
        robot.steer_at, (state[0], state[1], state[2], state[3], state[4]), (wx, wy),
        share, robot.wheelbase, dt,
    )  # fmt: skip
