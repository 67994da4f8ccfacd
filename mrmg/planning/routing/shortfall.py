"""By how much batteries, or the time limit, are too small for the router's tours."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.routing import RouterParams, Routing, solve_routing

MAX_SHARE = 63.0
"""Largest enlargement that is tried, as a share of what is there."""

SHARE_STEP = 0.01
"""How exactly a sufficient enlargement is found, as a share of what is there ..."""

RELATIVE_STEP = 0.05
"""... and as a share of the enlargement."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shortfall:
    """What a mission is short of on the roadmap's energies, which are no proof.

    Attributes:
        left_out: goals that the best tours found leave out.
        battery_share: by which the usable energy of all batteries must grow for tours
            to be found; 0 if only the time limit is too short, inf if no battery helps.
        time_share: by which the time limit must grow; 0 if batteries are too small.
    """

    left_out: tuple[int, ...]
    battery_share: float
    time_share: float


def shortfall(problem: RoutingArrays, params: RouterParams, seed: int) -> Shortfall:
    """Return what a routing problem without tours is short of."""

    def tours(battery_share: float, time_share: float) -> Routing:
        if math.isinf(time_share):
            limit = np.full_like(problem.limit, math.inf)  # also where the limit is 0
        else:
            limit = problem.limit * (1.0 + time_share)
        eased = with_batteries(problem, battery_share)._replace(limit=limit)
        return solve_routing(eased, params, seed)

    visited = {target for tour in tours(0.0, 0.0).tours for target in tour}
    left_out = [int(g) for g in np.flatnonzero(problem.open_goal) if g not in visited]
    battery_share = time_share = 0.0
    if bool(np.isfinite(problem.limit).any()) and tours(0.0, math.inf).feasible:
        time_share = least_share(lambda share: tours(0.0, share).feasible)[1]
    else:
        battery_share = least_share(lambda share: tours(share, math.inf).feasible)[1]
    return Shortfall(
        left_out=tuple(left_out), battery_share=battery_share, time_share=time_share
    )


def with_batteries(problem: RoutingArrays, share: float) -> RoutingArrays:
    """Return a problem whose batteries have more usable energy by a share."""
    reserve = problem.reserve
    return problem._replace(
        energy=reserve + (1.0 + share) * (problem.energy - reserve),
        capacity=reserve + (1.0 + share) * (problem.capacity - reserve),
    )


def least_share(suffices: Callable[[float], bool]) -> tuple[float, float]:
    """Return a share that does not suffice, and one little above it that does.

    Args:
        suffices: returns whether a share suffices; 0 does not.

    Returns:
        Both; inf if MAX_SHARE does not suffice.
    """
    low, high = 0.0, 4.0 * SHARE_STEP
    while not suffices(high):
        if high >= MAX_SHARE:
            return math.inf, math.inf
        low, high = high, min(3.0 * high, MAX_SHARE)
    while high - low > max(SHARE_STEP, RELATIVE_STEP * low):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if suffices(middle) else (middle, high)
    return low, high
