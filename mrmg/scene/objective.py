"""What makes one plan of a mission better than another, and by when it must be over."""

from __future__ import annotations

import math
from dataclasses import dataclass

ROUNDING_S = 1e-6
"""Rounding of summed steps that is forgiven in when a mission is over."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Objective:
    """A weighted sum of the fleet's energy and the mission's duration; less is better.

    Attributes:
        energy_weight: of the energy of the whole fleet [1/J].
        makespan_weight: of the time at which the last robot has come to rest [1/s].
    """

    energy_weight: float = 1.0
    makespan_weight: float = 0.0

    @property
    def name(self) -> str:
        """What the objective is called: "energy", "makespan" or "blend"."""
        if self.makespan_weight == 0.0:
            return "energy"
        return "makespan" if self.energy_weight == 0.0 else "blend"

    @property
    def unit(self) -> str:
        """The unit of its values; "1" for a blend."""
        return {"energy": "J", "makespan": "s", "blend": "1"}[self.name]

    def value(self, energy_J: float, makespan_s: float) -> float:
        """Return the value of a plan, or of bounds of both, which bounds it."""
        weighed = ((self.energy_weight, energy_J), (self.makespan_weight, makespan_s))
        # A product of zero and an infinite bound would be no number.
        return sum(weight * figure for weight, figure in weighed if weight)


ENERGY = Objective()
"""The energy of the fleet alone: what missions are judged by unless they say else."""

MAKESPAN = Objective(energy_weight=0.0, makespan_weight=1.0)
"""The duration of the mission alone."""


def overtime_s(limit_s: float, over_s: float) -> float:
    """Return how much later than its time limit a mission is over; 0 if it is not.

    Args:
        limit_s: the limit; inf for none.
        over_s: when the last robot has come to rest.
    """
    if math.isinf(limit_s) or over_s <= limit_s + ROUNDING_S:
        return 0.0
    return over_s - limit_s
