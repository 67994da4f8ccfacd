"""Whether a robot keeps clear of obstacles."""

from __future__ import annotations

from math import cos, sin

from mrmg.compilation import kernel
from mrmg.planning.roadmap._fleet_kernels import space_of
from mrmg.world._kernels import clearance_at_least, footprint_is_clear
from mrmg.world._polygon_kernels import place_footprint


@kernel
def clear_of_obstacles(own, spaces, state, corner):
    """Return whether a robot keeps its margin from obstacles; see `keeps_clear`."""
    return keeps_clear(own, spaces, state, own[0].margin, corner)


@kernel
def keeps_clear(own, spaces, state, margin, corner):
    """Return whether a robot keeps a margin from obstacles.

    Args:
        own: the robot, shape (1,).
        spaces: free spaces of the fleet.
        state: its state.
        margin: that it keeps [m].
        corner: room for a footprint, shape (M, 2).
    """
    space = space_of(spaces, own[0].space)
    n, radius = own[0].corners, own[0].radius
    x, y, theta = state[0], state[1], state[2]
    c, s = cos(theta), sin(theta)
    cx = x + c * own[0].middle[0] - s * own[0].middle[1]
    cy = y + s * own[0].middle[0] + c * own[0].middle[1]
    if clearance_at_least(space, cx, cy) > radius + margin:
        return True
    place_footprint(own[0].corner[:n], x, y, theta, corner[:n])
    return footprint_is_clear(space, corner[:n], cx, cy, radius, margin)
