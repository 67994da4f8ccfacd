"""Which of two plans is better: the one place where the planner compares plans."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mrmg.plans import Plan
from mrmg.scene.objective import ENERGY, Objective, overtime_s
from mrmg.scene.types import Scene

TIME_MARGIN_S = 1.0
"""How much before a time limit plans are over, so that those driven are in time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Preference:
    """What plans of a mission are compared by.

    Attributes:
        objective: what is to be small.
        limit_s: longest makespan that is planned; inf for any.
        consumers_W: what consumers of the whole fleet draw until the mission is over.
    """

    objective: Objective = ENERGY
    limit_s: float = math.inf
    consumers_W: float = 0.0

    @staticmethod
    def of(scene: Scene) -> Preference:
        """Return the preference of a scene, with room for execution to be late."""
        return Preference(
            objective=scene.objective,
            limit_s=scene.time_limit_s - TIME_MARGIN_S,
            consumers_W=sum(robot.model.consumers_W for robot in scene.robots),
        )

    @property
    def driving(self) -> Objective:
        """The objective in terms of the energy of driving alone, and of time.

        Consumers draw, in all robots, for as long as the mission takes.
        """
        own = self.objective
        drawn = own.energy_weight * self.consumers_W
        return replace(own, makespan_weight=own.makespan_weight + drawn)

    @property
    def timed(self) -> bool:
        """Whether it matters at all how long anything takes."""
        return self.driving.makespan_weight > 0.0 or math.isfinite(self.limit_s)

    def late_s(self, plan: Plan) -> float:
        """Return how much later than planned for a plan is over; 0 if it is not."""
        return overtime_s(self.limit_s, plan.makespan_s)

    def rank(self, plan: Plan) -> tuple[float, float, float]:
        """Return (lateness, value of the objective, energy): the least is the best.

        Plans that are late are no answers, but drawing them tight may make them one.
        """
        return self.late_s(plan), self.value(plan), plan.cost_J

    def gains(self, better: Plan, plan: Plan, share: float) -> bool:
        """Return whether one plan betters another one by a share of the objective."""
        if self.late_s(plan) > 0.0:
            return self.late_s(better) < self.late_s(plan)
        return self.value(better) < (1.0 - share) * self.value(plan)

    def value(self, plan: Plan) -> float:
        """Return the value of the objective."""
        return self.objective.value(plan.cost_J, plan.makespan_s)
