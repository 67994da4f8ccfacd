"""The least cost of tours that touch all goals, by where their borders are touched.

`bound` takes the way between two regions for granted however the robot gets from where
it enters a region to where it leaves it. Here a visit has one place: the arc of the
border where the region is first touched; who touches goals inside a station enters it
before and leaves it afterwards, which may count as two visits. Only tours whose cost
can be below some limit are looked at, so the result is the least cost of all tours or
the limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise, product

import numpy as np

from mrmg.planning.bound.arcs import ArcWays, Pair
from mrmg.planning.bound.borders import ARCS
from mrmg.planning.bound.completions import Visits, completions
from mrmg.planning.bound.exact_tours import cheapest_tours
from mrmg.planning.halting import NEVER
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.routing import Routing

STEP, FINE_STEP = 0.02, 0.005
"""Shares of what is proven by which costlier tours are looked at in the next round,
before and after the cheapest ones of some round are known."""

LEAST_RISE = 0.001
"""Share by which a round must raise the bound to be followed by another."""

FINE_ARC_GOALS = 16
"""Goals up to which tours are told apart by all arcs; beyond, by pairs of them, as
otherwise labels would be too many ..."""

FINE_ARC_LEGS = 20_000_000
"""... and legs from arc to arc up to which they are, by their memory (160 MB)."""

SHORT_ROUND = 1_000
"""Labels of a round up to which the next one's step may be longer in any case."""

LONG_ROUND = 100_000
"""Labels of a round, some 0.3 s of work, after which the ways between near places are
tightened, too: later rounds then set fewer labels, or prove more."""

NEAREST = 5
"""How many places are near to each place."""

WORK_LABELS = 8_000_000
"""Labels that all rounds may set: some 6 s of one processor. The limit counts work, not
time, so that the same mission has the same bound on every machine."""

Pairs = dict[tuple[int, Pair], ArcWays]
"""Ways by their identities and pairs of places."""


def touring_bound_J(
    problem: RoutingArrays,
    relaxed: Routing,
    ways: Sequence[ArcWays],
    price: np.ndarray,
    *,
    visits: Visits | None = None,
    rounds: int,
    work: int = WORK_LABELS,
    halt: np.ndarray = NEVER,
) -> float:
    """Return a lower bound of the cost of all tours.

    Each round looks for the cheapest tours by arcs among those that cost little more
    than what is proven, which proves as much if there are none, and tightens the ways
    that the cheapest ones take; those to all near places, too, once a round gets long.

    Args:
        problem: the relaxed routing problem, whose batteries limit tours.
        relaxed: good tours of that problem, whose ways are tightened first; their cost
            is a bound that is known already, and returned if no better one is found.
        ways: of each robot.
        price: cost of a metre of plain ground of each robot, shape (R,).
        visits: of goals; all are remembered if None.
        rounds: how often at most.
        work: labels that all rounds may set.
        halt: shape (1,); no round begins once it has turned true.
    """
    visits = visits or Visits.all_remembered(problem)
    best, pairs = relaxed.cost_J, _pairs_of(ways, relaxed.tours)
    settled_J, rest, cheapest, all_near = -math.inf, None, False, False
    step, labels = STEP, 0
    leg = _room_for_legs(ways, problem.goals)
    for _ in range(rounds):
        tightened = _tighten(pairs)
        if halt[0] or (cheapest and not tightened):
            break
        _write_legs(leg, ways, price)
        rest = rest or completions(problem, leg, visits)
        best = max(best, float(rest.before[0]) - visits.surcharge)
        most = (1.0 + step) * best
        before = labels
        found, labels = cheapest_tours(problem, leg, rest, most, work, visits)
        work -= labels
        if found is None:
            break
        enough, cheapest = False, found.feasible
        if cheapest:
            best, pairs = max(best, found.cost_J), _pairs_of(ways, found.tours)
            enough = best < (1.0 + LEAST_RISE) * settled_J
            settled_J, step = best, FINE_STEP
        else:
            best = max(best, most)
            step = _longer(step, labels, before)
        if enough or labels >= work:
            break
        if labels > LONG_ROUND and not all_near:
            pairs, rest, all_near = pairs | _near_pairs(ways), None, True
    return best


def _longer(step: float, labels: int, before: int) -> float:
    """Return the step after a round without tours.

    It is twice as long while labels are few, or less than twice those of the round
    before: then much costlier tours are as quickly looked at.
    """
    slowly = labels < min(2 * before, LONG_ROUND)
    return 2.0 * step if slowly or labels < SHORT_ROUND else step


def _pairs_of(ways: Sequence[ArcWays], tours: Sequence[Sequence[int]]) -> Pairs:
    """Return the pairs that follow each other in tours."""
    return {
        (id(ways[r]), pair): ways[r]
        for r, tour in enumerate(tours)
        for pair in pairwise((-1 - r, *tour))
    }


def _near_pairs(ways: Sequence[ArcWays]) -> Pairs:
    """Return the pairs of which one is among the nearest from the other one."""
    return {
        (id(one), pair): one
        for r, one in enumerate(ways)
        for pair in one.near_pairs(r, NEAREST)
    }


def _tighten(pairs: Pairs) -> bool:
    """Tighten the ways of pairs; return whether any was new."""
    new = {at: ways for at, ways in pairs.items() if ways.is_loose(at[1])}
    with ThreadPoolExecutor() as threads:
        found = threads.map(lambda at: new[at].certificate(at[1]), new)
        for (key, pair), certificate in zip(new, found, strict=True):
            new[key, pair].take(pair, *certificate)
    return bool(new)


def _legs_of(ways: ArcWays, r: int, price: float) -> np.ndarray:
    """Return what the legs of robot r cost from arc to arc, (T + 1, K, T, K)."""
    start = np.full((1, *ways.between.shape[1:]), np.inf)
    start[0, 0] = price * ways.from_start[r]
    return np.concatenate([price * ways.between, start])


def _room_for_legs(ways: Sequence[ArcWays], goals: int) -> np.ndarray:
    """Return a table for what legs cost from arc to arc, shape (R, T + 1, K, T, K).

    Neighbouring arcs count as one where there are many goals or legs.
    """
    count = len(ways[0].ways.regions)
    legs = len(ways) * (count + 1) * count * ARCS**2
    joined = 1 if goals <= FINE_ARC_GOALS else 2
    while joined < ARCS and legs > FINE_ARC_LEGS * joined**2:
        joined *= 2
    arcs = ARCS // joined
    return np.empty((len(ways), count + 1, arcs, count, arcs))


def _write_legs(leg: np.ndarray, ways: Sequence[ArcWays], price: np.ndarray) -> None:
    """Write what legs cost from arc to arc at present."""
    each = range(ARCS // leg.shape[4])
    leg[:] = np.inf
    for r, one in enumerate(ways):
        own = _legs_of(one, r, price[r])
        for i, j in product(each, each):
            part = own[:, i :: len(each), :, j :: len(each)]
            np.minimum(leg[r], part, out=leg[r])
