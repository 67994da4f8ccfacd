"""Steering: where a robot wants to go next, as a speed and a steering angle.

A robot descends the roadmap's cost-to-go field: it drives at the farthest point of the
way that it can see. A point inside the turning circle is approached by backing off
first.
"""

from __future__ import annotations

from math import atan, atan2, cos, hypot, pi, sin

from mrmg.compilation import kernel
from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.problem._control_kernels import wrap
from mrmg.world._kernels import segment_is_clear

STEER, RANDOM, BACK_OFF, WAIT = range(4)
"""What a robot does during one expansion of the tree."""

LOOKAHEAD_M = 3.5
"""Distance at which pure pursuit aims."""

SIGHT_M = 9.0
"""Distance within which other robots are steered round."""

NARROWER = 10
"""Smaller offsets tried in passing a robot where there is no room for the full one."""


@kernel
def pursue(fleet, r, state, wx, wy, gear):
    """Return the wanted (v, w) to drive at a waypoint in a gear by pure pursuit."""
    dx = wx - state[0]
    dy = wy - state[1]
    distance = hypot(dx, dy)
    bearing = wrap(atan2(dy, dx) - state[2])
    v_min, v_max, w_max = fleet[r].limit[0], fleet[r].limit[1], fleet[r].limit[2]
    if fleet[r].model == UNICYCLE:
        # Slow enough for the turn; on the spot when the point is abeam.
        w = max(-w_max, min(w_max, 1.5 * bearing))
        return v_max * max(0.0, cos(bearing)) ** 3, w
    off = bearing if gear > 0 else wrap(bearing - pi)
    radius = fleet[r].turning_radius
    if distance < 2.0 * radius and abs(off) > 0.35:
        needed = distance / (2.0 * max(sin(abs(off)), 1e-6))
        if abs(off) > 0.5 * pi or needed < radius:
            # Inside the turning circle: back off, turning the nose (or tail) at it.
            turn = w_max if off > 0.0 else -w_max
            if gear > 0:
                return 0.6 * v_min, -turn
            return 0.5 * v_max, turn
    ahead = max(1.0, min(distance, LOOKAHEAD_M))
    lateral = sin(bearing)
    if abs(off) > 0.5 * pi:
        lateral = 1.0 if bearing > 0.0 else -1.0
    psi = atan(2.0 * fleet[r].wheelbase * lateral / ahead)
    psi = max(-w_max, min(w_max, psi))
    fastest = v_max if gear > 0 else v_min
    error = abs(psi - state[4])
    return fastest * max(0.6, min(1.0, 1.2 - error)), psi


@kernel
def sidestep(fleet, r, state, space, others, wx, wy, out):
    """Move a waypoint aside where a slower or oncoming robot is in the way.

    Passes on the right when meeting head on, else on the side the other leaves free;
    keeps to the right in a passage too narrow for that. `others` holds the present
    states of all robots, shape (R, 5).
    """
    out[0], out[1] = wx, wy
    dx = wx - state[0]
    dy = wy - state[1]
    distance = hypot(dx, dy)
    if distance < 1e-6:
        return
    dx /= distance
    dy /= distance
    nearest = min(SIGHT_M, distance + fleet[r].radius)
    for other in range(len(others)):
        if other == r:
            continue
        c, s = cos(others[other, 2]), sin(others[other, 2])
        ox = others[other, 0] + c * fleet[other].middle[0] - s * fleet[other].middle[1]
        oy = others[other, 1] + s * fleet[other].middle[0] + c * fleet[other].middle[1]
        along = (ox - state[0]) * dx + (oy - state[1]) * dy
        lateral = (oy - state[1]) * dx - (ox - state[0]) * dy
        wide = fleet[r].radius + fleet[other].radius + 0.8
        if along <= 0.0 or along >= nearest or abs(lateral) > wide:
            continue
        speed = others[other, 3] * (c * dx + s * dy)
        if speed > 0.5 * fleet[r].limit[1]:
            continue
        nearest = along
        side = -1.0 if lateral > -0.3 else 1.0
        for attempt in range(2 + NARROWER):
            # Either side; if neither is clear, as far right as there is room.
            offset = wide + 0.3
            if attempt >= 2:
                side = -1.0
                offset *= 1.0 - (attempt - 1) / (NARROWER + 1)
            px = ox - side * dy * offset
            py = oy + side * dx * offset
            if segment_is_clear(space, state[0], state[1], px, py, fleet[r].passage):
                out[0], out[1] = px, py
                break
            side = -side
