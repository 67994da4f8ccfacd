"""What one planning run counts, times and finds."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from typing import Any

from mrmg.scene.objective import ENERGY, Objective


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """What no plan of a mission undercuts.

    Attributes:
        energy_J: of the fleet; None while it is not known, or not wanted.
        makespan_s: as `energy_J`.
        blend: value of an objective in which both count; None as `energy_J`.
    """

    energy_J: float | None = None
    makespan_s: float | None = None
    blend: float | None = None

    def of(self, objective: Objective) -> float | None:
        """Return what the objective's value cannot undercut; None if unknown."""
        if objective.energy_weight and self.energy_J is None:
            return None
        if objective.makespan_weight and self.makespan_s is None:
            return None
        value = objective.value(self.energy_J or 0.0, self.makespan_s or 0.0)
        return value if self.blend is None else max(value, self.blend)

    def raised_by(self, other: Bounds) -> Bounds:
        """Return the greater of each two bounds."""
        return Bounds(
            energy_J=_greater(self.energy_J, other.energy_J),
            makespan_s=_greater(self.makespan_s, other.makespan_s),
            blend=_greater(self.blend, other.blend),
        )


def _greater(first: float | None, second: float | None) -> float | None:
    known = [bound for bound in (first, second) if bound is not None]
    return max(known, default=None)


UNKNOWN = Bounds()
"""Nothing is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Improvement:
    """A plan that is better than all before it.

    Attributes:
        time_s: since planning began.
        cost_J: the plan's energy.
        makespan_s: its duration.
        objective: what it is better by.
        bounds: what is known that no plan undercuts.
    """

    time_s: float
    cost_J: float
    makespan_s: float
    objective: Objective = ENERGY
    bounds: Bounds = UNKNOWN

    @property
    def value(self) -> float:
        """The objective's value."""
        return self.objective.value(self.cost_J, self.makespan_s)

    @property
    def gap(self) -> float | None:
        """The objective's value / its bound - 1; None without a bound above 0."""
        return gap_of(self.value, self.bounds.of(self.objective))

    def to_json(self) -> dict[str, Any]:
        """Return the improvement as JSON data."""
        return {
            "time_s": self.time_s,
            "cost_J": self.cost_J,
            "makespan_s": self.makespan_s,
            "bound_J": self.bounds.energy_J,
            "gap": self.gap,
            "objective": {
                "name": self.objective.name,
                "unit": self.objective.unit,
                "value": self.value,
                "bound": self.bounds.of(self.objective),
            },
        }


def gap_of(value: float, bound: float | None) -> float | None:
    """Return value / bound - 1; None without a bound above 0."""
    return value / bound - 1.0 if bound else None


@dataclass
class Statistics:
    """Counts and times of one planning run.

    Attributes:
        time_s: by what it was spent on.
        counts: of what was done.
        improvements: plans, each better than all before it.
        bounds: what is known that no plan undercuts.
        started: when planning began, by `time.perf_counter()`.
    """

    time_s: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    improvements: list[Improvement] = field(default_factory=list)
    bounds: Bounds = UNKNOWN
    started: float = field(default_factory=time.perf_counter)

    def begin(self, spent_s: float = 0.0) -> None:
        """Have planning begin now, and not when this was made, or so long before."""
        self.started = time.perf_counter() - spent_s

    def elapsed(self) -> float:
        """Return the time since planning began [s]."""
        return time.perf_counter() - self.started

    def left_s(self, budget_s: float | None) -> float:
        """Return what is left of a budget [s], at least 0; inf of None."""
        return math.inf if budget_s is None else max(0.0, budget_s - self.elapsed())

    def add(self, counts: dict[str, int], routing_s: float) -> None:
        """Add the counts of one attempt, and the time its tours took."""
        for name, value in counts.items():
            self.counts[name] = self.counts.get(name, 0) + value
        self.time_s["routing"] = self.time_s.get("routing", 0.0) + routing_s

    @property
    def gap(self) -> float | None:
        """The gap of the best plan so far; None without one, or without a bound."""
        judged = self._judged()
        return judged[-1].gap if judged else None

    def _judged(self) -> list[Improvement]:
        """Return the improvements, each against what is known by now."""
        return [replace(found, bounds=self.bounds) for found in self.improvements]

    def as_dict(self) -> dict[str, object]:
        """Return counts, times and improvements; the total time is the time so far."""
        first = self.time_s.get("first_solution", 0.0)
        times = {"init": 0.0, "routing": 0.0, **self.time_s, "first_solution": first}
        names = (
            "path_following_plans",
            "coordinated",
            "vertices",
            "groups",
            "router_calls",
            "expansions",
        )
        counts = dict.fromkeys(names, 0)
        judged = self._judged()
        return {
            **counts,
            **self.counts,
            "improvements": [found.to_json() for found in judged],
            "bound_J": self.bounds.energy_J,
            "bound_s": self.bounds.makespan_s,
            "bound": self.bounds.of(judged[-1].objective) if judged else None,
            "gap": self.gap,
            "time_s": {**times, "total": self.elapsed()},
        }
