"""Energies of legs as they were driven, in place of the roadmap's.

The roadmap knows neither turns nor changes of speed. Tours that turn out to take more
than batteries have are found anew for what driving took.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from mrmg.energy.metering import visits_and_energy
from mrmg.planning.problem.problem import Problem
from mrmg.plans import Trajectory

Leg = tuple[int, int, int]
"""Indices of a leg in `RoutingArrays.cost`: table, place and target."""


def legs_driven_J(
    problem: Problem,
    trajectories: Sequence[Trajectory],
    tours: Mapping[str, tuple[str, ...]],
) -> dict[Leg, float]:
    """Return the energy of each leg that was driven to its end [J].

    Args:
        problem: the mission.
        trajectories: of all robots.
        tours: ids of the targets that each robot visits, in order.
    """
    routing = problem.mission.routing
    number = {target.id: t for t, target in enumerate(problem.scene.targets())}
    leg_J: dict[Leg, float] = {}
    for r, trajectory in enumerate(trajectories):
        tour = tours[trajectory.robot]
        visits, _, entries = visits_and_energy(problem.scene, trajectory, tour)
        places = [int(routing.home[r]), *(number[visit.target] for visit in visits)]
        for leg, (place, target) in enumerate(pairwise(places)):
            drawn_J = sum(entry.energy_J for entry in entries if entry.leg == leg)
            leg_J[int(routing.table[r]), place, target] = drawn_J
    return leg_J


def with_driven_legs(problem: Problem, leg_J: Mapping[Leg, float]) -> Problem:
    """Return the problem whose legs take what driving them took.

    Those that were not driven take as much more, or less, as all that were.

    Args:
        problem: the mission.
        leg_J: energies of some legs [J].
    """
    if not leg_J:
        return problem
    problem = problem.with_margin(0.0)
    routing = problem.mission.routing
    at = tuple(np.array(list(leg_J)).T)
    driven_J = np.maximum(0.0, list(leg_J.values()))
    share = max(1e-9, driven_J.sum()) / max(1e-9, routing.cost[at].sum())
    cost = share * routing.cost
    cost[at] = driven_J
    routing = routing._replace(
        cost=cost, escape=share * routing.escape, finish=share * routing.finish
    )
    return replace(problem, mission=problem.mission._replace(routing=routing))
