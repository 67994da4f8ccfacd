"""The least cost of tours that touch all goals, by where their borders are touched.

`bound` takes the way between two regions for granted however the robot gets from where
it enters a region to where it leaves it. Here a visit has one place: the arc of the
border where the region is first touched. Only tours whose cost can be below some limit
are looked at, so the result is the least cost of all tours or the limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from mrmg.planning.bound import _touring_kernels
from mrmg.planning.bound.arcs import ArcWays, Wave
from mrmg.planning.bound.geodesic import ARCS
from mrmg.planning.halting import NEVER
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.routing import Routing

MOST_LABELS = 4_000_000
"""Labels up to which tours are told apart by arcs."""

AGAIN = 3
"""Times that the ways of the same tours are tightened again: tight ones lead elsewhere.
"""

SLACK = 1e-6
"""Share by which tours may cost more than the best known; rounding loses none."""

SHARES = (0.02, 0.08)
"""What the cheapest tours may cost more than if batteries lasted for ever, as a share
of that: they are first sought within the first share, then within the next."""


@dataclass(frozen=True)
class Completions:
    """What the rest of a mission costs at least, were batteries to last for ever.

    Attributes:
        goal_list: the open goals, shape (G,).
        from_station: least cost from station to goal, over any stations, (R, S, G).
        after: with a robot at a goal and goals visited, shape (R, 2^G, G).
        before: with a robot that has not set out, shape (R + 1, 2^G).
    """

    goal_list: np.ndarray
    from_station: np.ndarray
    after: np.ndarray
    before: np.ndarray

    @staticmethod
    def of(problem: RoutingArrays) -> Completions:
        """Work out all completions of a mission."""
        goal_list = np.flatnonzero(problem.open_goal)
        from_station, way, start = _coarse(problem, goal_list)
        after, before = _touring_kernels.least_completions(way, start)
        return Completions(goal_list, from_station, after, before)

    @property
    def cost_J(self) -> float:
        """What the whole mission costs at least."""
        return float(self.before[0, 0])

    def cheapest(
        self, problem: RoutingArrays, leg: np.ndarray, most: float
    ) -> tuple[float, list[list[int]]] | None:
        """Return the cost of the cheapest tours and these, if it is `most` or less.

        Args:
            problem: the mission, whose least legs drain batteries.
            leg: what legs cost from arc to arc, shape (R, T + 1, K, T, K).
            most: cost of tours of interest.

        Returns:
            Infinite cost and empty tours if all cost more; None if that takes too many
            labels to tell.
        """
        robots, start = leg.shape[:2]
        cost, last, trace = _touring_kernels.touring_labels(
            problem,
            self.goal_list,
            leg,
            self.from_station,
            self.after,
            self.before,
            most,
            MOST_LABELS,
        )
        if not len(trace):
            return None
        return float(cost), _tours_of(trace, last, robots, start - 1)


def near_routing(problem: RoutingArrays, completions: Completions) -> Routing | None:
    """Return the cheapest tours if they cost little more than without batteries.

    Returns:
        The tours, with infinite cost if no robot can reach some goal; None if they are
        not within reach.
    """
    least_J = completions.cost_J
    if not np.isfinite(least_J):
        return Routing(tuple(() for _ in problem.energy), least_J)
    leg = np.ascontiguousarray(problem.cost[:, :, None, :, None])
    for share in SHARES:
        found = completions.cheapest(problem, leg, (1.0 + share) * least_J)
        if found is None:
            break
        cost_J, tours = found
        if np.isfinite(cost_J):
            return Routing(tuple(tuple(tour) for tour in tours), cost_J)
    return None


def touring_bound_J(
    problem: RoutingArrays,
    completions: Completions,
    tours: Sequence[Sequence[int]],
    ways: Sequence[ArcWays],
    price: np.ndarray,
    *,
    rounds: int,
    halt: np.ndarray = NEVER,
) -> float:
    """Return a lower bound of the cost of all tours.

    Each round finds the cheapest tours by arcs, and tightens the ways they take.

    Args:
        problem: the relaxed routing problem, whose batteries limit tours.
        completions: of that problem.
        tours: cheapest tours of that problem, whose ways are tightened first.
        ways: of each robot.
        price: cost of a metre of plain ground of each robot, shape (R,).
        rounds: how often at most.
        halt: shape (1,); no round begins once it has turned true.
    """
    best = completions.cost_J
    leg = _leg_table(ways, price)
    for _ in range(rounds):
        if halt[0] or not _tighten(ways, leg, tours):
            break
        leg = _leg_table(ways, price)
        for _ in range(AGAIN):
            if halt[0] or not _tighten(ways, leg, tours):
                break
            leg = _leg_table(ways, price)
        most = (1.0 + SLACK) * _cost_along(leg, tours)
        found = completions.cheapest(problem, leg, most)
        if found is None:
            break
        cost, tours = found
        best = max(best, min(cost, most))
        if not np.isfinite(cost):
            break
    return best


def _tighten(
    ways: Sequence[ArcWays], leg: np.ndarray, tours: Sequence[Sequence[int]]
) -> bool:
    """Tighten the ways that tours take; tell whether any had not been tightened yet."""
    new: dict[tuple[int, Wave], ArcWays] = {}
    for r, tour in enumerate(tours):
        arcs = _arcs_along(leg[r], tour)
        for one in zip((-1 - r, *tour), (0, *arcs), tour, arcs, strict=False):
            new |= {(id(ways[r]), wave): ways[r] for wave in ways[r].waves(*one)}
    with ThreadPoolExecutor() as threads:
        found = threads.map(lambda at: new[at].certificate(at[1]), new)
        for (key, wave), apart in zip(new, found, strict=True):
            new[key, wave].take(wave, apart)
    return bool(new)


def _arcs_along(leg: np.ndarray, tour: Sequence[int]) -> list[int]:
    """Return the arcs that a robot touches its targets at for the least cost.

    Args:
        leg: what its legs cost, shape (T + 1, K, T, K).
        tour: its targets.
    """
    cost, place = np.where(np.arange(ARCS) == 0, 0.0, np.inf), len(leg) - 1
    origins: list[np.ndarray] = []
    for target in tour:
        over = cost[:, None] + leg[place, :, target]
        origins.append(over.argmin(axis=0))
        cost, place = over.min(axis=0), target
    arcs = [int(cost.argmin())]
    for origin in reversed(origins):
        arcs.append(int(origin[arcs[-1]]))
    return arcs[-2::-1]  # the last one found is that of the start


def _leg_table(ways: Sequence[ArcWays], price: np.ndarray) -> np.ndarray:
    """Return what legs cost from arc to arc, shape (R, T + 1, K, T, K)."""
    count = len(ways[0].ways.regions)
    leg = np.full((len(ways), count + 1, ARCS, count, ARCS), np.inf)
    for r, one in enumerate(ways):
        leg[r, :count] = price[r] * one.between
        leg[r, count, 0] = price[r] * one.from_start[r]
    return leg


def _coarse(
    problem: RoutingArrays, goal_list: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return least costs from station, goal and start to goals, over any stations.

    Batteries are taken to last for ever. Shapes (R, S, G), (R, G, G) and (R, G).
    """
    goals = problem.goals
    targets = problem.cost.shape[2]
    hop = problem.cost[:, goals:targets, goals:].copy()
    for k in range(targets - goals):
        hop = np.minimum(hop, hop[:, :, k : k + 1] + hop[:, k : k + 1])
        hop[:, k, k] = 0.0
    direct = problem.cost[:, :, goal_list]
    to_goal = direct[:, goals:targets]
    if targets > goals:
        to_goal = (hop[..., None] + to_goal[:, None]).min(axis=2)
        over = (problem.cost[:, :, goals:, None] + to_goal[:, None]).min(axis=2)
        direct = np.minimum(direct, over)
    way = np.ascontiguousarray(direct[:, goal_list])
    return np.ascontiguousarray(to_goal), way, np.ascontiguousarray(direct[:, targets])


def _cost_along(leg: np.ndarray, tours: Sequence[Sequence[int]]) -> float:
    """Return the least cost of given tours, whatever arcs they touch."""
    total = 0.0
    for table, tour in zip(leg, tours, strict=True):
        cost, place = np.where(np.arange(ARCS) == 0, 0.0, np.inf), len(table) - 1
        for target in tour:
            cost = (cost[:, None] + table[place, :, target]).min(axis=0)
            place = target
        total += float(cost.min())
    return total


def _tours_of(trace: np.ndarray, last: int, robots: int, start: int) -> list[list[int]]:
    """Return the tours that end with a label."""
    tours: list[list[int]] = [[] for _ in range(robots)]
    while last >= 0:
        robot, place, _, last = trace[last].tolist()
        if place != start:
            tours[robot].insert(0, place)
    return tours
