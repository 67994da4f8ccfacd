"""The discrete problem: who visits which goals in what order, recharging where.

An energy-constrained multi-start open route problem with recharging, solved by ruin and
recreate with exact placing of the stations, or by nested rollout policy adaptation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from time import thread_time

import numpy as np

from mrmg.planning.routing._legs_kernels import MISSING, USABLE, Legs, new_legs
from mrmg.planning.routing._nrpa_kernels import RoutingArrays, nrpa, with_own_tables
from mrmg.planning.routing._refuel_kernels import (
    COST,
    FIRST,
    LAST,
    ORIGIN,
    PATH,
    ROUNDING,
    Labels,
    place_at,
    row_of,
    slot_of,
)
from mrmg.planning.routing._routes_kernels import IMPOSSIBLE, LABEL, Routes
from mrmg.planning.routing._routing_kernels import State, new_state, search, settle
from mrmg.ranges import Range, require_ranges

ROUNDS_PER_PAIR = 12
"""Rounds are at most so many for each pair of goals to visit, one with itself, too."""

SPAN = 1.0, 0.01
"""First and last temperature of the search, as shares of a goal's mean cost."""

PARTS, MOST_GROWTH = 20, 10.0
"""Parts of a search in limited time, and by how much their rounds may grow: the next
part has as many rounds as the last one had in a part's time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RouterParams:
    """Parameters of the router.

    Attributes:
        method: name of the router (`routers.find_router`): "nrpa", "search" (ruin and
            recreate), "exact", or one of another package. The other parameters are of
            the first two; tours that are drawn anew while a tree grows are always of
            NRPA.
        levels: nesting levels of NRPA.
        iterations: iterations of each level.
        alpha: step of the policy adaptation.
        rounds: most rounds of ruin and recreate, fewer if there are few goals; with 0
            the order is NRPA's.
        limit_s: processor time for ruin and recreate, in place of a number of rounds
            [s]; None for none. With it the same seed may give other tours.
    """

    method: str = "search"
    levels: int = 1
    iterations: int = 20
    alpha: float = 1.0
    rounds: int = 1500
    limit_s: float | None = None

    def __post_init__(self) -> None:
        require_ranges(self, RANGES, "parameters of the router")


RANGES = {
    "levels": Range(1, whole=True),
    "iterations": Range(1, whole=True),
    "alpha": Range(ends="(]"),
    "rounds": Range(whole=True),
    "limit_s": Range(ends="(]", optional=True),
}
"""What the router's parameters may be."""


@dataclass(frozen=True, slots=True)
class Routing:
    """An answer of the router.

    Attributes:
        tours: targets of each robot in order, stations included.
        cost_J: their energy; infinite if no feasible tours were found.
    """

    tours: tuple[tuple[int, ...], ...]
    cost_J: float

    @property
    def feasible(self) -> bool:
        """Whether tours were found."""
        return bool(np.isfinite(self.cost_J))


def solve_routing(problem: RoutingArrays, params: RouterParams, seed: int) -> Routing:
    """Solve a routing problem; the same seed gives the same tours."""
    random = np.array([seed], np.uint64)
    legs = new_legs(problem)
    state = new_state(problem, legs)
    routes = state.routes
    if params.rounds == 0:
        _play_out(problem, params, random, routes)
    goals = int(problem.open_goal.sum())
    rounds = min(params.rounds, ROUNDS_PER_PAIR * goals**2)
    if params.limit_s is None:
        search(legs, state, rounds, SPAN, random)
    else:
        _search_in_time(legs, state, SPAN, random, params.limit_s)
    cost_J = float(settle(legs, state))
    tours = tuple(
        tour_of(legs, state.labels, r, routes.goal[r, :length], int(label))
        for r, (length, label) in enumerate(
            zip(routes.length[:-1], routes.known[:-1, LABEL], strict=True)
        )
    )
    if cost_J >= IMPOSSIBLE:
        return Routing(tours, math.inf)
    if problem.consumers.any():  # which the search knows by their time alone
        cost_J = _energy_J(problem, tours)
    return Routing(tours, cost_J)


