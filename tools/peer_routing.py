"""Routing packages of others on mrmg's routing problems: PyVRP, OR-Tools, frvcpy.

Each solver takes a `RoutingProblem` and returns a `Routing` that
`mrmg.planning.faults_of_tours` judges. They count in whole numbers: energies are
rounded to `RESOLUTION` of the mean leg.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from itertools import pairwise
from math import inf, isfinite
from typing import Any

import numpy as np

from mrmg.planning import Routing, RoutingProblem

RESOLUTION = 1e-4
"""Unit of whole-numbered energies and times as a share of the mean leg."""

FORBIDDEN = 1e3
"""Cost of a leg that does not exist, in sums of all robots' longest legs."""

STATION_COPIES = 3
"""Visits of each station that OR-Tools may make in all; it has no node twice."""

CHARGING_TIME = 1e-6
"""Time of a whole charge in frvcpy, whose charging cannot be instant, as a share of
the longest leg."""


def unit_of(legs: np.ndarray) -> float:
    """Return the unit in which energies or times are whole numbers."""
    positive = legs[np.isfinite(legs) & (legs > 0.0)]
    return RESOLUTION * float(positive.mean()) if positive.size else 1.0


def matrix(
    problem: RoutingProblem, robot: int, nodes: Sequence[int], *, time: bool = False
) -> np.ndarray:
    """Return legs among a robot's start, nodes and end, in the problem's units.

    Args:
        problem: gives the legs.
        robot: whose start, legs and end count.
        nodes: goals and stations, possibly repeated.
        time: whether times count instead of energies.

    Returns:
        Shape (n + 2, n + 2); row 0 is the start, the last column the end.
    """
    leg = (problem.leg_time_s if time else problem.leg_energy_J)[robot]
    last = (problem.finish_time_s if time else problem.finish_energy_J)[robot]
    rows = [problem.targets, *nodes]
    whole = np.zeros((len(nodes) + 2, len(nodes) + 2))
    whole[:-1, 1:-1] = leg[np.ix_(rows, nodes)]
    whole[:-1, -1] = last[rows]
    return whole


def whole_numbers(value: np.ndarray, unit: float) -> np.ndarray:
    """Return legs in whole units, forbidden ones so long that none pays."""
    finite = np.where(np.isfinite(value), value, 0.0)
    ban = FORBIDDEN * max(float(finite.max()), unit)
    return np.rint(np.where(np.isfinite(value), value, ban) / unit).astype(np.int64)


def routing_of(problem: RoutingProblem, tours: Sequence[Sequence[int]]) -> Routing:
    """Return tours with their energy; infinite where a leg does not exist."""
    cost_J = 0.0
    for robot, tour in enumerate(tours):
        nodes = [problem.targets, *tour]
        cost_J += sum(
            float(problem.leg_energy_J[robot, a, b]) for a, b in pairwise(nodes)
        )
        cost_J += float(problem.finish_energy_J[robot, nodes[-1]])
    return Routing(tuple(map(tuple, tours)), cost_J)


