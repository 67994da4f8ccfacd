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

FEW_DRAWS = 4
"""Draws where tours do not recharge. Where they do, twice as many, of which all but the
first are for what smoothed paths take, made missions on outside maps 0.8 % cheaper."""

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

    Those that look best come first. If the first ones recharge, the other draws are for
    energies that are as much below the roadmap's as the smoothed paths of these cost
    less than those of the roadmap. Else few draws are enough.
    """
    first, others = _drawn(problem, request, draws[0]), draws[1:]
    if not (first.feasible and _recharge(problem, first)):
        others = others[: FEW_DRAWS - 1]
    elif others:
        driven_J = DRIVEN_SHARE * path_cost_J(problem, first)
        surcharge = driven_J / _roadmap_cost_J(problem, first) - 1.0
        others = [replace(one, surcharge=surcharge) for one in others]
    drawn = [first, *_all_drawn(problem, request, others)]
    found = {tours.tours: tours for tours in drawn if tours.feasible}
    ranked = [*found.values()]
    if len(ranked) > 1:
        ranked.sort(key=lambda tours: path_cost_J(problem, tours))
    return ranked, len(drawn)


def _recharge(problem: Problem, routing: Routing) -> bool:
    """Return whether tours lead to stations."""
    goals = problem.mission.targets.goals
    return any(target >= goals for tour in routing.tours for target in tour)


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
