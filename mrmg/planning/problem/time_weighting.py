"""What a second is worth to robots on their ways.

Driving slower than top speed never saves energy on the way, but two things do that take
time: rolling to a stop instead of braking, and ways round dear ground.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrmg.planning.preference import Preference
from mrmg.planning.roadmap.fleet import travel_classes
from mrmg.planning.roadmap.roadmap import Roadmap, edge_costs
from mrmg.scene.margins import Margins
from mrmg.scene.objective import Objective
from mrmg.scene.types import Robot, Scene
from mrmg.world.world import World

TIMED_SHARE = 0.9
"""Share of driving in the worth of ways below which their duration counts, too."""


def energy_share(objective: Objective, robot: Robot) -> float:
    """Return the share of driving in what a plain metre at top speed is worth.

    The rest is the time it takes. It is 1 where only energy counts, 0 where only the
    makespan does.

    Args:
        objective: in terms of the energy of driving (`Preference.driving`).
        robot: the robot.
    """
    model = robot.model
    top_m_s = model.planned_limits.v_max_m_s
    power_W = model.energy_model.plain_ground_J_per_m() * top_m_s
    energy = objective.energy_weight * power_W
    return energy / (energy + objective.makespan_weight)


def time_counts(scene: Scene) -> bool:
    """Return whether time is worth so much that ways are chosen by how fast they are.

    Where it is worth less, a slow manoeuvre that saves a little way pays.
    """
    return _mean_share(scene) < TIMED_SHARE


def _mean_share(scene: Scene) -> float:
    """Return the mean of the robots' shares of driving."""
    driving = Preference.of(scene).driving
    return float(np.mean([energy_share(driving, robot) for robot in scene.robots]))


def brakes_hard(objective: Objective, robot: Robot) -> bool:
    """Return whether a robot brakes instead of rolling to a stop.

    Rolling saves the power of driving for as long as it takes longer.

    Args:
        objective: as of `energy_share`.
        robot: the robot.
    """
    return energy_share(objective, robot) < 0.5


def priced_world(scene: Scene, world: World) -> World:
    """Return the world with the ground as dear as its energy and time are worth.

    It is the world itself where only energy counts, and on slopes, where ways are what
    energy makes them.
    """
    share = _mean_share(scene)
    if share == 1.0 or scene.elevation is not None:
        return world
    multiplier = share * world.terrain.multiplier + (1.0 - share)
    return replace(world, terrain=world.terrain._replace(multiplier=multiplier))


def with_energies(
    roadmap: Roadmap, scene: Scene, world: World, margins: Margins
) -> Roadmap:
    """Return a roadmap of a priced world with distances that are energies.

    Args:
        roadmap: of `priced_world`.
        scene: the mission.
        world: its geometry, not priced.
        margins: stated for all robots.
    """
    vertex, successors = roadmap.arrays.vertex, roadmap.arrays.successor
    classes, class_of_robot = travel_classes(scene, world, margins)
    cost = np.zeros(successors.shape)
    for one, after, own in zip(classes, successors, cost, strict=True):
        here = np.broadcast_to(np.arange(len(vertex)), after.shape)[after >= 0]
        edge, which = np.unique(
            here * len(vertex) + after[after >= 0], return_inverse=True
        )
        ends = np.divmod(edge, len(vertex))
        costs = edge_costs(world, one, vertex, ends)
        leaving = np.isinf(costs[:, 0])
        costs[leaving] = edge_costs(
            world, one.leaving, vertex, (ends[0][leaving], ends[1][leaving])
        )
        own[after >= 0] = costs[which, 0]
    energies = along_ways(roadmap, cost)
    targets = len(roadmap.targets)
    between = energies[:, :, :targets].transpose(0, 2, 1)
    starts = energies[class_of_robot, :, targets + np.arange(len(scene.robots))]
    return replace(
        roadmap,
        # Out of a region that reaches across a wall, another vertex knows the way.
        distance=np.where(np.isfinite(between), between, roadmap.distance),
        start_distance=starts,
    )


def along_ways(roadmap: Roadmap, cost: np.ndarray) -> np.ndarray:
    """Return the sums of costs along the roadmap's ways, inf where there is none.

    Args:
        roadmap: the roadmap.
        cost: from each vertex to its successor on the way to each target, 0 at the end
            of the way, shape (F, T, V).

    Returns:
        From each vertex to each target, shape (F, T, V).
    """
    after = roadmap.arrays.successor
    here = np.broadcast_to(np.arange(after.shape[2]), after.shape)
    jump = np.where(after < 0, here, after).astype(np.int64)
    # Each round joins every piece of way to the equally long one that follows it.
    while True:
        further = np.take_along_axis(jump, jump, axis=2)
        cost = cost + np.take_along_axis(cost, jump, axis=2)
        if (further == jump).all():
            break
        jump = further
    return np.where(np.isfinite(roadmap.arrays.cost_to_go), cost, np.inf)


def way_lengths_m(roadmap: Roadmap) -> np.ndarray:
    """Return the length of the roadmap's way from each vertex to each target [m].

    From a vertex that has no way of its own it is inf. Shape (F, T, V).
    """
    vertex, after = roadmap.arrays.vertex, roadmap.arrays.successor
    here = np.broadcast_to(np.arange(len(vertex)), after.shape)
    jump = np.where(after < 0, here, after)
    step_m = np.hypot(*(vertex[jump] - vertex[here]).transpose(3, 0, 1, 2))
    return along_ways(roadmap, step_m)