def pyvrp(
    problem: RoutingProblem, seed: int, limit_s: float, *, battery: bool
) -> Routing:
    """Return PyVRP's tours: every robot a vehicle type with a depot and matrix.

    Args:
        problem: its stations are left out.
        seed: of the solver.
        limit_s: for which it searches.
        battery: whether a route may take no more than the battery holds; PyVRP has no
            recharging, so that missions with stations are solved without.
    """
    import pyvrp

    goals = [int(goal) for goal in np.flatnonzero(problem.open_goals)]
    robots, n = problem.robots, len(goals)
    unit = unit_of(problem.leg_energy_J)
    second = unit_of(problem.leg_time_s)
    # Locations: goals, each robot's start, one end; another robot's start is no matter.
    energies, times = [], []
    for robot in range(robots):
        for found, of_time, scale in (
            (energies, False, unit),
            (times, True, second),
        ):
            own = whole_numbers(matrix(problem, robot, goals, time=of_time), scale)
            order = [*range(1, n + 1), *[0] * robots, n + 1]
            found.append(np.ascontiguousarray(own[np.ix_(order, order)]))
            np.fill_diagonal(found[-1], 0)
    content_J = problem.start_energy_J - problem.reserve_J
    most: list[dict[str, int]] = [{} for _ in range(robots)]
    for robot, own in enumerate(most):
        if battery:
            own["max_distance"] = int(content_J[robot] / unit)
        if isfinite(problem.time_limit_s[robot]):
            own["shift_duration"] = int(problem.time_limit_s[robot] / second)
    data = pyvrp.ProblemData(
        locations=[pyvrp.Location(0, 0) for _ in range(n + robots + 1)],
        clients=[pyvrp.Client(location) for location in range(n)],
        depots=[pyvrp.Depot(location) for location in range(n, n + robots + 1)],
        vehicle_types=[
            pyvrp.VehicleType(
                start_depot=robot, end_depot=robots, profile=robot, **most[robot]
            )
            for robot in range(robots)
        ],
        distance_matrices=energies,
        duration_matrices=times,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of batteries that are short of its penalties
        result = pyvrp.solve(
            data, pyvrp.stop.MaxRuntime(limit_s), seed=seed, collect_stats=False
        )
    tours: list[list[int]] = [[] for _ in range(robots)]
    if not result.best.is_feasible():
        return Routing(tuple(map(tuple, tours)), inf)
    for route in result.best.routes():
        tours[route.vehicle_type()] = [
            goals[stop.idx] for stop in route if stop.is_client()
        ]
    return routing_of(problem, tours)


def ortools(
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
    from ortools.constraint_solver import pywrapcp, routing_enums_pb2

    robots = problem.robots
    goals = [int(goal) for goal in np.flatnonzero(problem.open_goals)]
    stations = list(range(problem.goals, problem.targets)) * STATION_COPIES
    nodes = goals + stations
    n, unit = len(nodes), unit_of(problem.leg_energy_J)
    second = unit_of(problem.leg_time_s)
    # Nodes: goals and stations, then each robot's start, then each robot's end.
    starts = [n + robot for robot in range(robots)]
    manager = pywrapcp.RoutingIndexManager(
        n + 2 * robots, robots, starts, [start + robots for start in starts]
    )
    model = pywrapcp.RoutingModel(manager)
    order = [*range(1, n + 1), *[0] * robots, *[n + 1] * robots]
    loss, duration = [], []
    for robot in range(robots):
        own = whole_numbers(matrix(problem, robot, nodes), unit)[np.ix_(order, order)]
        model.SetArcCostEvaluatorOfVehicle(
            model.RegisterTransitMatrix(own.tolist()), robot
        )
        loss.append(model.RegisterTransitMatrix((-own).tolist()))
        times = whole_numbers(matrix(problem, robot, nodes, time=True), second)
        duration.append(
            model.RegisterTransitMatrix(times[np.ix_(order, order)].tolist())
        )
    room = ((problem.capacity_J - problem.reserve_J) / unit).astype(int).tolist()
    content = ((problem.start_energy_J - problem.reserve_J) / unit).astype(int).tolist()
    model.AddDimensionWithVehicleTransitAndCapacity(
        loss, max(room), room, False, "charge"
    )
    charge = model.GetDimensionOrDie("charge")
    for node in range(n):
        if node < len(goals):
            charge.SlackVar(manager.NodeToIndex(node)).SetValue(0)
        else:
            index = manager.NodeToIndex(node)
            model.AddDisjunction([index], 0)
            # Nothing is charged beyond a full battery; vehicle -1 visits no station.
            full = model.solver().Element([0, *room], model.VehicleVar(index) + 1)
            model.solver().Add(charge.CumulVar(index) + charge.SlackVar(index) <= full)
    for robot in range(robots):
        start = model.Start(robot)
        charge.CumulVar(start).SetValue(content[robot])
        charge.SlackVar(start).SetValue(0)
    if np.isfinite(problem.time_limit_s).any():
        limits = np.where(np.isfinite(problem.time_limit_s), problem.time_limit_s, 1e9)
        most = (limits / second).astype(int).tolist()
        model.AddDimensionWithVehicleTransitAndCapacity(duration, 0, most, True, "time")
    search = pywrapcp.DefaultRoutingSearchParameters()
    search.first_solution_strategy = (
        routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    )
    search.local_search_metaheuristic = (
        routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    )
    search.time_limit.FromMilliseconds(int(1000 * limit_s))
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


def frvcpy(problem: RoutingProblem, orders: Sequence[Sequence[int]]) -> Routing:
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
