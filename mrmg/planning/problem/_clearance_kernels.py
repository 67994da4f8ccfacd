"""Whether a robot keeps clear of obstacles."""

from __future__ import annotations

from mrmg.compilation import inlined
from mrmg.planning.roadmap._fleet_kernels import middle_at, space_of
from mrmg.world._kernels import (
    clearance_at_least,
    footprint_distance,
    footprint_is_clear,
)
from mrmg.world._polygon_kernels import BULGE, place_footprint, point_distance


@inlined
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


@inlined
def moves_clear(own, spaces, before, state, corner):
    """Return whether a robot keeps its margin after a step, and touches nothing in it.

    Where its margins before and after it are less than what it moves, it is followed
    through the step by conservative advancement, as in `pass_apart`.

    Args:
        own: the robot, shape (1,).
        spaces: free spaces of the fleet.
        before, state: its states.
        corner: room for a footprint, shape (M, 2).
    """
    margin, radius = own[0].margin, own[0].radius
    space = space_of(spaces, own[0].space)
    reach = radius + point_distance(0.0, 0.0, own[0].middle[0], own[0].middle[1])
    way = point_distance(before[0], before[1], state[0], state[1])
    way += reach * abs(state[2] - before[2])
    if not keeps_clear(own, spaces, state, margin, corner):
        return False
    # In openings it may have kept less before the step.
    kept = margin if space.allowance.shape[0] == 0 else 0.0
    if way <= 2.0 * kept:
        return True
    footprint, t = own[0].corner[: own[0].corners], 0.0
    pose = state[:3].copy()
    while True:
        placed = corner[: len(footprint)]
        place_footprint(footprint, pose[0], pose[1], pose[2], placed)
        cx, cy = middle_at(own[0], pose)
        enough = (1.0 - t) * way - kept
        distance = footprint_distance(space, placed, cx, cy, radius, enough)
        if distance >= enough:
            return True
        if distance < BULGE * way:
            return False
        t += distance / way
        for i in range(3):
            pose[i] = state[i] + t * (before[i] - state[i])
