"""Draws of tours for energies that differ by chance, and by what driving takes.

The roadmap's energies are not quite what driving takes: its paths have corners that
smoothing cuts. Where batteries limit tours, it matters that energy is not overrated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import zip_longest

import numpy as np

from mrmg import seeding
from mrmg.background import in_background
from mrmg.planning.attempt import Request
from mrmg.planning.path_following.following import path_cost_J
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import whole_tours
from mrmg.planning.routing.routing import Routing

SPREADS = (0.0, 0.04, 0.08, 0.12, 0.06)
"""Standard deviations of the logarithms of the factors on energies and times in
successive draws: the roadmap's energies are not quite what driving takes."""

SURCHARGES = (0.0, 0.0, -0.06)
"""Shares added to the roadmap's energies in successive draws; below 0, as paths drawn
tight take less than the roadmap's."""

TIMED_SURCHARGES = (0.06, 0.0, 0.12)
"""The same where the makespan counts: who brakes hard and turns round needs more."""

RECHARGE_DRAWS, RECHARGE_GOALS = 8, 320
"""Draws that follow where tours recharge, and the goals in all of them, at most ..."""

FIRST_RECHARGE_DRAW = 1_000_000
"""... and the number from which on these are numbered."""

DRIVEN_SHARE = 1.01
"""Energy of driving, over that of the smoothed paths that tours are judged by."""

Tours = tuple[tuple[int, ...], ...]
"""Targets of each robot, in order."""


@dataclass(frozen=True, slots=True)
class Draw:
    """One draw of tours, for energies and times that differ by chance.

    Attributes:
        number: of its random streams.
        spread: standard deviation of the logarithms of their factors.
        surcharge: share added to all energies.
    """

    number: int
    spread: float
    surcharge: float

    @staticmethod
    def of(number: int, timed: bool) -> Draw:
        """Return draw `number` of a mission in which the makespan counts or not."""
        surcharges = TIMED_SURCHARGES if timed else SURCHARGES
        return Draw(
            number,
            SPREADS[number % len(SPREADS)],
            surcharges[number % len(surcharges)],
        )


def tours_of(problem: Problem, request: Request, seed: int | None = None) -> Routing:
    """Return tours; without goals there is nothing to find, and nothing to miss."""
    if problem.mission.targets.goals == 0:
        return Routing(tours=((),) * len(problem.start), cost_J=0.0)
    return request.tours(problem, seed)


def drawn_tours(
    problem: Problem, request: Request, draws: Sequence[Draw]
) -> tuple[list[Routing], int]:
    """Return the different tours of several draws, and how many draws there were.

    Those that look best come first. If these recharge, there are further draws, for
    energies that are as much below the roadmap's as the smoothed paths of these cost
    less than those of the roadmap.
    """
    if len(draws) == 1:
        only = _drawn(problem, request, draws[0])
        return [only] if only.feasible else [], 1
    cost_J: dict[Tours, float] = {}
    found: dict[Tours, Routing] = {}

    def take(draws: Sequence[Draw]) -> None:
        for tours in _all_drawn(problem, request, draws):
            if tours.feasible and tours.tours not in found:
                found[tours.tours] = tours
                cost_J[tours.tours] = path_cost_J(problem, tours)

    take(draws)
    if not found:
        return [], len(draws)
    best = min(cost_J, key=cost_J.__getitem__)
    goals, more = problem.mission.targets.goals, 0
    if any(target >= goals for tour in best for target in tour):
        more = recharge_draws(goals)
        first = FIRST_RECHARGE_DRAW + RECHARGE_DRAWS * draws[0].number
        driven = cost_J[best] / _roadmap_cost_J(problem, found[best])
        surcharge = DRIVEN_SHARE * driven - 1.0
        further = (Draw.of(number, False) for number in range(first, first + more))
        take([replace(one, surcharge=surcharge) for one in further])
    ranked = sorted(cost_J, key=cost_J.__getitem__)
    return [found[tours] for tours in ranked], len(draws) + more


def recharge_draws(goals: int) -> int:
    """Return how many draws follow where tours through so many goals recharge."""
    return min(RECHARGE_DRAWS, RECHARGE_GOALS // max(1, goals))


def _all_drawn(
    problem: Problem, request: Request, draws: Sequence[Draw]
) -> list[Routing]:
    """Return the tours of several draws, which are found two at a time."""

    def drawn(some: Sequence[Draw]) -> list[Routing]:
        return [_drawn(problem, request, draw) for draw in some]

    beside = in_background(partial(drawn, draws[1::2]))
    own = drawn(draws[::2])
    turns = zip_longest(own, beside.result())
    return [tours for pair in turns for tours in pair if tours is not None]


def _drawn(problem: Problem, request: Request, draw: Draw) -> Routing:
    """Return the tours of one draw."""
    varied = problem.with_margin(draw.surcharge)
    arrays = varied.mission.routing
    places = arrays.cost.shape[2]
    noise = seeding.stream(request.seed, "costs", draw.number).standard_normal(
        (places + 1, places)
    )
    rows = np.minimum(np.arange(arrays.cost.shape[1]), places)
    factor = np.exp(draw.spread * noise[rows])
    varied = varied.with_routing(cost=arrays.cost * factor, time=arrays.time * factor)
    return tours_of(
        varied, request, seeding.stream_seed(request.seed, "tours", draw.number)
    )


def _roadmap_cost_J(problem: Problem, tours: Routing) -> float:
    """Return the cost of tours along the roadmap [J]."""
    roadmap, total = problem.roadmap, 0.0
    for r, tour in enumerate(whole_tours(problem.mission.targets, tours.tours)):
        if tour:
            robot = problem.mission.fleet[r]
            legs_m = roadmap.distance[robot["field"], tour[:-1], tour[1:]]
            first_m = roadmap.start_distance[r, tour[0]]
            total += float(robot["plain"] * (first_m + legs_m.sum()))
    return total
