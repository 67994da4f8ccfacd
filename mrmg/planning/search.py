"""Anytime search: attempts on several threads until there are enough, or time is over.

Attempts are numbered, and each is a function of its number alone. Without a time limit
they count in the order of their numbers, whichever thread is first, so that the outcome
does not depend on the number of workers. With a time limit they count as they come.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
from itertools import repeat

import numpy as np

from mrmg import interruption
from mrmg.background import finished, in_background
from mrmg.counted import counted
from mrmg.planning.assembly import Refusal
from mrmg.planning.attempt import Attempt, GivenUp, least_refusal
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.preference import Preference
from mrmg.planning.statistics import Improvement, Statistics
from mrmg.plans import Plan

Progress = Callable[[float, str], None]
"""Receives the fraction done, in [0, 1], and a short text."""

OnImprovement = Callable[[Improvement], None]
"""Receives each plan that is better than all before it, as soon as it counts."""

GRACE_S = 0.3
"""How long after a time limit attempts that were halted may still hand in plans [s]."""

HOPELESS = 10
"""With a time limit, times the number of trees after which finding none ends it."""


@dataclass
class Search:
    """The search for a good plan.

    Attributes:
        attempt: makes attempt number n; ends soon after `halt[0]` has turned true.
        params: set when to stop.
        statistics: receives counts, times and improvements.
        workers: threads.
        on_progress, on_improvement: called with progress.
        proof: returns why the mission has no solution, None if that is not known; takes
            whether no tours were found, and whether attempts would go on. Called once
            an attempt has failed.
        preference: what plans are compared by.
        best: the best plan so far that is in time; one that keeps the margins wanted is
            better than any that does not.
        given_up: margins that it gave up; all while there is none.
        earliest_s: when the earliest of all plans is over.
        begun: number of attempts that were begun.
        attempts: number of those that have counted.
        further: how many of these came after the first plan; -1 while there is none.
        tours_found: whether the router found tours in any of them.
        blocked: what stood in the way of the last motions along tours; "" if nothing
            did.
        refused: why motions along tours are no plan, of those nearest to one.
        interrupted: whether an interrupt ended the search.
    """

    attempt: Callable[[int, np.ndarray], Attempt]
    params: PlannerParams
    statistics: Statistics
    workers: int
    on_progress: Progress
    on_improvement: OnImprovement
    proof: Callable[[bool, bool], str | None]
    preference: Preference = field(default_factory=Preference)
    best: Plan | None = None
    given_up: GivenUp = GivenUp.CHARGE | GivenUp.DISTANCES
    earliest_s: float = math.inf
    begun: int = 0
    attempts: int = 0
    further: int = -1
    tours_found: bool = False
    blocked: str = ""
    refused: Refusal | None = None
    interrupted: bool = False
    halt: np.ndarray = field(default_factory=lambda: np.zeros(1, np.bool_))

    @property
    def tours_missing(self) -> bool:
        """Whether attempts have been made, and none found tours."""
        return self.attempts > 0 and not self.tours_found

    def run(self) -> Plan | None:
        """Return the best plan found.

        An interrupt during a time limit ends the search as if the limit were reached,
        provided there is a plan to keep.
        """
        found, counted_at = 0, -math.inf
        if self._enough():
            return None
        try:
            for attempt in self._attempts():
                self.attempts += 1
                self.tours_found |= attempt.tours_found
                self.blocked = attempt.blocked or self.blocked
                self.refused = least_refusal(attempt.refused, self.refused)
                self.statistics.add(dict(attempt.counts), attempt.routing_s)
                now = time.perf_counter()
                times = [max(at, counted_at) for at in attempt.found_at] or repeat(now)
                counted_at = now
                plans = zip(times, attempt.plans, strict=False)
                found += any([self._take(*each, attempt.given_up) for each in plans])
                self.further += found > 0
                self.on_progress(self._fraction(), counted(found, "plan"))
                if self._enough():
                    break
                if (
                    self.attempts == 1
                    and not found
                    and self.proof(self.tours_missing, True)
                ):
                    break
        except KeyboardInterrupt:
            if self.best is None or self.params.budget_s is None:
                raise
            self.interrupted = True
            interruption.accept()
        finally:
            self.halt[0] = True
        return self.best

    def _attempts(self) -> Iterator[Attempt]:
        """Yield attempts, keeping every worker busy with one.

        Attempts that do not end soon after a time limit are left behind.
        """
        free = self.params.budget_s is not None
        pending: list[Future[Attempt]] = []
        while True:
            while len(pending) < min(self.workers, self._left()):
                attempt = partial(self.attempt, self.begun, self.halt)
                pending.append(in_background(attempt))
                self.begun += 1
            done = self._done_in_time(pending) if free else set()
            if free and not done:
                return
            ready = next((one for one in pending if one in done), pending[0])
            pending.remove(ready)
            yield ready.result()

    def _done_in_time(self, pending: list[Future[Attempt]]) -> set[Future[Attempt]]:
        """Return attempts that are done once one is; halt all at the time limit."""
        done = finished(pending, self.statistics.left_s(self.params.budget_s))
        if not done:
            self.halt[0] = True
            done = finished(pending, GRACE_S)
        return done

    def _take(self, found_at: float, plan: Plan, given_up: GivenUp) -> bool:
        """Keep a plan if it is the best so far; return whether it is in time."""
        time_s, rank = found_at - self.statistics.started, self.preference.rank
        self.earliest_s = min(self.earliest_s, plan.makespan_s)
        if self.preference.late_s(plan):
            return False
        if self.best is None:
            self.statistics.time_s["first_solution"] = time_s
        elif (given_up, rank(plan)) >= (self.given_up, rank(self.best)):
            return True
        self.best, self.given_up = plan, given_up
        improvement = Improvement(
            time_s=time_s,
            cost_J=plan.cost_J,
            makespan_s=plan.makespan_s,
            objective=self.preference.objective,
            bounds=self.statistics.bounds,
        )
        self.statistics.improvements.append(improvement)
        self.on_improvement(improvement)
        return True

    def _left(self) -> float:
        """Return how many attempts will still count, as far as that is known."""
        params = self.params
        if params.budget_s is not None:
            return math.inf
        left = params.improvements - self.further if self.further >= 0 else math.inf
        return min(left, params.trees - self.attempts)

    def _enough(self) -> bool:
        params, number = self.params, self.attempts
        if params.budget_s is not None:
            hopeless = self.further < 0 and number >= HOPELESS * params.trees
            return self.statistics.elapsed() > params.budget_s or hopeless
        return self._left() <= 0

    def _fraction(self) -> float:
        params, number = self.params, self.attempts
        if params.budget_s is not None:
            done = self.statistics.elapsed() / params.budget_s
        else:
            done = max(
                number / params.trees, (1 + self.further) / (1 + params.improvements)
            )
        return 0.1 + 0.9 * min(done, 1.0)
