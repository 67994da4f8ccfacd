"""The routing problem as routers outside this package see it, and faults of tours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from mrmg.planning.routing._nrpa_kernels import RoutingArrays, with_own_tables
from mrmg.planning.routing.routing import Routing

OF_TABLES = ("table", "home")
"""Last fields of `RoutingArrays`, which routers outside this package do without."""

ROUNDING = 1e-6
"""Share by which sums of energies and times may differ."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoutingProblem:
    """Who visits which goals in which order, and recharges where.

    R robots and T targets: `goals` goals, then stations. A node is a target or, as
    number T, a robot's own start. Each tour visits targets in order and then ends at
    the robot's finish, if it has one. A robot that recharges leaves with a full
    battery. Arrays are read-only.

    Attributes:
        goals: number of goals.
        leg_energy_J: from node to target, inf where there is no path, (R, T + 1, T).
        start_energy_J: in batteries at the start, shape (R,).
        capacity_J: of batteries, shape (R,).
        reserve_J: that batteries never go below, shape (R,).
        escape_J: at least this is needed from a target to the nearest station or to
            the robot's finish, shape (R, T).
        open_goals: which goals are to be visited, shape (goals,).
        finish_energy_J: from node to the robot's finish, shape (R, T + 1); 0 for robots
            that end anywhere, inf where there is no path.
        leg_time_s: from node to target, the dwell there included, (R, T + 1, T).
        finish_time_s: from node to the finish, shape (R, T + 1).
        time_limit_s: of each tour with its finish, inf for none, shape (R,).
        charging_power_W: at which batteries are filled, inf for at once, shape (R,).
        consumers_W: what is drawn at all times, in the energies of legs for as long as
            they take, shape (R,).
        energy_weight: of the fleet's energy in the objective, without consumers [1/J].
        makespan_weight: of the longest tour's time in the objective, in it what all
            consumers draw until then [1/s].
    """

    goals: int
    leg_energy_J: np.ndarray
    start_energy_J: np.ndarray
    capacity_J: np.ndarray
    reserve_J: np.ndarray
    escape_J: np.ndarray
    open_goals: np.ndarray
    finish_energy_J: np.ndarray
    leg_time_s: np.ndarray
    finish_time_s: np.ndarray
    time_limit_s: np.ndarray
    charging_power_W: np.ndarray
    consumers_W: np.ndarray
    energy_weight: float
    makespan_weight: float

    @staticmethod
    def of(arrays: RoutingArrays) -> RoutingProblem:
        """Return the problem that kernels have as `arrays`, in the same order."""
        names = (each.name for each in fields(RoutingProblem))
        values = with_own_tables(arrays)[: -len(OF_TABLES)]
        own: dict[str, Any] = dict(zip(names, values, strict=True))
        for name, value in own.items():
            if isinstance(value, np.ndarray):
                own[name] = value.view()
                own[name].setflags(write=False)
        return RoutingProblem(**own)

    @property
    def arrays(self) -> RoutingArrays:
        """The problem for kernels: copies that may be written."""
        own: list[Any] = [getattr(self, each.name) for each in fields(self)]
        own += [np.arange(self.robots), np.full(self.robots, self.targets)]
        return RoutingArrays._make(
            each.copy() if isinstance(each, np.ndarray) else each for each in own
        )

    @property
    def robots(self) -> int:
        """Number of robots."""
        return len(self.start_energy_J)

    @property
    def targets(self) -> int:
        """Number of goals and stations."""
        return int(self.leg_energy_J.shape[2])


@dataclass(frozen=True, slots=True)
class TourLedger:
    """What one tour takes.

    Attributes:
        energy_J: of all legs, the finish included.
        driving_J: the same without what consumers draw: what counts in the objective.
        time_s: until its end.
        least_J: least that is left in the battery on the way.
    """

    energy_J: float
    driving_J: float
    time_s: float
    least_J: float


def tour_ledger(problem: RoutingProblem, robot: int, tour: Sequence[int]) -> TourLedger:
    """Return what a tour takes, leg by leg."""
    node, left_J = problem.targets, float(problem.start_energy_J[robot])
    energy_J, time_s, charging_s, least_J = 0.0, 0.0, 0.0, left_J
    for target in tour:
        leg_J = float(problem.leg_energy_J[robot, node, target])
        energy_J, left_J = energy_J + leg_J, left_J - leg_J
        least_J = min(least_J, left_J)
        time_s += float(problem.leg_time_s[robot, node, target])
        if target >= problem.goals:
            full_J = float(problem.capacity_J[robot])
            charging_s += (full_J - left_J) / float(problem.charging_power_W[robot])
            left_J = full_J
        node = target
    last_J = float(problem.finish_energy_J[robot, node])
    time_s += float(problem.finish_time_s[robot, node])
    energy_J += last_J
    return TourLedger(
        energy_J=energy_J,
        driving_J=energy_J - float(problem.consumers_W[robot]) * time_s,
        time_s=time_s + charging_s,
        least_J=min(least_J, left_J - last_J),
    )


def faults_of_tours(problem: RoutingProblem, routing: Routing) -> Iterator[str]:
    """Yield in words what is wrong with tours; nothing for a routing without any."""
    if not routing.feasible:
        if routing.cost_J != np.inf:
            yield f"a cost of {routing.cost_J} J; it is inf where there are no tours"
        return
    if len(routing.tours) != problem.robots:
        yield f"{len(routing.tours)} tours for {problem.robots} robots"
        return
    visits = [target for tour in routing.tours for target in tour]
    if any(not 0 <= target < problem.targets for target in visits):
        yield f"a target outside 0..{problem.targets - 1}"
        return
    for goal in range(problem.goals):
        wanted, found = int(problem.open_goals[goal]), visits.count(goal)
        if found != wanted:
            yield f"goal {goal} is visited {found} times, not {wanted}"
    total_J = 0.0
    for robot, tour in enumerate(routing.tours):
        ledger = tour_ledger(problem, robot, tour)
        total_J += ledger.energy_J
        moves = len(tour) > 0 or ledger.energy_J > 0.0
        short_J = float(problem.reserve_J[robot]) - ledger.least_J
        if moves and short_J > ROUNDING * float(problem.capacity_J[robot]):
            yield f"robot {robot} comes {short_J:.6g} J below its reserve"
        limit_s = float(problem.time_limit_s[robot])
        if ledger.time_s > limit_s * (1.0 + ROUNDING):
            yield f"robot {robot} takes {ledger.time_s:.6g} s of {limit_s:.6g} s"
    if abs(routing.cost_J - total_J) > ROUNDING * max(total_J, 1.0):
        yield f"a cost of {routing.cost_J:.6g} J for tours of {total_J:.6g} J"
