"""Exact tours of small missions: who visits what, in which order and where to charge.

Label setting over (goals visited, node), robot after robot (`_touring_kernels`), first
among tours that cost little more than if batteries lasted for ever.
"""

from __future__ import annotations

import math

import numpy as np

from mrmg.planning.bound import _completion_kernels, _touring_kernels
from mrmg.planning.bound._completion_kernels import Completions
from mrmg.planning.bound._touring_kernels import TourSearch
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.routing import Routing

MOST_GOALS = 14
"""Goals up to which the costs of all sets of them are worked out."""

MOST_STATES = 100_000_000
"""States (robot, goals visited, goal) up to which the cheapest tours are worked out,
few of which are looked at ..."""

PRUNED_GOALS = 20
"""... and the most goals of such missions, by the memory for completions (168 MB)."""

MOST_LABELS = 4_000_000
"""Labels up to which tours are exact."""

SHARES = (0.02, 0.08, math.inf)
"""What the cheapest tours may cost more than if batteries lasted for ever, as a share
of that: they are sought within the first share, then within the next."""


def exact_routing(
    problem: RoutingArrays, rest: Completions | None = None
) -> Routing | None:
    """Return the cheapest tours there are, stations in any number and order.

    Costs need not be a metric.

    Args:
        problem: the mission.
        rest: its completions; worked out if None.

    Returns:
        The tours, with infinite cost if there are none; None if the mission is too
        large (`are_few`, or MOST_LABELS labels), or if time matters in it.
    """
    timed = problem.makespan_weight > 0.0 or bool((problem.limit < np.inf).any())
    if timed or not are_few(int(problem.open_goal.sum()), len(problem.energy)):
        return None
    rest = rest or completions(problem)
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
    room: int = MOST_LABELS,
) -> tuple[Routing | None, int]:
    """Return the cheapest tours if they cost `most` or less.

    Args:
        problem: the mission.
        leg: what legs cost from arc to arc, and drain batteries by, shape
            (R, T + 1, K, T, K).
        rest: completions of the mission.
        most: cost of tours of interest.
        room: labels at most.

    Returns:
        Tours, of infinite cost if all cost more, None if that takes more labels to
        tell than there is room for; and the labels that it took.
    """
    goal_list = np.flatnonzero(problem.open_goal)
    stations = slice(problem.goals, problem.cost.shape[2])
    drain = leg.copy()  # from wherever in a station the battery is full
    drain[:, stations] = drain[:, stations].min(axis=2, keepdims=True)
    nearest, finish = leg.min(axis=4), problem.finish
    search = TourSearch(problem, goal_list, leg, drain, nearest, finish, rest, most)
    cost, last, trace = _touring_kernels.cheapest_tours(search, room)
    if not len(trace):
        return None, room
    tours: list[list[int]] = [[] for _ in problem.energy]
    label = int(last[-1]) if np.isfinite(cost[-1]) else -1
    while label >= 0:
        robot, node, _, label = trace[label].tolist()
        if node < leg.shape[3]:
            tours[robot].insert(0, node)
    found = Routing(tuple(tuple(tour) for tour in tours), float(cost[-1]))
    return found, len(trace)


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
    robots, nodes, targets = problem.cost.shape
    cost, finish = problem.cost, problem.finish
    if free:
        cost, finish = (np.where(np.isfinite(one), 0.0, one) for one in (cost, finish))
    sets = 1 << len(goals)
    nothing = Completions(
        np.zeros((robots, targets - problem.goals, len(goals))),
        np.zeros((robots, nodes)),
        np.zeros((sets, len(goals))),
        np.zeros(sets),
    )
    leg = np.ascontiguousarray(cost[:, :, None, :, None])
    drain = np.ascontiguousarray(problem.cost[:, :, None, :, None])
    nearest = leg.min(axis=4)
    search = TourSearch(problem, goals, leg, drain, nearest, finish, nothing, math.inf)
    least, _, trace = _touring_kernels.cheapest_tours(search, MOST_LABELS)
    return np.asarray(least) if len(trace) else None


def completions(problem: RoutingArrays, leg: np.ndarray | None = None) -> Completions:
    """Return what the rest of a mission costs at least, for all that may be done.

    Args:
        problem: the mission.
        leg: what legs cost from arc to arc, shape (R, T + 1, K, T, K), by which every
            second goal is left at the arc that it is touched at; None for those of
            the mission.
    """
    goals, start = problem.goals, problem.cost.shape[2]
    cost = np.concatenate([problem.cost, problem.finish[:, :, None]], axis=2)
    cost = over_stations(cost, range(goals, start))
    goal_list = np.flatnonzero(problem.open_goal)
    pair = np.zeros((0, 0, 0))
    if leg is not None:
        pair = _pairs(leg.min(axis=0), cost.min(axis=0), range(goals, start), goal_list)
    found: Completions = _completion_kernels.completions(
        cost[:, goal_list][:, :, goal_list].min(axis=0),
        pair,
        cost[:, start, goal_list].min(axis=0),
        cost[:, goal_list, start].min(axis=0),
        np.ascontiguousarray(cost[:, goals:start, goal_list]),
        np.ascontiguousarray(cost[:, :, start]),
    )
    return found


def _pairs(
    leg: np.ndarray, cost: np.ndarray, stations: range, goal_list: np.ndarray
) -> np.ndarray:
    """Return what two legs cost at least with the same arc in the middle, (G, G, G).

    Args:
        leg: least cost of any robot from arc to arc, shape (T + 1, K, T, K).
        cost: over any stations from node to node, shape (T + 1, T + 1).
        stations: numbers of the stations, which robots may visit on both legs.
        goal_list: the open goals, shape (G,).
    """
    into = leg.min(axis=1)[goal_list][:, goal_list]
    out = leg.min(axis=3)[goal_list][..., goal_list]
    for s in stations:
        from_s, to_s = leg[s].min(axis=0)[goal_list], leg[goal_list, :, s].min(axis=2)
        into = np.minimum(into, cost[goal_list, s, None, None] + from_s)
        out = np.minimum(out, to_s[..., None] + cost[s, goal_list])
    return np.asarray((into[..., None] + out).min(axis=2))


def over_stations(cost: np.ndarray, stations: range) -> np.ndarray:
    """Return the least costs over any stations (Floyd 1962, Warshall 1962).

    Args:
        cost: from node to node, shape (R, N, M), where the first nodes are the same.
        stations: numbers of the nodes that may lie on the way.
    """
    for k in stations:
        cost = np.minimum(cost, cost[:, :, k, None] + cost[:, None, k])
    return cost


def of_robot(problem: RoutingArrays, r: int) -> RoutingArrays:
    """Return the mission of one robot of a fleet alone."""
    names = ("cost", "energy", "capacity", "reserve", "escape", "finish")
    timed = ("time", "finish_time", "limit", "charge_power")
    own = {name: getattr(problem, name)[r : r + 1] for name in names + timed}
    return problem._replace(**own)
