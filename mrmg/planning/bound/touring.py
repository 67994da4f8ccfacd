"""The least cost of tours that touch all goals, by where their borders are touched.

`bound` takes the way between two regions for granted however the robot gets from where
it enters a region to where it leaves it. Here a visit has one place: the arc of the
border where the region is first touched. Only tours whose cost can be below some limit
are looked at, so the result is the least cost of all tours or the limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from mrmg.planning.bound.arcs import ArcWays, Wave
from mrmg.planning.bound.borders import ARCS
from mrmg.planning.bound.exact_tours import cheapest_tours, completions
from mrmg.planning.halting import NEVER
from mrmg.planning.routing._nrpa_kernels import RoutingArrays

SLACK = 1e-6
"""Share by which tours may cost more than the best known; rounding loses none."""

STEP = 0.02
"""Share of what is proven by which costlier tours are looked at in the next round."""

LEAST_RISE = 0.005
"""Share by which one round with the cheapest tours must raise the bound for another."""

FINE_ARC_GOALS = 16
"""Goals up to which tours are told apart by all arcs; beyond, by pairs of them, as
otherwise labels would be too many."""

WORK_LABELS = 6_000_000
"""Labels that all rounds may set: some 5 s of one processor. The limit counts work, not
time, so that the same mission has the same bound on every machine."""


def touring_bound_J(
    problem: RoutingArrays,
    tours: Sequence[Sequence[int]],
    ways: Sequence[ArcWays],
    price: np.ndarray,
    *,
    proven_J: float = 0.0,
    rounds: int,
    work: int = WORK_LABELS,
    halt: np.ndarray = NEVER,
) -> float:
    """Return a lower bound of the cost of all tours.

    Each round looks for the cheapest tours by arcs among those that cost little more
    than what is proven, which proves as much if there are none, and tightens the ways
    that the cheapest ones take.

    Args:
        problem: the relaxed routing problem, whose batteries limit tours.
        tours: good tours of that problem, whose ways are tightened first.
        ways: of each robot.
        price: cost of a metre of plain ground of each robot, shape (R,).
        proven_J: a bound that is known already.
        rounds: how often at most.
        work: labels that all rounds may set.
        halt: shape (1,); no round begins once it has turned true.

    Returns:
        The bound; `proven_J` if no better one was found.
    """
    best, settled_J = proven_J, -math.inf
    leg = _leg_table(ways, price)
    rest = None
    for _ in range(rounds):
        tightened = _tighten(ways, leg, tours)
        settled = math.isfinite(settled_J)
        if halt[0] or (settled and not tightened):
            break
        leg = _leg_table(ways, price)
        merged = leg if problem.goals <= FINE_ARC_GOALS else _by_pairs(leg)
        rest = rest or completions(problem, merged)
        best = max(best, float(rest.before[0]))
        most, along_J = (1.0 + STEP) * best, (1.0 + SLACK) * _cost_along(leg, tours)
        if best < along_J:
            most = min(most, along_J)
        found, labels = cheapest_tours(problem, merged, rest, most, work)
        work -= labels
        if found is None:
            break
        enough = False
        if found.feasible:
            best, tours = max(best, found.cost_J), found.tours
            enough = best < (1.0 + LEAST_RISE) * settled_J
            settled_J = best
        else:
            best = max(best, most)
        if enough or work < labels:  # the next round takes more
            break
    return best


def _by_pairs(leg: np.ndarray) -> np.ndarray:
    """Return what legs cost at least between pairs of neighbouring arcs."""
    halves = [leg[:, :, i::2, :, j::2] for i in (0, 1) for j in (0, 1)]
    return np.ascontiguousarray(np.minimum.reduce(halves))


def _tighten(
    ways: Sequence[ArcWays], leg: np.ndarray, tours: Sequence[Sequence[int]]
) -> bool:
    """Tighten the ways that tours take; return whether any was new."""
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
