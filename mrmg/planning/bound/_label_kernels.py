"""Labels of tours under way, and what bounds the rest of a mission after them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.bound._completion_kernels import Completions
from mrmg.planning.routing._nrpa_kernels import RoutingArrays

NOTHING = -1
"""Parent of the first label."""


class TourSearch(NamedTuple):
    """What cheapest tours are sought among.

    Attributes:
        routing: the problem, whose costs drain batteries.
        goal_list: the open goals, shape (G,); those that are remembered come first.
        remembered: how many are; visits of the others are counted.
        is_counted: whether they are, of each node, shape (T + 1,).
        leg: what legs cost from arc to arc, shape (R, T + 1, K, T, K); row T is the
            start, in whose arc 0 robots are.
        drain: what they drain batteries by, likewise; but from stations, where from
            whatever arc batteries are full,
        station_drain: (R, S, T, K).
        nearest: the least that they cost to any arc, shape (R, T + 1, K, T).
        price: added to the cost of each visit, shape (T,).
        setting_out: what each robot pays in any case, shape (R,).
        finish: what the last leg costs from each node, shape (R, T + 1).
        rest: bounds of what is still to come, by which labels are dropped.
        most: cost of tours of interest; others may be missed.
    """

    routing: RoutingArrays
    goal_list: np.ndarray
    remembered: int
    is_counted: np.ndarray
    leg: np.ndarray
    drain: np.ndarray
    station_drain: np.ndarray
    nearest: np.ndarray
    price: np.ndarray
    setting_out: np.ndarray
    finish: np.ndarray
    rest: Completions
    most: float


class Labels(NamedTuple):
    """Labels in the order in which they were set, and room for candidates.

    Memory that is not written is not used.

    Attributes:
        value: cost and energy left, shape (N, 2).
        place: robot, node and arc, shape (N, 3).
        parent: the label that each one continues, shape (N,).
        first: number of the first label of the present robot in each state, and of the
            end, shape (X + 1,).
        near: labels that the present goal may follow, shape (N,).
        offer, origin: candidates' values and parents, shape (N, 2) and (N,).
        tried: how many candidates there were, shape (1,).
    """

    value: np.ndarray
    place: np.ndarray
    parent: np.ndarray
    first: np.ndarray
    near: np.ndarray
    offer: np.ndarray
    origin: np.ndarray
    tried: np.ndarray


@kernel
def set_trace(labels, k, r, node, arc, parent):
    """Write where label k is, and the label that it continues."""
    labels.place[k, 0], labels.place[k, 1], labels.place[k, 2] = r, node, arc
    labels.parent[k] = parent
