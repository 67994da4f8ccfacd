"""How long the controllers' calls took, and which of their branches gave the answer."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from mrmg.simulation.controller import Controller

BRANCHES = ("riccati", "qp")
"""Ways to an answer of the MPC: without bounds, or with those that are active."""


class ControllerCalls:
    """Calls of all controllers of a fleet.

    Attributes:
        bounded_solves: QP solves with active bounds, by robot.
    """

    def __init__(self, robots: int) -> None:
        """Start without calls."""
        self.bounded_solves = [0] * robots
        self._call_s: dict[str, list[float]] = {}

    def begin(self) -> None:
        """Start the time of the next call, which ends where that after it starts."""
        # Of this thread: what other processes do on its processor does not count.
        self._since_s = time.thread_time()

    def note(self, robot: int, controller: Controller) -> None:
        """Note how long the call of a robot's controller took, and by which branch."""
        now_s = time.thread_time()
        branch = getattr(controller, "branch", "")
        self._call_s.setdefault(branch, []).append(now_s - self._since_s)
        self.bounded_solves[robot] += branch == "qp"
        self._since_s = now_s

    def milliseconds(self) -> dict[str, Any]:
        """Return median and 99th percentile over all calls, and by branch.

        A branch that was not taken is None.
        """
        every = [value for values in self._call_s.values() for value in values]
        by_branch = {
            branch: _statistics(self._call_s[branch])
            if branch in self._call_s
            else None
            for branch in BRANCHES
        }
        whole = _statistics(every or [0.0])
        del whole["calls"]
        return {**whole, **by_branch}


def _statistics(seconds: list[float]) -> dict[str, float]:
    call_ms = 1e3 * np.array(seconds)
    return {
        "median": float(np.median(call_ms)),
        "p99": float(np.percentile(call_ms, 99)),
        "calls": len(seconds),
    }
