"""Whether a robot keeps clear of obstacles."""

from __future__ import annotations

from mrmg.compilation import kernel
from mrmg.planning.roadmap._fleet_kernels import middle_at, space_of
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
    cx, cy = middle_at(own[0], state)
    if clearance_at_least(space, cx, cy) > radius + margin:
        return True
    place_footprint(own[0].corner[:n], state[0], state[1], state[2], corner[:n])
    return footprint_is_clear(space, corner[:n], cx, cy, radius, margin)
