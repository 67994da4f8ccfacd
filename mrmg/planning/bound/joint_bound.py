"""Proven lower bounds where energy and time both count: time limits and blends.

With e_r(S) the least energy and t_r(S) the least time of robot r for the goals S, each
on its own, a plan that divides the goals as (S_1 .. S_R) needs at least

    E = sum_r e_r(S_r)  and  T = max_r t_r(S_r).

The least E of all divisions with T <= limit bounds the energy of plans that keep the
limit. A blend is bounded level by level: divisions with T in [a, b] are worth at least
w_E E(b) + w_T a, with E(b) the least energy of divisions with T <= b.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrmg.planning.bound._subset_kernels import least_division
from mrmg.planning.bound.bound import ROUNDING_SHARE
from mrmg.planning.bound.exact_tours import MOST_GOALS, least_costs, of_robot
from mrmg.planning.bound.makespan_bound import least_times_s
from mrmg.planning.bound.relaxation import CELLS, Relaxation
from mrmg.planning.halting import NEVER
from mrmg.scene.objective import Objective
from mrmg.scene.types import Scene

LEVELS = 40
"""Levels of time into which divisions of the goals are sorted."""


@dataclass(frozen=True)
class Divisions:
    """What each robot needs at least for each subset of the goals.

    Attributes:
        energy_J: shape (R, 2^G), inf where batteries do not allow it.
        time_s: shape (R, 2^G).
    """

    energy_J: np.ndarray
    time_s: np.ndarray

    @staticmethod
    def of(
        scene: Scene,
        *,
        step_s: float = 0.1,
        cells: int = CELLS,
        halt: np.ndarray = NEVER,
    ) -> Divisions | None:
        """Return the divisions of a mission; None if it is too large for that.

        Raises:
            Halted: once `halt[0]` has turned true.
        """
        if not 0 < len(scene.goals) <= MOST_GOALS or scene.has_custom_motion:
            return None
        relaxed = Relaxation.of(scene, step_s=step_s, cells=cells, halt=halt)
        problem = relaxed.with_end_climbs()
        goals = np.arange(len(scene.goals))
        energy_J = []
        for r in range(len(scene.robots)):
            own_J = least_costs(of_robot(problem, r), goals)
            if own_J is None:
                return None
            energy_J.append(own_J)
        return Divisions(
            energy_J=np.array(energy_J),
            time_s=least_times_s(scene, step_s=step_s, cells=cells, halt=halt),
        )

    @property
    def makespan_s(self) -> float:
        """A time [s] before which no plan is over."""
        return float(least_division(self.time_s, True)) * (1.0 - ROUNDING_SHARE)

    def energy_within_J(self, limit_s: float) -> float:
        """Return an energy that no plan undercuts which is over by `limit_s`."""
        timely_J = np.where(self.time_s <= limit_s, self.energy_J, np.inf)
        least_J = float(least_division(timely_J, False))
        return max(0.0, least_J) * (1.0 - ROUNDING_SHARE)

    def value(self, objective: Objective, limit_s: float = math.inf) -> float:
        """Return a value of an objective that no plan undercuts within a limit."""
        if not objective.makespan_weight:
            return objective.value(self.energy_within_J(limit_s), 0.0)
        times_s = np.unique(self.time_s[self.time_s <= limit_s])
        least = math.inf
        for level_s in np.array_split(times_s, min(LEVELS, len(times_s))):
            energy_J = self.energy_within_J(float(level_s[-1]))
            least = min(least, objective.value(energy_J, float(level_s[0])))
        return least * (1.0 - ROUNDING_SHARE)
