"""Exact tours of small missions: who visits what, in which order and where to charge.

Label setting over (goals visited, node) per robot, where a label is (cost, energy left)
and one that costs no less and leaves no more energy is dropped; then the best division
of the goals among the robots.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from mrmg.planning.bound import _bound_kernels
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.routing import Routing

MOST_GOALS = 14
"""Goals up to which tours are exact."""

MOST_LABELS = 3_000_000
"""Labels per robot up to which tours are exact."""


def exact_routing(problem: RoutingArrays) -> Routing | None:
    """Return the cheapest tours there are, stations in any number and order.

    Label setting over (goals visited, place) per robot, where a label is (cost, energy
    left) and one that costs no less and leaves no more energy is dropped; then the best
    division of the goals among the robots. Costs need not be a metric.

    Returns:
        The tours, with infinite cost if there are none; None if the mission is too
        large (more than MOST_GOALS open goals or MOST_LABELS labels), or if time
        matters in it.
    """
    goal_list = np.flatnonzero(problem.open_goal)
    timed = problem.makespan_weight > 0.0 or bool((problem.limit < np.inf).any())
    if timed or len(goal_list) > MOST_GOALS:
        return None
    fleet = np.full(1 << len(goal_list), np.inf)
    fleet[0] = 0.0
    ways, shares = [], []
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as threads:
        found = [
            threads.submit(RobotWays, problem, r, goal_list)
            for r in range(len(problem.energy))
        ]
        for future in found:
            way = future.result()
            if not way.complete:
                threads.shutdown(cancel_futures=True)
                return None
            fleet, share = _bound_kernels.join_robot(fleet, way.cost)
            ways.append(way)
            shares.append(share)
    mask = len(fleet) - 1
    if not np.isfinite(fleet[mask]):
        return Routing(tuple(() for _ in ways), math.inf)
    tours: list[tuple[int, ...]] = []
    for way, share in zip(reversed(ways), reversed(shares), strict=True):
        tours.append(way.tour(int(share[mask])))
        mask ^= int(share[mask])
    return Routing(tuple(reversed(tours)), float(fleet[-1]))


class RobotWays:
    """The undominated ways of one robot to visit each subset of the goals."""

    def __init__(self, problem: RoutingArrays, r: int, goal_list: np.ndarray) -> None:
        self.goal_list = goal_list
        self.goals = problem.goals
        self.hop, self.next_station = station_closure(problem, r)
        self.label, self.parent, self.start_of, station, self.came = (
            _bound_kernels.subset_labels(problem, r, self.hop, goal_list, MOST_LABELS)
        )
        self.cost, self.last = _bound_kernels.cheapest_labels(
            problem, r, goal_list, self.label, self.start_of, station
        )
        self.complete = int(self.start_of[-1]) == len(self.label)

    def tour(self, mask: int) -> tuple[int, ...]:
        """Return the cheapest tour through a subset of the goals."""
        backwards: list[int] = []
        label = int(self.last[mask])
        while label != -1:
            if label <= -2:
                station = -2 - label
                label, first = (int(i) for i in self.came[mask, station])
                chain = [first]
                while chain[-1] != station:
                    chain.append(int(self.next_station[chain[-1], station]))
                backwards += [self.goals + s for s in reversed(chain)]
                continue
            state = int(np.searchsorted(self.start_of, label, side="right")) - 1
            goal = state % len(self.goal_list)
            mask = state // len(self.goal_list) ^ (1 << goal)
            backwards.append(int(self.goal_list[goal]))
            label = int(self.parent[label])
        return tuple(reversed(backwards))


def station_closure(problem: RoutingArrays, r: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (least cost, next station) from station to station over any others."""
    goals = problem.goals
    hop = problem.cost[r, goals:-1, goals:].copy()
    hop[hop > problem.capacity[r] - problem.reserve[r]] = np.inf
    np.fill_diagonal(hop, 0.0)
    follower = np.tile(np.arange(len(hop)), (len(hop), 1))
    for k in range(len(hop)):
        over = hop[:, k : k + 1] + hop[k : k + 1]
        shorter = over < hop
        hop = np.where(shorter, over, hop)
        follower = np.where(shorter, follower[:, k : k + 1], follower)
    return np.ascontiguousarray(hop), follower
