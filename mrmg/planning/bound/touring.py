"""The least cost of tours that touch all goals, by where their borders are touched.

`bound` takes the way between two regions for granted however the robot gets from where
it enters a region to where it leaves it. Here a visit has one place: the arc of the
border where the region is first touched; who touches goals inside a station enters it
before and leaves it afterwards, which may count as two visits. Only tours whose cost
can be below some limit are looked at, so the result is the least cost of all tours or
the limit. Neighbouring arcs count as one at first, at the least of their costs: that
proves most of it in a hundredth of the work, and leaves fewer rounds of fine arcs.
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

JOINED = 8, 4, 2, 1
"""Neighbouring arcs of a border that count as one, in rounds one after the other:
coarse arcs tell costs apart by some 4 %, in a hundredth of the work."""

STEP = 0.01
"""Share of what is proven by which costlier tours are looked at in the next round; it
grows while that takes little more work."""

LEAST_RISE = 0.001
"""Share by which a round must raise the bound to be followed by another with the same
arcs."""

MOST_LEGS = 10_000_000
"""Legs from arc to arc at most, by their memory (80 MB); where there are more,
neighbouring arcs always count as one."""

LONG_ROUND = 4_000_000
"""Candidates of a round, some 0.1 s of work, after which the ways between near places
are tightened, too: later rounds then look at fewer, or prove more."""

NEAREST = 5
"""How many places are near to each place."""

WORK = 200_000_000
"""Candidates for labels in all rounds: some 4 s of one processor. The limit counts
work, not time, so that the same mission has the same bound on every machine."""

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
    work: int = WORK,
    halt: np.ndarray = NEVER,
) -> float:
    """Return a lower bound of the cost of all tours.

    Each round looks for the cheapest tours by arcs among those that cost little more
    than what is proven, which proves as much if there are none, and tightens the ways
    that the cheapest ones take. Once that proves no more, arcs are cut in two.

    Args:
        problem: the relaxed routing problem, whose batteries limit tours.
        relaxed: good tours of that problem, whose ways are tightened first; their cost
            is a bound that is known already, and returned if no better one is found.
        ways: of each robot.
        price: cost of a metre of plain ground of each robot, shape (R,).
        visits: of goals; all are remembered if None.
        rounds: how often at most.
        work: candidates for labels that all rounds may look at.
        halt: shape (1,); no round begins once it has turned true.
    """
    visits = visits or Visits.all_remembered(problem)
    best, pairs = relaxed.cost_J, _pairs_of(ways, relaxed.tours)
    table, rest, tried, all_near = _room_for_legs(ways), None, 0, False
    for joined in JOINED:
        settled_J, step = -math.inf, STEP
        while rounds > 0 and not halt[0]:
            if not _tighten(pairs) and settled_J > -math.inf:
                break
            if tried > LONG_ROUND and not all_near:
                rest, all_near = None, True
                _tighten(_near_pairs(ways))
            rounds, before = rounds - 1, tried
            _write_legs(table, ways, price)
            # Bounds of the rest by fine arcs serve coarse ones: what they drop among
            # these costs too much by fine arcs, which is what counts.
            rest = rest or completions(problem, table, visits)
            best = max(best, float(rest.before[0]) - visits.surcharge)
            most, leg = (1.0 + step) * best, _with_joined_arcs(table, joined)
            found, tried = cheapest_tours(problem, leg, rest, most, work, visits)
            work -= tried
            if found is None:
                return best
            if found.feasible:
                best, pairs = max(best, found.cost_J), _pairs_of(ways, found.tours)
                if best < (1.0 + LEAST_RISE) * settled_J:
                    break
                settled_J, step = best, STEP
            else:
                best, step = most, 2.0 * step if tried < 2 * before else step
            if work < 2 * tried:  # the next round takes more
                return best
    return best


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


def _room_for_legs(ways: Sequence[ArcWays]) -> np.ndarray:
    """Return a table for what legs cost from arc to arc, shape (R, T + 1, K, T, K)."""
    count, arcs = len(ways[0].ways.regions), ARCS
    while arcs > 1 and len(ways) * (count + 1) * count * arcs**2 > MOST_LEGS:
        arcs //= 2
    return np.empty((len(ways), count + 1, arcs, count, arcs))


def _with_joined_arcs(leg: np.ndarray, joined: int) -> np.ndarray:
    """Return what legs cost where so many neighbouring arcs count as one."""
    if joined == 1:
        return leg
    robots, nodes, arcs, count, _ = leg.shape
    joined = min(joined, arcs)
    parts = arcs // joined, joined
    own = leg.reshape(robots, nodes, *parts, count, *parts)
    return np.asarray(own.min(axis=(3, 6)))


def _write_legs(leg: np.ndarray, ways: Sequence[ArcWays], price: np.ndarray) -> None:
    """Write what legs cost from arc to arc at present."""
    each = range(ARCS // leg.shape[4])
    leg[:] = np.inf
    for r, one in enumerate(ways):
        own = _legs_of(one, r, price[r])
        for i, j in product(each, each):
            part = own[:, i :: len(each), :, j :: len(each)]
            np.minimum(leg[r], part, out=leg[r])
