"""The least cost of tours that touch all goals, by where their borders are touched.

`bound` takes the way between two regions for granted however the robot gets from where
it enters a region to where it leaves it. Here a visit has one place: the arc of the
border where the region is first touched. Only tours whose cost can be below some limit
are looked at, so the result is the least cost of all tours or the limit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from mrmg.planning import _touring_kernels
from mrmg.planning._nrpa_kernels import RoutingArrays
from mrmg.planning.arcs import ArcWays
from mrmg.planning.geodesic import ARCS

MOST_LABELS = 4_000_000
"""Labels up to which tours are told apart by arcs."""

SLACK = 1e-6
"""Share by which tours may cost more than the best known; rounding loses none."""


def touring_bound_J(
    problem: RoutingArrays,
    tours: Sequence[Sequence[int]],
    ways: Sequence[ArcWays],
    price: np.ndarray,
    *,
    rounds: int,
) -> float:
    """Return a lower bound of the cost of all tours.

    Each round finds the cheapest tours by arcs, and tightens the ways they take.

    Args:
        problem: the relaxed routing problem, whose batteries limit tours.
        tours: cheapest tours of that problem, whose ways are tightened first.
        ways: of each robot.
        price: cost of a metre of plain ground of each robot, shape (R,).
        rounds: how often at most.
    """
    goal_list = np.flatnonzero(problem.open_goal)
    to_goal, way, start = _coarse(problem, goal_list)
    after, before = _touring_kernels.least_completions(way, start)
    best = float(before[0, 0])
    for _ in range(rounds):
        if not _tighten(ways, tours):
            break
        leg = _leg_table(ways, price)
        most = (1.0 + SLACK) * _cost_along(leg, tours)
        cost, last, trace = _touring_kernels.touring_labels(
            problem, goal_list, leg, to_goal, after, before, most, MOST_LABELS
        )
        if not len(trace):
            break
        best = max(best, min(cost, most))
        if not np.isfinite(cost):
            break
        tours = _tours_of(trace, last, len(ways), len(leg[0, 0, 0]))
    return best


def _tighten(ways: Sequence[ArcWays], tours: Sequence[Sequence[int]]) -> bool:
    """Tighten the ways that tours take; tell whether any had not been tightened yet."""
    legs = [
        (ways[r], *pair) for r, tour in enumerate(tours) for pair in _pairs(r, tour)
    ]
    with ThreadPoolExecutor() as threads:
        return any(list(threads.map(lambda leg: leg[0].tighten(*leg[1:]), legs)))


def _pairs(r: int, tour: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Return the legs of a tour; the start is -1 - r."""
    yield from zip((-1 - r, *tour), tour, strict=False)


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
