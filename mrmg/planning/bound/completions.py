"""Bounds of what the rest of a mission costs, by which tours are searched for.

Few goals are remembered one by one; where there are many, visits of some are only
counted (`counted_visits`). Penalties stand for batteries (`_completion_kernels`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mrmg.planning.bound import _completion_kernels
from mrmg.planning.bound._completion_kernels import Completions, Legs
from mrmg.planning.routing._nrpa_kernels import RoutingArrays

Penalties = tuple[float, ...]
"""For each joule above what a battery holds: after a tour's last charge, and before.
Without the second one no charges are counted, and legs lead over any stations."""

NO_PENALTIES: Penalties = (0.0,)

PENALTIES: tuple[Penalties, ...] = (
    NO_PENALTIES,
    *((share * one, one) for one in (0.05, 0.1, 0.2, 0.4) for share in (0.5, 1.0)),
)
"""Penalties of which the best ones are taken."""

PENALTY_GOALS = 10
"""Goals remembered at most where penalties are compared."""


@dataclass(frozen=True)
class Visits:
    """Which goals are visited, and which visits are remembered.

    Tours that visit every goal once, from each start at most one, pay all prices once
    and no more than all tolls; both together are taken off their cost.

    Attributes:
        order: numbers of the goals, shape (G,); those that are remembered come first.
        remembered: how many are; visits of the others are only counted.
        price: what a visit of each target costs in addition [J], shape (T,).
        toll: what a robot's first leg costs in addition [J], at least 0, shape (R,).
    """

    order: np.ndarray
    remembered: int
    price: np.ndarray
    toll: np.ndarray

    @staticmethod
    def all_remembered(problem: RoutingArrays) -> Visits:
        """Return the visits of a mission of few goals."""
        order = np.flatnonzero(problem.open_goal)
        robots, _, targets = problem.cost.shape
        return Visits(order, len(order), np.zeros(targets), np.zeros(robots))

    @property
    def surcharge(self) -> float:
        """What tours that visit every goal once pay too much at most [J]."""
        return float(self.price[self.order].sum() + self.toll.sum())


def no_completions(problem: RoutingArrays, visits: Visits) -> Completions:
    """Return completions that know nothing, for searches among all tours."""
    robots, nodes, targets = problem.cost.shape
    goals = len(visits.order)
    states = (goals - visits.remembered + 1) << visits.remembered
    return Completions(
        after=np.zeros((1, states, goals)),
        before=np.zeros(states),
        from_station=np.zeros((robots, 1, targets - problem.goals, goals)),
        to_finish=np.zeros((robots, nodes)),
        penalty=np.zeros(1),
        full_J=0.0,
    )


def completions(
    problem: RoutingArrays,
    leg: np.ndarray | None = None,
    visits: Visits | None = None,
    penalty: Penalties | None = None,
) -> Completions:
    """Return what the rest of a mission costs at least, for all that may be done.

    Args:
        problem: the mission.
        leg: what legs cost from arc to arc, shape (R, T + 1, K, T, K), by which every
            second goal is left at the arc that it is touched at; None for those of
            the mission.
        visits: of goals; all are remembered if None.
        penalty: for each joule above what a battery holds; good ones if None.
    """
    visits = visits or Visits.all_remembered(problem)
    if penalty is None:
        penalty = good_penalties(problem, visits)
    legs = least_legs(problem, visits, leg, penalty)
    tables = _completion_kernels.completions(legs, visits.remembered)
    price = visits.price[visits.order]
    return Completions(
        after=tables.after,
        before=tables.before,
        from_station=_from_stations(problem, visits, penalty) + price,
        to_finish=_with_finish(problem)[:, :, -1].copy(),
        penalty=np.array(penalty),
        full_J=_full_J(problem) if len(penalty) > 1 else 0.0,
    )


def good_penalties(problem: RoutingArrays, visits: Visits) -> Penalties:
    """Return the penalties with the highest bound where few goals are remembered."""
    few = replace(visits, remembered=min(visits.remembered, PENALTY_GOALS))
    best, best_J = NO_PENALTIES, -math.inf
    recharge = problem.cost.shape[2] > problem.goals and _full_J(problem) < math.inf
    for penalty in PENALTIES if recharge else ():
        legs = least_legs(problem, few, None, penalty)
        tables = _completion_kernels.completions(legs, few.remembered)
        if tables.before[0] > best_J:
            best, best_J = penalty, float(tables.before[0])
    return best


def least_legs(
    problem: RoutingArrays,
    visits: Visits,
    leg: np.ndarray | None = None,
    penalty: Penalties = NO_PENALTIES,
) -> Legs:
    """Return the least legs of any robot; see `completions` for what is given."""
    goals, start, order = problem.goals, problem.cost.shape[2], visits.order
    stations, alike = slice(goals, start), np.arange(len(order))
    usable = problem.energy - problem.reserve
    price, toll = visits.price[order], visits.toll[:, None]
    charges = len(penalty) > 1
    full_J = _full_J(problem) if charges else 0.0
    missing = full_J - usable[:, None] if charges else 0.0 * toll
    direct = np.concatenate([problem.cost, problem.finish[:, :, None]], axis=2)
    chained = _with_finish(problem)
    least = direct if charges else chained
    between = least[:, order][:, :, order].min(axis=0)
    between[alike, alike] = np.inf
    pair = np.zeros((0, 0, 0))
    if leg is not None:
        by_way = range(start if charges else goals, start)
        pair = _pairs(leg.min(axis=0), least.min(axis=0), by_way, order)
        pair[alike, alike] = pair[:, alike, alike] = pair[alike, :, alike] = np.inf
    first = least[:, start, order] + toll
    drained = np.where(np.isfinite(first), first - toll + missing, 0.0)
    from_start = [(first + one * drained).min(axis=0) for one in penalty]
    to_end = (1.0 + penalty[0]) * least[:, order, start].min(axis=0)
    to_station = (1.0 + penalty[-1]) * direct[:, order, stations].min(axis=0)
    legs = Legs(
        between=between,
        pair=pair,
        scale=1.0 + np.array(penalty),
        from_start=np.array(from_start),
        from_station=_from_stations(problem, visits, penalty).min(axis=0),
        to_end=to_end - penalty[0] * full_J,
        to_station=to_station - penalty[-1] * full_J,
        start_station=(chained[:, start, stations] + toll).min(axis=0),
        station_end=chained[:, stations, start].min(axis=0),
        price=price,
    )
    return Legs(*(np.ascontiguousarray(each) for each in legs))


def _full_J(problem: RoutingArrays) -> float:
    """Return the most usable energy of a battery."""
    most = np.maximum(problem.energy, problem.capacity)
    return float((most - problem.reserve).max())


def _with_finish(problem: RoutingArrays) -> np.ndarray:
    """Return least costs over any stations, finishes last, shape (R, T + 1, T + 1)."""
    cost = np.concatenate([problem.cost, problem.finish[:, :, None]], axis=2)
    return over_stations(cost, range(problem.goals, problem.cost.shape[2]))


def _from_stations(
    problem: RoutingArrays, visits: Visits, penalty: Penalties
) -> np.ndarray:
    """Return least costs from station to goal over any stations, shape (R, M, S, G).

    The last leg of them has a penalty.
    """
    stations = slice(problem.goals, problem.cost.shape[2])
    chained = _with_finish(problem)[:, stations, stations].copy()
    number = np.arange(chained.shape[1])
    chained[:, number, number] = 0.0
    last = problem.cost[:, stations][:, :, visits.order]
    parts = [chained[..., None] + (1.0 + one) * last[:, None] for one in penalty]
    return np.stack([part.min(axis=2, initial=np.inf) for part in parts], axis=1)


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
