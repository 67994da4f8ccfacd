"""Energies of legs as they were driven, in place of the roadmap's.

The roadmap knows neither turns nor changes of speed. Tours that turn out to take more
than batteries have are found anew for what driving took.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from mrmg.energy.metering import visits_and_energy
from mrmg.planning.problem.problem import Problem
from mrmg.plans import Trajectory

Leg = tuple[int, int, int]
"""Indices of a leg in `RoutingArrays.cost`: table, place and target."""


@dataclass(slots=True)
class Driven:
    """What driving took.

    Attributes:
        leg_J: energies of legs that were driven to their ends.
        rest_J: what each robot's consumers drew from when it had come to rest until the
            mission was over.
    """

    leg_J: dict[Leg, float] = field(default_factory=dict)
    rest_J: dict[int, float] = field(default_factory=dict)

    def update(self, later: Driven) -> None:
        """Take over what later driving took."""
        self.leg_J.update(later.leg_J)
        self.rest_J.update(later.rest_J)


def what_driving_took(
    problem: Problem,
    trajectories: Sequence[Trajectory],
    tours: Mapping[str, tuple[str, ...]],
) -> Driven:
    """Return what driving tours took.

    Args:
        problem: the mission.
        trajectories: of all robots.
        tours: ids of the targets that each robot visits, in order.
    """
    routing = problem.mission.routing
    number = {target.id: t for t, target in enumerate(problem.scene.targets())}
    driven = Driven()
    for r, trajectory in enumerate(trajectories):
        tour = tours[trajectory.robot]
        visits, _, entries = visits_and_energy(problem.scene, trajectory, tour)
        places = [int(routing.home[r]), *(number[visit.target] for visit in visits)]
        for leg, (place, target) in enumerate(pairwise(places)):
            drawn_J = sum(entry.energy_J for entry in entries if entry.leg == leg)
            driven.leg_J[int(routing.table[r]), place, target] = drawn_J
        moving = np.flatnonzero((np.diff(trajectory.state, axis=0) != 0.0).any(axis=1))
        resting = len(trajectory.control) - (moving[-1] + 1 if len(moving) else 0)
        power_W = problem.scene.robots[r].model.consumers_W
        driven.rest_J[r] = power_W * trajectory.dt_s * float(resting)
    return driven


def with_driven_legs(problem: Problem, driven: Driven) -> Problem:
    """Return the problem whose legs take what driving them took.

    Those that were not driven take as much more, or less, as all that were. What robots
    took while they stood at the end counts as if they drove on to a finish.

    Args:
        problem: the mission.
        driven: what driving some tours took.
    """
    leg_J = driven.leg_J
    if not leg_J:
        return problem
    problem = problem.with_margin(0.0)
    routing = problem.mission.routing
    at = tuple(np.array(list(leg_J)).T)
    driven_J = np.maximum(0.0, list(leg_J.values()))
    share = max(1e-9, driven_J.sum()) / max(1e-9, routing.cost[at].sum())
    cost = share * routing.cost
    cost[at] = driven_J
    finish = share * routing.finish
    for r, rest_J in driven.rest_J.items():
        finish[r] += rest_J
    return problem.with_routing(cost=cost, escape=share * routing.escape, finish=finish)
