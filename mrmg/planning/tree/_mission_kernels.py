"""The planning problem as one value for the kernels of the tree."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np

from mrmg.compilation import by_reference, kernel
from mrmg.energy.model import CONSUMERS_W
from mrmg.planning.problem._safety_kernels import Gates
from mrmg.planning.problem._target_kernels import Targets
from mrmg.planning.roadmap._fleet_kernels import Spaces, space_of
from mrmg.planning.roadmap._roadmap_kernels import RoadmapArrays, find_waypoint
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.world._kernels import TerrainGrid, height_in


@by_reference
class TreeParams(NamedTuple):
    """Numbers the tree is grown by; see `parameters.PlannerParams`."""

    dt: float
    steps: int
    max_vertices: int
    group_alpha: float
    group_beta: float
    group_lambda: float
    group_bias: float
    steer_start: float
    steer_decay: float
    steer_least: float
    region: float
    route_margin: float
    optioned: bool
    levels: int
    iterations: int
    alpha: float
    rounds: int


@by_reference
class TreeMission(NamedTuple):
    """A `problem.Mission` with the numbers the tree is grown by."""

    fleet: np.ndarray
    spaces: Spaces
    terrain: TerrainGrid
    roadmap: RoadmapArrays
    targets: Targets
    gates: Gates
    routing: RoutingArrays
    last_leg: np.ndarray
    params: TreeParams


@kernel
def look_ahead(mission, r, target, state, view, waypoint):
    """Write robot r's waypoint towards a target; return the cost of the way [m].

    It is in metres of plain ground, with heights as a potential (`slopes`).

    Args:
        mission: the problem.
        r: robot.
        target: number of the target.
        state: the robot's state.
        view: how far along its way it looks [m].
        waypoint: receives (x, y).
    """
    fleet = mission.fleet
    return find_waypoint(
        space_of(mission.spaces, fleet[r].space),
        mission.terrain,
        mission.roadmap,
        fleet[r].field,
        target,
        state[0],
        state[1],
        fleet[r].passage,
        view,
        waypoint,
    )


@kernel
def load_height(mission, r, state):
    """Return the height of the ground below robot r's centre of mass [m]."""
    lead = mission.fleet[r].lead
    return height_in(
        mission.terrain,
        state[0] + lead * cos(state[2]),
        state[1] + lead * sin(state[2]),
    )


@kernel
def leg_energy(mission, r, target, state, way):
    """Return the energy of the way to a target and of the stay there [J].

    Args:
        mission: the problem.
        r: robot.
        target: number of the target.
        state: the robot's state.
        way: cost of the way that `look_ahead` found [m].
    """
    robot = mission.fleet[r]
    stay = robot.energy[CONSUMERS_W] * mission.targets.dwell[target]
    refund = mission.roadmap.slope_refund[robot.field]
    if refund > 0.0:
        center = mission.targets.center[target]
        rise = height_in(mission.terrain, center[0], center[1]) - height_in(
            mission.terrain, state[0], state[1]
        )
        way = max(0.0, way + refund * rise)
    return way * robot.plain + stay
