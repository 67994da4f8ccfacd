"""What one planning run counts, times and finds."""

from __future__ import annotations

import time
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class Improvement:
    """A plan that is cheaper than all before it.

    Attributes:
        time_s: since planning began.
        cost_J: the plan's energy.
        bound_J: energy that no plan undercuts; None while it is not known.
        gap: cost / bound - 1; None without a bound above 0.
    """

    time_s: float
    cost_J: float
    bound_J: float | None = None
    gap: float | None = None

    @staticmethod
    def of(time_s: float, cost_J: float, bound_J: float | None) -> Improvement:
        """Return the improvement, judged by a bound if there is one."""
        return Improvement(
            time_s=time_s, cost_J=cost_J, bound_J=bound_J, gap=gap_of(cost_J, bound_J)
        )

    def to_json(self) -> dict[str, float | None]:
        """Return the improvement as JSON data."""
        return {
            "time_s": self.time_s,
            "cost_J": self.cost_J,
            "bound_J": self.bound_J,
            "gap": self.gap,
        }


def gap_of(cost_J: float, bound_J: float | None) -> float | None:
    """Return cost / bound - 1; None without a bound above 0."""
    return cost_J / bound_J - 1.0 if bound_J else None


@dataclass
class Statistics:
    """Counts and times of one planning run."""

    time_s: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    improvements: list[Improvement] = field(default_factory=list)
    bound_J: float | None = None
    started: float = field(default_factory=time.perf_counter)

    def elapsed(self) -> float:
        """Return the time since planning began [s]."""
        return time.perf_counter() - self.started

    def add(self, counts: dict[str, int], routing_s: float) -> None:
        """Add the counts of one tree, and the time its tours took."""
        for name, value in counts.items():
            self.counts[name] = self.counts.get(name, 0) + value
        self.time_s["routing"] = self.time_s.get("routing", 0.0) + routing_s

    def as_dict(self) -> dict[str, object]:
        """Return counts, times and improvements; the total time is the time so far."""
        first = self.time_s.get("first_solution", 0.0)
        times = {"init": 0.0, "routing": 0.0, **self.time_s, "first_solution": first}
        counts = {"vertices": 0, "groups": 0, "router_calls": 0, "expansions": 0}
        judged = [
            Improvement.of(found.time_s, found.cost_J, self.bound_J)
            for found in self.improvements
        ]
        return {
            **counts,
            **self.counts,
            "improvements": [found.to_json() for found in judged],
            "bound_J": self.bound_J,
            "gap": judged[-1].gap if judged else None,
            "time_s": {**times, "total": self.elapsed()},
        }