def _energy_J(problem: RoutingArrays, tours: Sequence[Sequence[int]]) -> float:
    """Return the energy of tours with what consumers draw on the way."""
    total_J, targets = 0.0, problem.cost.shape[2]
    for r, tour in enumerate(tours):
        places = [problem.home[r], *tour]
        total_J += problem.cost[problem.table[r], places[:-1], tour].sum()
        total_J += problem.finish[r, tour[-1] if tour else targets]
    return float(total_J)


def tour_of(
    legs: Legs, labels: Labels, r: int, route: np.ndarray, label: int
) -> tuple[int, ...]:
    """Return the targets of a labelled route in order, stations included.

    Args:
        legs: of the problem.
        labels: of the route.
        r: the robot.
        route: the route's goals in order.
        label: as `label_route` returned it; -1 where the robot stays, or cannot drive.
    """
    if label < 0:
        return ()
    own, length = legs.table[r], len(route)
    if _needs_no_station(legs, labels, r, route, label):
        return tuple(route.tolist())
    targets: list[int] = []  # the last one first
    for step in range(length + 1, 0, -1):
        way = labels.way[row_of(legs, r, route, length, 0, step), label]
        path, label = int(way[PATH]), int(way[ORIGIN])
        if step <= length:
            targets.append(int(route[step - 1]))
        if path >= 0:
            ends = (place_at(legs, r, route, length, 0, at) for at in (step - 1, step))
            slot = slot_of(legs, labels, own, *ends)
            stop, last = labels.path[slot, path, [FIRST, LAST]].astype(int).tolist()
            stops = [stop]
            while stop != last:
                stop = int(legs.follower[own, stop, last])
                stops.append(stop)
            targets += [legs.goals + each for each in reversed(stops)]
    return tuple(reversed(targets))


def _needs_no_station(
    legs: Legs, labels: Labels, r: int, route: np.ndarray, label: int
) -> bool:
    """Return whether a route costs no more without a station, and the battery lasts.

    Where a station lies on the shortest way, one over it costs as much.
    """
    places = np.array([legs.home[r], *route, legs.home[r]])
    leg = legs.table[r], places[:-1], places[1:]
    usable_J = legs.robot[r, USABLE] - legs.robot[r, MISSING]
    last = row_of(legs, r, route, len(route), 0, len(route) + 1)
    limits_J = np.array([labels.way[last, label, COST], usable_J]) * (1.0 + ROUNDING)
    return bool(
        legs.cost[leg].sum() <= limits_J[0] and legs.draw[leg].sum() <= limits_J[1]
    )


def _search_in_time(
    legs: Legs,
    state: State,
    span: tuple[float, float],
    random: np.ndarray,
    limit_s: float,
) -> None:
    """Search in parts, each with the routes of the last one, until time is over."""
    began, done, rounds = thread_time(), 0.0, 1
    while done < 1.0:
        until = min(done + 1.0 / PARTS, 1.0)
        hot, cold = (span[0] * (span[1] / span[0]) ** share for share in (done, until))
        search(legs, state, rounds, (hot, cold), random)
        last, done = done, (thread_time() - began) / limit_s
        wanted = min(1.0 / PARTS, 1.0 - done) / max(done - last, 1e-9)
        rounds = max(1, int(rounds * min(wanted, MOST_GROWTH)))


def _play_out(
    problem: RoutingArrays, params: RouterParams, random: np.ndarray, routes: Routes
) -> None:
    """Write the goals of NRPA's best playout as routes."""
    problem = with_own_tables(problem)
    robots, _, targets = problem.cost.shape
    sequence = np.zeros(3 * problem.goals + 4 * robots, np.int64)
    _, moves = nrpa(
        problem, params.levels, params.iterations, params.alpha, random, sequence
    )
    for r, t in zip(*np.divmod(sequence[:moves], targets), strict=True):
        if t < problem.goals:
            routes.goal[r, routes.length[r]] = t
            routes.length[r] += 1
    absent = routes.goal[robots, : routes.length[robots]]
    left = np.setdiff1d(absent, sequence[:moves] % targets)
    absent[: len(left)], routes.length[robots] = left, len(left)
