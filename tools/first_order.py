"""A unicycle of first order: the control is its speed and yaw rate."""

from math import atan2, cos, hypot, pi, sin


def step(state, control, length, dt):
    """Return the state after `dt` under a held control."""
    x, y, theta, _, _ = state
    v, w = control
    middle = theta + 0.5 * w * dt
    return x + v * dt * cos(middle), y + v * dt * sin(middle), theta + w * dt, v, w


def steer(state, waypoint, share, limits, length, dt):
    """Return the control towards a waypoint at `share` of the top speed."""
    if share == 0.0:
        return 0.0, 0.0
    x, y, theta, _, _ = state
    dx, dy = waypoint[0] - x, waypoint[1] - y
    off = atan2(dy, dx) - theta
    off -= 2.0 * pi * round(off / (2.0 * pi))
    v = share * limits[1] * max(0.0, cos(off)) ** 3
    w = max(-limits[2], min(limits[2], off / dt))
    return min(v, hypot(dx, dy) / dt), w
