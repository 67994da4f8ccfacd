"""The mission and the parameters of the method as two values for the kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.problem._clearance_kernels import moves_clear
from mrmg.planning.problem._control_kernels import keeps_limits
from mrmg.planning.problem._target_kernels import Targets
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS, Spaces, middle_at
from mrmg.planning.roadmap._roadmap_kernels import RoadmapArrays
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.world._kernels import TerrainGrid
from mrmg.world._polygon_kernels import (
    convex_distance,
    pass_apart,
    place_footprint,
    point_distance,
    way_of_corners,
)


class Setting(NamedTuple):
    """A mission as the method sees it.

    Attributes:
        fleet, spaces, terrain, targets: robots, world, goals and stations.
        roadmap: what ConstructPRM returned.
        joined: roadmap vertices with a path to some target, by class, shape (F, V).
        routing: the routing problem where tours were made last; costs include the
            route margin.
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
    decline: float
    bias: float
    vertex_spread_m: float
    decay_start: float
    decay_rate: float
    decay_least: float
    ahead_least_m: float
    ahead_most_m: float
    target_spread_m: float
    route_margin: float
    levels: int
    nrpa_iterations: int
    nrpa_alpha: float


@kernel
def collision_free(setting, before, state):
    """Return whether a step keeps all limits and margins (CollisionFree).

    Where margins at both ends are less than what robots move in between, they are
    followed through the step.

    Args:
        setting: the mission.
        before: composite state before the step, which keeps them, shape (R, 5).
        state: that after it.
    """
    fleet = setting.fleet
    corner, middle = np.empty((len(fleet), MOST_CORNERS, 2)), np.empty((len(fleet), 2))
    way = np.empty(len(fleet))
    for r in range(len(fleet)):
        own, here = fleet[r : r + 1], state[r]
        if not keeps_limits(fleet[r], here):
            return False
        if not moves_clear(own, setting.spaces, before[r], here, corner[r]):
            return False
        footprint = fleet[r].corner[: fleet[r].corners]
        place_footprint(footprint, here[0], here[1], here[2], corner[r])
        middle[r, 0], middle[r, 1] = middle_at(fleet[r], here)
        way[r] = way_of_corners(footprint, before[r], here)
        for other in range(r):
            gap = max(fleet[r].spacing, fleet[other].spacing)
            both = way[r] + way[other]
            enough = gap if both <= 2.0 * gap else both
            apart = point_distance(
                middle[r, 0], middle[r, 1], middle[other, 0], middle[other, 1]
            )
            if apart >= fleet[r].radius + fleet[other].radius + enough:
                continue
            its = fleet[other].corner[: fleet[other].corners]
            placed = corner[r, : len(footprint)], corner[other, : len(its)]
            distance = convex_distance(placed[0], placed[1], enough)
            if distance < gap:
                return False
            if distance < enough and not pass_apart(
                footprint, its, here, before[r], state[other], before[other],
                distance, np.empty((2, MOST_CORNERS, 2)),
            ):  # fmt: skip
                return False
    return True
