"""What a planner is asked for, and what it gives: one attempt at a mission."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntFlag

import numpy as np

from mrmg import seeding
from mrmg.planning.assembly import Refusal, make_plan
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.problem.problem import Problem
from mrmg.planning.routers import Router, solve
from mrmg.planning.routing.routing import Routing
from mrmg.plans import Plan, Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """A request for one attempt at a mission.

    The attempt is a function of problem, parameters, router, seed and number alone.

    Attributes:
        params: parameters, such as `obstacle_margin_m` and `robot_margin_m`, which
            plans keep at every step, and `soc_margin`.
        router: finds tours.
        seed: of the whole search.
        number: of the attempt, from 0; each has random streams of its own.
        halt: shape (1,); the attempt ends soon after it has turned true.
    """

    params: PlannerParams
    router: Router
    seed: int
    number: int = 0
    halt: np.ndarray = field(default_factory=lambda: np.zeros(1, np.bool_))

    @property
    def halted(self) -> bool:
        """Whether the attempt is to end now."""
        return bool(self.halt[0])

    def stream_seed(self, name: str) -> int:
        """Return the seed of one of the attempt's random streams."""
        return seeding.stream_seed(self.seed, name, self.number)

    def tours(self, problem: Problem, seed: int | None = None) -> Routing:
        """Return the router's tours for a problem.

        Args:
            problem: the mission.
            seed: of the router; one of the attempt's own if None.
        """
        if seed is None:
            seed = self.stream_seed("tours")
        return solve(self.router, problem.mission.routing, seed)

    def plan(
        self,
        problem: Problem,
        trajectories: Sequence[Trajectory],
        tours: Mapping[str, tuple[str, ...]],
    ) -> Plan | None:
        """Return the plan of trajectories, or None if exact accounting refuses it.

        Args:
            problem: the mission.
            trajectories: of all robots, equally long, each at rest in the end.
            tours: ids of the targets that each robot visits, in order.
        """
        return self.plan_or_refusal(problem, trajectories, tours)[0]

    def plan_or_refusal(
        self,
        problem: Problem,
        trajectories: Sequence[Trajectory],
        tours: Mapping[str, tuple[str, ...]],
    ) -> tuple[Plan | None, Refusal | None]:
        """Return what `plan` does, or None and why exact accounting refuses it."""
        return make_plan(problem, self.seed, self.params, trajectories, tours)


class GivenUp(IntFlag):
    """Margins that plans keep less of than is wanted; the smaller value is the better.

    Attributes:
        NONE: all are kept.
        CHARGE: `PlannerParams.soc_margin`, of batteries.
        DISTANCES: from obstacles, or between robots.
    """

    NONE = 0
    CHARGE = 1
    DISTANCES = 2


@dataclass(frozen=True, slots=True)
class Attempt:
    """What one attempt gave.

    Attributes:
        plans: those found, each better than the one before; some may be late.
        found_at: readings of `time.perf_counter()` when they were found; empty if
            that is when the attempt ended.
        routing_s: time the tours took.
        counts: of what was done, such as fleets driven along tours, searches for
            motions and router calls.
        tours_found: whether the router found any.
        blocked: what stood in the way of motions along them; "" if nothing did.
        refused: why motions along them are no plan, of those that are nearest to one.
        given_up: margins that its plans keep less of than is wanted.
    """

    plans: Sequence[Plan] = ()
    found_at: Sequence[float] = ()
    routing_s: float = 0.0
    counts: Mapping[str, int] = field(default_factory=dict)
    tours_found: bool = True
    blocked: str = ""
    refused: Refusal | None = None
    given_up: GivenUp = GivenUp.NONE

    def after(self, failed: Attempt) -> Attempt:
        """Return this attempt with what one before it has found out."""
        return replace(
            self,
            routing_s=failed.routing_s + self.routing_s,
            counts=Counter(failed.counts) + Counter(self.counts),
            tours_found=failed.tours_found or self.tours_found,
            blocked=self.blocked or failed.blocked,
            refused=least_refusal(self.refused, failed.refused),
        )


def least_refusal(*refusals: Refusal | None) -> Refusal | None:
    """Return that of some refusals of which least is missing; None if there is none."""
    return min(filter(None, refusals), default=None)
