"""What may watch a simulation and give the fleet new orders while it drives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mrmg.plans import Plan


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happened on the way and was acted on.

    Attributes:
        time_s: simulated time.
        cause: "fault", "energy", "tracking" or "rest", when the fleet had stopped.
        robot: id of the robot that caused it; "" for the fleet.
        action: "stop"; "replan", go on by a new plan; "give_up" some goals; "finish"
            with all goals visited; "end" without.
        message: one sentence for people.
    """

    time_s: float
    cause: str
    robot: str
    action: str
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """The simulation after a tick; arrays are in the scene's order of robots.

    Attributes:
        time_s: simulated time.
        clock_s: plan time the fleet's clock has reached.
        rate: plan seconds per simulated second.
        stalled_s: how long the fleet has hardly got on with its plan.
        state: seen (x, y, theta, v, psi), shape (R, 5).
        planned: the plan at `clock_s`, shape (R, 5).
        work_J: returns the work of the drives in every tick so far, driving and
            braking, shape (n, R, 2).
        ended: whether the fleet is at rest after the end of its plan.
    """

    time_s: float
    clock_s: float
    rate: float
    stalled_s: float
    state: np.ndarray
    planned: np.ndarray
    work_J: Callable[[], np.ndarray]
    ended: bool

    @property
    def off_m(self) -> np.ndarray:
        """Distance of each robot from where the plan has it, shape (R,)."""
        return np.asarray(np.hypot(*(self.state - self.planned)[:, :2].T))


@dataclass(frozen=True, slots=True, kw_only=True)
class Orders:
    """A plan that takes the place of the one in force.

    Attributes:
        plan: of the same scene's robots; up to `clock_s` it is the plan in force.
        clock_s: plan time to go on from; not before the present one.
    """

    plan: Plan
    clock_s: float


class Supervisor(Protocol):
    """Watches a run; one object per run."""

    @property
    def events(self) -> tuple[Event, ...]:
        """What has happened so far, in order of time."""

    def watch(self, now: Observation) -> Orders | None:
        """Look at the run after a tick; return new orders, or None to go on.

        Where `now.ended` the run is over unless there are new orders.
        """
