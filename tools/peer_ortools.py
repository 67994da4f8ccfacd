"""OR-Tools on mrmg's routing problems."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

import numpy as np
from peer_routing import matrix, routing_of, unit_of, whole_numbers

from mrmg.planning import Routing, RoutingProblem

STATION_COPIES = 3
"""Visits of each station that OR-Tools may make in all; it has no node twice."""


def solve(
    problem: RoutingProblem, limit_s: float, first: Sequence[Sequence[int]]
) -> Routing:
    """Return OR-Tools' tours: charge is a dimension that stations may raise.

    Every station has `STATION_COPIES` optional nodes. It searches by guided local
    search, as its documentation advises, and takes no seed.

    Args:
        problem: that of the tours.
        limit_s: for which it searches.
        first: tours to begin with; empty ones leave the first to OR-Tools (path of
            cheapest arcs).
    """
    from ortools.constraint_solver import pywrapcp

    robots = problem.robots
    goals = [int(goal) for goal in np.flatnonzero(problem.open_goals)]
    nodes = goals + list(range(problem.goals, problem.targets)) * STATION_COPIES
    n = len(nodes)
    # Nodes: goals and stations, then each robot's start, then each robot's end.
    starts = [n + robot for robot in range(robots)]
    manager = pywrapcp.RoutingIndexManager(
        n + 2 * robots, robots, starts, [start + robots for start in starts]
    )
    model = pywrapcp.RoutingModel(manager)
    order = [*range(1, n + 1), *[0] * robots, *[n + 1] * robots]
    _add_energies(problem, nodes, order, manager, model)
    _add_time_limits(problem, nodes, order, model)
    search = _guided_search(limit_s)
    if any(first):
        model.CloseModelWithParameters(search)
        begun = model.ReadAssignmentFromRoutes(_as_nodes(first, nodes), True)
        found = model.SolveFromAssignmentWithParameters(begun, search)
    else:
        found = model.SolveWithParameters(search)
    tours: list[list[int]] = [[] for _ in range(robots)]
    if found is None:
        return Routing(tuple(map(tuple, tours)), inf)
    for robot, tour in enumerate(tours):
        index = found.Value(model.NextVar(model.Start(robot)))
        while not model.IsEnd(index):
            tour.append(nodes[manager.IndexToNode(index)])
            index = found.Value(model.NextVar(index))
    return routing_of(problem, tours)


def _add_energies(
    problem: RoutingProblem,
    nodes: Sequence[int],
    order: Sequence[int],
    manager: Any,
    model: Any,
) -> None:
    """Make energies the cost of OR-Tools' model, and charge a dimension of it."""
    unit, loss = unit_of(problem.leg_energy_J), []
    for robot in range(problem.robots):
        own = whole_numbers(matrix(problem, robot, nodes), unit, order)
        model.SetArcCostEvaluatorOfVehicle(
            model.RegisterTransitMatrix(own.tolist()), robot
        )
        loss.append(model.RegisterTransitMatrix((-own).tolist()))
    room = ((problem.capacity_J - problem.reserve_J) / unit).astype(int).tolist()
    content = ((problem.start_energy_J - problem.reserve_J) / unit).astype(int).tolist()
    model.AddDimensionWithVehicleTransitAndCapacity(
        loss, max(room), room, False, "charge"
    )
    charge = model.GetDimensionOrDie("charge")
    for number, target in enumerate(nodes):
        index = manager.NodeToIndex(number)
        if target < problem.goals:
            charge.SlackVar(index).SetValue(0)
        else:
            model.AddDisjunction([index], 0)
            # Nothing is charged beyond a full battery; vehicle -1 visits no station.
            full = model.solver().Element([0, *room], model.VehicleVar(index) + 1)
            model.solver().Add(charge.CumulVar(index) + charge.SlackVar(index) <= full)
    for robot in range(problem.robots):
        start = model.Start(robot)
        charge.CumulVar(start).SetValue(content[robot])
        charge.SlackVar(start).SetValue(0)


def _add_time_limits(
    problem: RoutingProblem, nodes: Sequence[int], order: Sequence[int], model: Any
) -> None:
    """Make time a dimension of OR-Tools' model where a robot's time is limited."""
    if not np.isfinite(problem.time_limit_s).any():
        return
    second, duration = unit_of(problem.leg_time_s), []
    for robot in range(problem.robots):
        legs = matrix(problem, robot, nodes, time=True)
        times = whole_numbers(legs, second, order)
        duration.append(model.RegisterTransitMatrix(times.tolist()))
    limits = np.where(np.isfinite(problem.time_limit_s), problem.time_limit_s, 1e9)
    most = (limits / second).astype(int).tolist()
    model.AddDimensionWithVehicleTransitAndCapacity(duration, 0, most, True, "time")


def _guided_search(limit_s: float) -> Any:
    from ortools.constraint_solver import pywrapcp, routing_enums_pb2

    search = pywrapcp.DefaultRoutingSearchParameters()
    search.first_solution_strategy = (
        routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    )
    search.local_search_metaheuristic = (
        routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    )
    search.time_limit.FromMilliseconds(int(1000 * limit_s))
    return search


def _as_nodes(tours: Sequence[Sequence[int]], nodes: Sequence[int]) -> list[list[int]]:
    """Return tours as numbers of nodes, none used twice."""
    free = list(range(len(nodes)))
    routes = []
    for tour in tours:
        routes.append([])
        for target in tour:
            node = next(node for node in free if nodes[node] == target)
            free.remove(node)
            routes[-1].append(node)
    return routes
