"""Angles, and controls towards a wanted speed and steering, or to rest."""

from __future__ import annotations

from math import pi

from mrmg.compilation import inlined, kernel
from mrmg.motion._kernels import CAR, USER, steer_user

REST = 1e-9
"""Speed below which a robot counts as standing [m/s]."""

ROUNDING = 1e-10
"""What speed and steering may be beyond their limits: sums of accelerations are not
exact. The verifier lets ten times as much pass."""


@kernel
def wrap(angle):
    """Return the angle in (-pi, pi]."""
    if abs(angle) > 100.0:  # which the loops would take long for
        angle %= 2.0 * pi
    while angle > pi:
        angle -= 2.0 * pi
    while angle <= -pi:
        angle += 2.0 * pi
    return angle


@kernel
def control_towards(fleet, r, state, v, w, dt):
    """Return the control (u1, u2) that brings speed and steering to (v, w)."""
    v = max(fleet[r].limit[0], min(fleet[r].limit[1], v))
    w = max(-fleet[r].limit[2], min(fleet[r].limit[2], w))
    u1 = max(-fleet[r].limit[3], min(fleet[r].limit[3], (v - state[3]) / dt))
    u2 = max(-fleet[r].limit[4], min(fleet[r].limit[4], (w - state[4]) / dt))
    return u1, u2


@kernel
def toward_zero(value, bound, dt):
    """Return the rate that brings `value` to 0 as fast as `bound` allows."""
    if abs(value) < REST:
        return 0.0
    return max(-bound, min(bound, -value / dt))


@kernel
def braking_control(fleet, r, state, dt):
    """Return the control (u1, u2) of full braking; a car holds its steering."""
    if fleet[r].model == USER:
        return steer_user(fleet[r], state, state[0], state[1], 0.0, dt)
    u1 = toward_zero(state[3], fleet[r].limit[3], dt)
    u2 = 0.0
    if fleet[r].model != CAR:
        u2 = toward_zero(state[4], fleet[r].limit[4], dt)
    return u1, u2


@inlined
def keeps_limits(robot, state):
    """Return whether speed and steering, or turning rate, keep a robot's limits."""
    limit, v, w = robot.limit, state[3], state[4]
    beyond = max(limit[0] - v, v - limit[1], abs(w) - limit[2])
    return beyond <= ROUNDING


@kernel
def stands(fleet, r, state):
    """Return whether a robot is at rest."""
    return abs(state[3]) < REST and (fleet[r].model == CAR or abs(state[4]) < REST)
