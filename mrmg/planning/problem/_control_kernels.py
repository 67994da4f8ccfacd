"""Angles, and controls towards a wanted speed and steering."""

from __future__ import annotations

from math import pi

from mrmg.compilation import kernel


@kernel
def wrap(angle):
    """Return the angle in (-pi, pi]."""
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
