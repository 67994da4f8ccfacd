"""The mission and the parameters of the method as two values for the kernels."""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.problem._target_kernels import Targets
from mrmg.planning.roadmap._fleet_kernels import Spaces, middle_at, space_of
from mrmg.planning.roadmap._roadmap_kernels import RoadmapArrays
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.world._kernels import TerrainGrid, footprint_is_clear
from mrmg.world._polygon_kernels import convex_distance, place_footprint

STATE_ROUNDING = 1e-9
"""Rounding of summed steps that is forgiven in the limits of speed and steering."""


class Setting(NamedTuple):
    """A mission as the method sees it.

    Attributes:
        fleet, spaces, terrain, targets: robots, world, goals and stations.
        roadmap: what ConstructPRM returned.
        joined: roadmap vertices with a path to some target, by class, shape (F, V).
        routing: the routing problem at the root; costs include the route margin.
    """

    fleet: np.ndarray
    spaces: Spaces
    terrain: TerrainGrid
    targets: Targets
    roadmap: RoadmapArrays
    joined: np.ndarray
    routing: RoutingArrays


class Rules(NamedTuple):
    """Parameters of the method; see `parameters.GuidedTreeParams`."""

    dt_s: float
    k: int
    iterations: int
    alpha: float
    beta_share: float
    decline: float
    bias: float
    vertex_spread_m: float
    decay_start: float
    decay_rate: float
    decay_least: float
    ahead_m: float
    ahead_least_m: float
    ahead_most_m: float
    target_spread_m: float
    route_margin: float
    levels: int
    nrpa_iterations: int
    nrpa_alpha: float


@kernel
def within_limits(robot, state):
    """Return whether speed and steering (or turning rate) keep the robot's limits."""
    if state[3] < robot.limit[0] - STATE_ROUNDING:
        return False
    if state[3] > robot.limit[1] + STATE_ROUNDING:
        return False
    return abs(state[4]) <= robot.limit[2] + STATE_ROUNDING


@kernel
def collision_free(setting, state, corner, middle):
    """Return whether a composite state keeps all limits and margins (CollisionFree).

    Args:
        setting: the mission.
        state: composite state, shape (R, 5).
        corner: receives the placed footprints, shape (R, M, 2).
        middle: receives their middles, shape (R, 2).
    """
    fleet = setting.fleet
    for r in range(len(fleet)):
        if not within_limits(fleet[r], state[r]):
            return False
        x, y, theta, n = state[r, 0], state[r, 1], state[r, 2], fleet[r].corners
        middle[r, 0], middle[r, 1] = middle_at(fleet[r], state[r])
        place_footprint(fleet[r].corner[:n], x, y, theta, corner[r])
        if not footprint_is_clear(
            space_of(setting.spaces, fleet[r].space), corner[r, :n],
            middle[r, 0], middle[r, 1], fleet[r].radius, fleet[r].margin,
        ):  # fmt: skip
            return False
        for other in range(r):
            gap = max(fleet[r].spacing, fleet[other].spacing)
            apart = hypot(
                middle[r, 0] - middle[other, 0], middle[r, 1] - middle[other, 1]
            )
            if apart >= fleet[r].radius + fleet[other].radius + gap:
                continue
            others = corner[other, : fleet[other].corners]
            if convex_distance(corner[r, :n], others, gap) < gap:
                return False
    return True
