"""Exact tours of small missions: who visits what, in which order and where to charge.

Label setting over (goals visited, node), robot after robot (`_touring_kernels`), first
among tours that cost little more than if batteries lasted for ever.
"""

from __future__ import annotations

import math

import numpy as np

from mrmg.planning.bound import _touring_kernels
from mrmg.planning.bound._completion_kernels import Completions
from mrmg.planning.bound._label_kernels import TourSearch
from mrmg.planning.bound.completions import Visits, completions
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.routing import Routing

MOST_GOALS = 14
"""Goals up to which the costs of all sets of them are worked out."""

MOST_STATES = 100_000_000
"""States (robot, goals visited, goal) up to which the cheapest tours are worked out,
few of which are looked at ..."""

PRUNED_GOALS = 20
"""... and the most goals of such missions, by the memory for completions (168 MB)."""

MOST_LABELS, MOST_WORK = 4_000_000, 400_000_000
"""Labels up to which tours are exact, by their memory, and candidates for them, by the
time that these take."""

SHARES = (0.02, 0.08, math.inf)
"""What the cheapest tours may cost more than if batteries lasted for ever, as a share
of that: they are sought within the first share, then within the next."""


def exact_routing(problem: RoutingArrays) -> Routing | None:
    """Return the cheapest tours there are, stations in any number and order.

    Costs need not be a metric.

    Returns:
        The tours, with infinite cost if there are none; None if the mission is too
        large (`are_few`, or MOST_LABELS, MOST_WORK), or if time matters in it.
    """
    timed = problem.makespan_weight > 0.0 or bool((problem.limit < np.inf).any())
    if timed or not are_few(int(problem.open_goal.sum()), len(problem.energy)):
        return None
    rest = completions(problem)
    least_J = float(rest.before[0])
    leg = np.ascontiguousarray(problem.cost[:, :, None, :, None])
    for share in SHARES if math.isfinite(least_J) else ():
        most_J = math.inf if math.isinf(share) else (1.0 + share) * least_J
        found, _ = cheapest_tours(problem, leg, rest, most_J)
        if found is None or found.feasible:
            return found
    return Routing(tuple(() for _ in problem.energy), math.inf)


def are_few(goals: int, robots: int) -> bool:
    """Return whether the cheapest tours of so many goals and robots are worked out."""
    few = goals <= PRUNED_GOALS and robots * goals << goals <= MOST_STATES
    return goals <= MOST_GOALS or few


def cheapest_tours(
    problem: RoutingArrays,
    leg: np.ndarray,
    rest: Completions,
    most: float,
    work: int = MOST_WORK,
    visits: Visits | None = None,
) -> tuple[Routing | None, int]:
    """Return the cheapest tours if they cost `most` or less.

    Args:
        problem: the mission.
        leg: what legs cost from arc to arc, and drain batteries by, shape
            (R, T + 1, K, T, K).
        rest: completions of the mission.
        most: cost of tours of interest.
        work: candidates for labels at most.
        visits: of goals, as in `rest`; all are remembered if None.

    Returns:
        Tours, of infinite cost if all cost more, None if that takes more work to tell,
        or more labels than there is room for; and the work that it took.
    """
    visits = visits or Visits.all_remembered(problem)
    search = _search(problem, visits, leg, leg, rest, most)
    cost, last, place, parent, tried = _touring_kernels.cheapest_tours(
        search, MOST_LABELS, work
    )
    if not len(parent):
        return None, tried
    tours: list[list[int]] = [[] for _ in problem.energy]
    label = int(last[-1]) if np.isfinite(cost[-1]) else -1
    while label >= 0:
        robot, node, _ = place[label].tolist()
        if node < leg.shape[3]:
            tours[robot].insert(0, node)
        label = int(parent[label])
    least = float(cost[-1]) - visits.surcharge
    return Routing(tuple(tuple(tour) for tour in tours), least), tried


def _search(
    problem: RoutingArrays,
    visits: Visits,
    leg: np.ndarray,
    drain: np.ndarray,
    rest: Completions,
    most: float,
) -> TourSearch:
    """Return the search for tours that cost `most` but for prices."""
    counted = np.zeros(leg.shape[1], np.bool_)
    counted[visits.order[visits.remembered :]] = True
    stations = slice(problem.goals, problem.cost.shape[2])
    return TourSearch(
        routing=problem,
        goal_list=visits.order,
        remembered=visits.remembered,
        is_counted=counted,
        leg=leg,
        drain=drain,
        station_drain=drain[:, stations].min(axis=2),
        nearest=leg.min(axis=4),
        price=visits.price,
        setting_out=visits.setting_out,
        finish=problem.finish,
        rest=rest,
        most=most + visits.surcharge,
    )


def least_costs(
    problem: RoutingArrays, goals: np.ndarray, *, free: bool = False
) -> np.ndarray | None:
    """Return the least cost of visiting each set of goals, inf where it is impossible.

    Args:
        problem: a mission, whose costs drain batteries.
        goals: numbers of n goals, the only ones to be visited.
        free: count nothing for legs that can be driven: only batteries matter.

    Returns:
        Shape (2^n,); None if that takes too many labels.
    """
    cost, finish = problem.cost, problem.finish
    if free:
        cost, finish = (np.where(np.isfinite(one), 0.0, one) for one in (cost, finish))
    visits = Visits.remembering(problem, goals)
    leg = np.ascontiguousarray(cost[:, :, None, :, None])
    drain = np.ascontiguousarray(problem.cost[:, :, None, :, None])
    rest = completions(problem, visits=visits)  # drops none, as all are of interest
    search = _search(problem, visits, leg, drain, rest, math.inf)
    search = search._replace(finish=finish)
    least, _, _, parent, _ = _touring_kernels.cheapest_tours(
        search, MOST_LABELS, MOST_WORK
    )
    return np.asarray(least) if len(parent) else None


def with_endless_batteries(problem: RoutingArrays) -> RoutingArrays:
    """Return the mission of robots whose batteries never run out."""
    endless = np.full_like(problem.energy, math.inf)
    return problem._replace(energy=endless, capacity=endless)


def of_robot(problem: RoutingArrays, r: int) -> RoutingArrays:
    """Return the mission of one robot of a fleet alone."""
    names = ("cost", "energy", "capacity", "reserve", "escape", "finish")
    timed = ("time", "finish_time", "limit", "charge_power", "consumers")
    own = {name: getattr(problem, name)[r : r + 1] for name in names + timed}
    return problem._replace(**own)
