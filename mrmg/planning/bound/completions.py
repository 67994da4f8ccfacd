"""Bounds of what the rest of a mission costs, by which tours are searched for.

Few goals are remembered one by one; where there are many, visits of some are only
counted (`counted_visits`). Batteries last for ever.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.planning.bound import _completion_kernels
from mrmg.planning.bound._completion_kernels import Completions, Legs
from mrmg.planning.routing._nrpa_kernels import RoutingArrays


@dataclass(frozen=True)
class Visits:
    """Which goals are visited, and which visits are remembered.

    Tours of all robots that visit every goal once pay all prices once, which is taken
    off their cost. Robots that are not needed pay for setting out, too.

    Attributes:
        order: numbers of the goals, shape (G,); those that are remembered come first.
        remembered: how many are; visits of the others are only counted.
        price: what a visit of each target costs in addition [J], shape (T,).
        setting_out: what each robot pays when it sets out [J], shape (R,), at least 0.
    """

    order: np.ndarray
    remembered: int
    price: np.ndarray
    setting_out: np.ndarray

    @staticmethod
    def all_remembered(problem: RoutingArrays) -> Visits:
        """Return the visits of a mission of few goals."""
        return Visits.remembering(problem, np.flatnonzero(problem.open_goal))

    @staticmethod
    def remembering(problem: RoutingArrays, goals: np.ndarray) -> Visits:
        """Return the visits of some goals, all remembered, at no price."""
        price = np.zeros(problem.cost.shape[2])
        return Visits(goals, len(goals), price, np.zeros(len(problem.energy)))

    @property
    def surcharge(self) -> float:
        """What tours that visit every goal once pay too much [J]."""
        return float(self.price[self.order].sum() + self.setting_out.sum())


def completions(
    problem: RoutingArrays,
    leg: np.ndarray | None = None,
    visits: Visits | None = None,
) -> Completions:
    """Return what the rest of a mission costs at least, for all that may be done.

    Args:
        problem: the mission.
        leg: what legs cost from arc to arc, shape (R, T + 1, K, T, K), by which every
            second goal is left at the arc that it is touched at; None for those of
            the mission.
        visits: of goals; all are remembered if None.
    """
    visits = visits or Visits.all_remembered(problem)
    legs = least_legs(problem, visits, leg)
    tables = _completion_kernels.completions(legs, visits.remembered)
    stations, chained = slice(problem.goals, -1), _with_finish(problem)
    return Completions(
        after=tables.after,
        before=tables.before,
        from_station=np.ascontiguousarray(
            chained[:, stations, visits.order] + legs.price
        ),
        to_finish=chained[:, :, -1].copy(),
    )


def least_legs(
    problem: RoutingArrays, visits: Visits, leg: np.ndarray | None = None
) -> Legs:
    """Return the least legs of any robot; see `completions` for what is given."""
    start, order = problem.cost.shape[2], visits.order
    alike, least = np.arange(len(order)), _with_finish(problem)
    between = least[:, order][:, :, order].min(axis=0)
    between[alike, alike] = np.inf
    pair = np.zeros((0, 0, 0))
    if leg is not None:
        stations = range(problem.goals, start)
        pair = _pairs(leg.min(axis=0), least.min(axis=0), stations, order)
        pair[alike, alike] = pair[:, alike, alike] = pair[alike, :, alike] = np.inf
    legs = Legs(
        between=between,
        pair=pair,
        from_start=(least[:, start, order] + visits.setting_out[:, None]).min(axis=0),
        to_end=least[:, order, start].min(axis=0),
        price=visits.price[order],
    )
    return Legs._make(map(np.ascontiguousarray, legs))


def first_legs(problem: RoutingArrays, order: np.ndarray) -> np.ndarray:
    """Return the least costs from each start to goals, over any stations, (R, G)."""
    return np.asarray(_with_finish(problem)[:, problem.cost.shape[2], order])


def _with_finish(problem: RoutingArrays) -> np.ndarray:
    """Return least costs over any stations, finishes last, shape (R, T + 1, T + 1)."""
    cost = np.concatenate([problem.cost, problem.finish[:, :, None]], axis=2)
    return over_stations(cost, range(problem.goals, problem.cost.shape[2]))


def _pairs(
    leg: np.ndarray, cost: np.ndarray, stations: range, goal_list: np.ndarray
) -> np.ndarray:
    """Return what two legs cost at least with the same arc in the middle, (G, G, G).

    Args:
        leg: least cost of any robot from arc to arc, shape (T + 1, K, T, K).
        cost: over any stations from node to node, shape (T + 1, T + 1).
        stations: numbers of the stations, which robots may visit on both legs.
        goal_list: the goals that are visited, shape (G,).
    """
    into = leg.min(axis=1)[goal_list][:, goal_list]
    out = leg.min(axis=3)[goal_list][..., goal_list]
    for s in stations:
        from_s, to_s = leg[s].min(axis=0)[goal_list], leg[goal_list, :, s].min(axis=2)
        into = np.minimum(into, cost[goal_list, s, None, None] + from_s)
        out = np.minimum(out, to_s[..., None] + cost[s, goal_list])
    return np.asarray((into[..., None] + out).min(axis=2))


def over_stations(cost: np.ndarray, stations: range) -> np.ndarray:
    """Return the least costs over any stations (Floyd 1962, Warshall 1962).

    Args:
        cost: from node to node, shape (R, N, M), where the first nodes are the same.
        stations: numbers of the nodes that may lie on the way.
    """
    for k in stations:
        cost = np.minimum(cost, cost[:, :, k, None] + cost[:, None, k])
    return cost
