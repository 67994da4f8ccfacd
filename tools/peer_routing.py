"""mrmg's routing problems in the form that routing packages of others take.

Each peer takes a `RoutingProblem` and returns a `Routing` that
`mrmg.planning.faults_of_tours` judges. PyVRP and OR-Tools count in whole numbers:
energies are rounded to `RESOLUTION` of the mean leg.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from mrmg.planning import Routing, RoutingProblem

RESOLUTION = 1e-4
"""Unit of whole-numbered energies and times as a share of the mean leg."""

FORBIDDEN = 1e3
"""Cost of a leg that does not exist, in sums of all robots' longest legs."""


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


def whole_numbers(legs: np.ndarray, unit: float, order: Sequence[int]) -> np.ndarray:
    """Return legs in whole units, forbidden ones so long that none pays.

    Args:
        legs: as `matrix` returns them.
        unit: of the result.
        order: rows and columns of the result by their numbers in the matrix.
    """
    finite = np.where(np.isfinite(legs), legs, 0.0)
    ban = FORBIDDEN * max(float(finite.max()), unit)
    whole = np.rint(np.where(np.isfinite(legs), legs, ban) / unit).astype(np.int64)
    return np.ascontiguousarray(whole[np.ix_(order, order)])


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
