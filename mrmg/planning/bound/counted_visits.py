"""Prices at which too many goals to be remembered are each visited once, or nearly so.

Where visits are counted, walks of as many visits as there are goals take the place of
tours. Prices of goals that walks leave out fall, and those of goals visited again and
of robots that set out again rise (subgradients, Held and Karp 1971); all of them give a
bound. The goals that walks differ most about are remembered.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrmg.planning.bound import _completion_kernels
from mrmg.planning.bound._completion_kernels import NONE, Legs, Tables
from mrmg.planning.bound.completions import Visits, first_legs, least_legs
from mrmg.planning.routing._nrpa_kernels import RoutingArrays

ROUNDS = 120
"""Changes of the prices."""

FIRST_STEP, DECAY = 0.3, 0.97
"""First change of a price, as a share of the mean of the least legs to each goal, and
how it falls. Walks may cost nothing: to a goal that a robot starts in."""

WORTH_PAYING = 0.01
"""Share by which what robots pay must raise what walks prove."""

MOST_WORK = 500_000_000
"""Triples of goals that may follow each other in all states, by which goals are
remembered: a second or two of one processor."""


def counted_visits(problem: RoutingArrays) -> Visits:
    """Return good prices for a mission of many goals, and which ones are remembered.

    Robots pay for setting out where that proves more, as where they would roll down
    from high ground again and again; otherwise it only blurs what is left to be paid.
    """
    free, free_J = _priced(problem, robots_pay=False)
    paid, paid_J = _priced(problem, robots_pay=True)
    return paid if paid_J - free_J > WORTH_PAYING * abs(paid_J) else free


def _priced(problem: RoutingArrays, *, robots_pay: bool) -> tuple[Visits, float]:
    """Return good prices, and what walks prove with them."""
    visits = replace(Visits.all_remembered(problem), remembered=0)
    order, legs = visits.order, least_legs(problem, visits)
    first_J = first_legs(problem, order)
    nearest_J = np.minimum(legs.from_start, legs.between.min(axis=0))
    step = FIRST_STEP * nearest_J[np.isfinite(nearest_J)].sum() / len(order)
    best, best_J = visits, -np.inf
    wrong = np.zeros(len(order))
    for _ in range(ROUNDS):
        from_start = first_J + visits.setting_out[:, None]
        legs = legs._replace(
            price=visits.price[order], from_start=from_start.min(axis=0)
        )
        found = _completion_kernels.completions(legs, 0)
        walk_J = float(found.before[0])
        if not np.isfinite(walk_J):
            break
        if walk_J - visits.surcharge > best_J:
            best, best_J = visits, walk_J - visits.surcharge
        times, first = _walk(legs, found)
        price, off = visits.price.copy(), times - 1.0
        price[order] += step * off
        robots = from_start[:, first].argmin(axis=0)
        sets_out = np.bincount(robots, minlength=len(from_start))
        setting_out = np.maximum(
            0.0, visits.setting_out + robots_pay * step * (sets_out - 1.0)
        )
        visits = replace(visits, price=price, setting_out=setting_out)
        wrong, step = 0.9 * wrong + np.abs(off), DECAY * step
    own = best.price.copy()
    remembered = most_remembered(len(order))
    order = order[np.argsort(-wrong, kind="stable")]
    own[order[:remembered]] = 0.0
    best = replace(best, order=order, remembered=remembered, price=own)
    return best, best_J


def most_remembered(goals: int) -> int:
    """Return how many of so many goals are remembered by MOST_WORK."""
    for remembered in range(goals, 0, -1):
        states = (goals - remembered + 1) << remembered
        if states * (goals - 0.5 * remembered) ** 3 <= MOST_WORK:
            return remembered
    return 0


def _walk(legs: Legs, found: Tables) -> tuple[np.ndarray, list[int]]:
    """Return how often the cheapest walk visits each goal, and where robots begin.

    Args:
        legs: of any robot.
        found: what `_completion_kernels.completions` returned for them.
    """
    after, second, follower = found.after, found.second, found.follower
    times, first = np.zeros(len(legs.between)), []
    at = before = NONE
    for state in range(len(times)):
        on = after[state + 1] + legs.price
        if at >= 0:
            back = follower[state + 1] == at
            go = np.where(back, second[state + 1] + legs.price, on) + legs.between[at]
            go[before if before >= 0 else at] = np.inf
        if at < 0 or legs.to_end[at] + found.before[state] <= go.min():
            at, before = int(np.argmin(legs.from_start + on)), NONE
            first.append(at)
        else:
            at, before = int(np.argmin(go)), at
        times[at] += 1.0
    return times, first
