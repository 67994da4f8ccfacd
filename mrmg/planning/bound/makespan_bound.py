"""A proven lower bound of a mission's duration.

As in the bound of energy (`bound`), whoever solves a mission visits the goals in some
order, each robot a part of them, and drives on to its finish if it has one, on ways no
shorter than the shortest round obstacles.
Here robots drive them at top speed on any ground, from rest to rest, and stay at goals
as long as they must; the longest time of a robot is the mission's. Batteries, turning
and other robots could only make it longer. The least over all divisions and orders is
the bound.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrmg.planning.bound._subset_kernels import least_division
from mrmg.planning.bound.bound import ROUNDING_SHARE, relaxed_routing_J
from mrmg.planning.bound.exact_tours import (
    MOST_GOALS,
    least_costs,
    of_robot,
    with_endless_batteries,
)
from mrmg.planning.bound.relaxation import CELLS, Relaxation
from mrmg.planning.halting import NEVER, check
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.scene.types import Robot, Scene

CUSTOM_WAY_SHARE = 0.02
"""By how much a custom motion model may lead farther than its speeds say: see
`mrmg.testing.MotionContract`."""


def makespan_bound_s(
    scene: Scene,
    *,
    step_s: float = 0.1,
    cells: int = CELLS,
    halt: np.ndarray = NEVER,
) -> float:
    """Return a time [s] before which no plan of a mission is over.

    Args:
        scene: the mission.
        step_s: time step of the plans.
        cells: cells of the grid on which ways are bounded; more bring the bound nearer
            to the truth.
        halt: shape (1,); the bound is given up once it has turned true.

    Returns:
        The bound, at least 0; inf if some goal cannot be reached.

    Raises:
        Halted: if it was given up.
    """
    if not scene.has_destinations:
        return 0.0
    if len(scene.goals) > MOST_GOALS:
        bound_s = _relaxed_s(scene, _metres(scene, step_s, cells, halt))
    else:
        times_s = least_times_s(scene, step_s=step_s, cells=cells, halt=halt)
        bound_s = float(least_division(times_s, True))
    return max(0.0, bound_s) * (1.0 - ROUNDING_SHARE)


def least_times_s(
    scene: Scene, *, step_s: float, cells: int, halt: np.ndarray = NEVER
) -> np.ndarray:
    """Return the least time of each robot for each subset of the goals, (R, 2^G).

    Raises:
        Halted: once `halt[0]` has turned true.
    """
    metres, goals = _metres(scene, step_s, cells, halt), np.arange(len(scene.goals))
    times_s = []
    for r, robot in enumerate(scene.robots):
        check(halt)
        way_m = least_costs(of_robot(metres, r), goals)
        assert way_m is not None, "without batteries a state has one label"
        times_s.append(_times_s(robot, way_m, _stays_s(scene)))
    return np.array(times_s)


def _metres(scene: Scene, step_s: float, cells: int, halt: np.ndarray) -> RoutingArrays:
    """Return the problem whose costs are lengths, and whose batteries never run out."""
    flat = replace(scene, terrain=(), elevation=None)
    relaxed = Relaxation.of(flat, step_s=step_s, cells=cells, halt=halt)
    return with_endless_batteries(_over(relaxed.problem, relaxed.price))


def _over(problem: RoutingArrays, divisor: np.ndarray) -> RoutingArrays:
    """Return a problem whose costs are divided by a number of each robot, (R,)."""
    return problem._replace(
        cost=problem.cost / divisor[:, None, None],
        finish=problem.finish / divisor[:, None],
    )


def _stays_s(scene: Scene) -> np.ndarray:
    """Return how long a robot stays that visits each subset of the goals, (2^G,)."""
    stay_s = np.zeros(1)
    for goal in scene.goals:
        stay_s = np.concatenate([stay_s, stay_s + goal.dwell_s])
    return stay_s


def _fastest_m_s(robot: Robot) -> float:
    """Return the way that a robot drives in a second at most [m/s]."""
    own = 1.0 + CUSTOM_WAY_SHARE if robot.model.has_custom_motion else 1.0
    return own * robot.model.top_speed_m_s


def _times_s(robot: Robot, way_m: np.ndarray, stay_s: np.ndarray) -> np.ndarray:
    """Return the least times of ways between regions and of stays in them.

    A robot may speed up while it stays, but not all of its ways and stays fit into less
    than both at top speed, nor its ways into less than they take from rest to rest.
    """
    top_m_s = _fastest_m_s(robot)
    times_s: np.ndarray = way_m / top_m_s + stay_s
    if robot.model.has_custom_motion:
        return times_s  # nothing is known of how it speeds up
    strongest = robot.model.limits.u1_max_m_s2
    long = way_m >= top_m_s * top_m_s / strongest
    ramped_s = np.where(
        long,
        way_m / top_m_s + top_m_s / strongest,
        2.0 * np.sqrt(way_m / strongest),
    )
    return np.asarray(np.maximum(times_s, ramped_s))


def _relaxed_s(scene: Scene, metres: RoutingArrays) -> float:
    """Return a bound for any number of goals.

    That is the largest of the least times to each goal, and all driving and staying
    divided equally among all robots.
    """
    top_m_s = np.array([_fastest_m_s(robot) for robot in scene.robots])
    times = _over(metres, top_m_s)
    stay_s = np.array([goal.dwell_s for goal in scene.goals])
    nearest_s = times.cost[:, -1] + times.finish[:, :-1]
    nearest_s = nearest_s[:, : len(scene.goals)].min(axis=0)
    shared_s = (relaxed_routing_J(times) + stay_s.sum()) / len(scene.robots)
    return float(max((nearest_s + stay_s).max(), shared_s))
