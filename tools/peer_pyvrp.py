"""PyVRP on mrmg's routing problems."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from math import inf, isfinite
from typing import Any

import numpy as np
import peer_frvcpy
from peer_routing import matrix, routing_of, unit_of, whole_numbers

from mrmg.planning import Routing, RoutingProblem


def solve(problem: RoutingProblem, seed: int, limit_s: float) -> Routing:
    """Return PyVRP's tours, with charging stops by frvcpy where there are stations.

    PyVRP has no recharging: where there are stations it knows no batteries.

    Args:
        problem: that of the tours.
        seed: of the solver.
        limit_s: for which it searches.
    """
    stations = problem.targets > problem.goals
    found = _tours(problem, seed, limit_s, battery=not stations)
    if not stations or not found.feasible:
        return found
    return peer_frvcpy.solve(problem, found.tours)


def _tours(
    problem: RoutingProblem, seed: int, limit_s: float, *, battery: bool
) -> Routing:
    """Return PyVRP's tours of goals, of which batteries bound the energy or not."""
    import pyvrp

    goals = [int(goal) for goal in np.flatnonzero(problem.open_goals)]
    data = _problem_data(problem, goals, battery=battery)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of batteries that are short of its penalties
        result = pyvrp.solve(
            data, pyvrp.stop.MaxRuntime(limit_s), seed=seed, collect_stats=False
        )
    tours: list[list[int]] = [[] for _ in range(problem.robots)]
    if not result.best.is_feasible():
        return Routing(tuple(map(tuple, tours)), inf)
    for route in result.best.routes():
        tours[route.vehicle_type()] = [
            goals[stop.idx] for stop in route if stop.is_client()
        ]
    return routing_of(problem, tours)


def _problem_data(
    problem: RoutingProblem, goals: Sequence[int], *, battery: bool
) -> Any:
    """Return PyVRP's problem: every robot a vehicle type with a depot and matrices."""
    import pyvrp

    robots, n = problem.robots, len(goals)
    unit, second = unit_of(problem.leg_energy_J), unit_of(problem.leg_time_s)
    # Locations: goals, each robot's start, one end; another robot's start is no matter.
    order = [*range(1, n + 1), *[0] * robots, n + 1]
    energies, times = [], []
    for robot in range(robots):
        for found, of_time, scale in (
            (energies, False, unit),
            (times, True, second),
        ):
            legs = matrix(problem, robot, goals, time=of_time)
            found.append(whole_numbers(legs, scale, order))
            np.fill_diagonal(found[-1], 0)
    content_J = problem.start_energy_J - problem.reserve_J
    most: list[dict[str, int]] = [{} for _ in range(robots)]
    for robot, own in enumerate(most):
        if battery:
            own["max_distance"] = int(content_J[robot] / unit)
        if isfinite(problem.time_limit_s[robot]):
            own["shift_duration"] = int(problem.time_limit_s[robot] / second)
    return pyvrp.ProblemData(
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
