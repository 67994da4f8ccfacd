"""frvcpy, which places charging stops, on mrmg's routing problems."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite
from typing import Any

import numpy as np
from peer_routing import FORBIDDEN, matrix, routing_of

from mrmg.planning import Routing, RoutingProblem

CHARGING_TIME = 1e-6
"""Time of a whole charge in frvcpy, whose charging cannot be instant, as a share of
the longest leg."""


def solve(problem: RoutingProblem, orders: Sequence[Sequence[int]]) -> Routing:
    """Return tours in which frvcpy has placed the charging stops.

    A leg's time is its energy and charging takes no time, so that the shortest route
    is that of least energy.

    Args:
        problem: gives legs, batteries and stations.
        orders: goals of each robot in order.
    """
    tours = []
    for robot, order in enumerate(orders):
        if not order and not np.any(problem.finish_energy_J[robot, -1]):
            tours.append([])
            continue
        tour = _with_stops(problem, robot, list(order))
        if tour is None:
            return Routing(tuple(() for _ in orders), inf)
        tours.append(tour)
    return routing_of(problem, tours)


def _with_stops(
    problem: RoutingProblem, robot: int, order: list[int]
) -> list[int] | None:
    """Return one robot's tour with charging stops, None if there is none."""
    from frvcpy.solver import Solver

    stations = list(range(problem.goals, problem.targets))
    nodes = [*order, *stations]
    own = matrix(problem, robot, nodes)
    scale = float(own[np.isfinite(own)].max())
    last, reserve_J = len(nodes) + 1, float(problem.reserve_J[robot])
    room = (float(problem.capacity_J[robot]) - reserve_J) / scale
    # frvcpy leaves each stop with enough to reach a charger, the last one, too, which
    # our routes need not: a charger at the end of the route is never in the way.
    legs = np.full((last + 2, last + 2), FORBIDDEN)
    legs[:last, 1 : last + 1] = np.where(np.isfinite(own), own / scale, FORBIDDEN)[
        :last, 1:
    ]
    legs[:last, last + 1] = legs[:last, last]
    legs[last:, last:] = 0.0
    chargers = [*range(1 + len(order), last), last + 1]
    instance: dict[str, Any] = {
        "max_q": room,
        "t_max": FORBIDDEN * len(nodes),
        "energy_matrix": legs.tolist(),
        "time_matrix": legs.tolist(),
        "process_times": [0.0] * len(legs),
        "css": [{"node_id": node, "cs_type": 0} for node in chargers],
        "breakpoints_by_type": [
            {"cs_type": 0, "time": [0.0, CHARGING_TIME], "charge": [0.0, room]}
        ],
    }
    route = [0, *range(1, len(order) + 1), last]
    start = (float(problem.start_energy_J[robot]) - reserve_J) / scale
    duration, stops = Solver(instance, route, start).solve()
    if not isfinite(duration) or stops is None:
        return None
    return [nodes[node - 1] for node, _ in stops if 0 < node < last]
