"""Every route a search has met, and the cheapest fleet that can be made of them.

A search that changes a few goals at a time seldom meets all routes of the best answer
at once; it meets each of them much sooner. For few goals the cheapest choice of one
route for each robot that shares out all goals is found exactly, over subsets.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing._subset_kernels import join_robot

MOST_POOLED = 10
"""Open goals up to which routes are pooled; subsets of subsets are 3 to that power."""


class Pool(NamedTuple):
    """The cheapest route met for each robot and set of goals, numbered by its bits.

    Attributes:
        bit: of each goal in the number of a set; 0 for goals that are not open, (G,).
        cost: of the route [J], inf if none was met, shape (R, sets).
        goal: its goals in order, shape (R, sets, goals).
        length: their number, shape (R, sets).
    """

    bit: np.ndarray
    cost: np.ndarray
    goal: np.ndarray
    length: np.ndarray


def new_pool(problem: RoutingArrays) -> Pool:
    """Return an empty pool; one without room if there are too many goals."""
    robots, goals = len(problem.energy), np.flatnonzero(problem.open_goal)
    if len(goals) > MOST_POOLED or problem.makespan_weight > 0.0:
        goals = goals[:0]
    bit = np.zeros(problem.goals, np.int64)
    bit[goals] = 1 << np.arange(len(goals))
    sets = 1 << len(goals)
    return Pool(
        bit,
        np.full((robots, sets), np.inf),
        np.zeros((robots, sets, len(goals)), np.int64),
        np.zeros((robots, sets), np.int64),
    )


@kernel
def pool_route(pool, r, goal, length, cost):
    """Keep a route of robot r if it is cheaper than all others of the same goals."""
    if pool.cost.shape[1] == 1:
        return
    members = 0
    for i in range(length):
        members += pool.bit[goal[i]]
    if cost < pool.cost[r, members]:
        pool.cost[r, members] = cost
        pool.length[r, members] = length
        for i in range(length):
            pool.goal[r, members, i] = goal[i]


@kernel
def combine(pool, routes):
    """Set the routes to the cheapest choice of pooled ones that shares out all goals.

    They are left as they are if the pool has no room.
    """
    robots, sets = pool.cost.shape
    if sets == 1:
        return
    least = np.full(sets, np.inf)
    least[0] = 0.0
    own = np.zeros((robots, sets), np.int64)
    for r in range(robots):
        least, share = join_robot(least, pool.cost[r], False)
        for part in range(sets):
            own[r, part] = share[part]
    done = sets - 1
    if least[done] == np.inf:
        return
    routes.length[robots] = 0
    for r in range(robots - 1, -1, -1):
        part = own[r, done]
        routes.length[r] = pool.length[r, part]
        for i in range(pool.length[r, part]):
            routes.goal[r, i] = pool.goal[r, part, i]
        routes.front[r] = routes.back[r] = 0
        done ^= part
