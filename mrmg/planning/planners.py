"""Planners: what finds the motions of a mission."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Protocol

import numpy as np

from mrmg import extensions
from mrmg.planning.attempt import Attempt, Request
from mrmg.planning.path_following.strategy import path_following
from mrmg.planning.problem.problem import Problem
from mrmg.plans import Plan


class Planner(Protocol):
    """Finds plans; `mrmg.testing.PlannerContract` tests what it must keep.

    An attempt is a function of its arguments alone, changes none of them, and ends soon
    after `request.halt` has turned true. Several may be made at once, by threads. Every
    plan is one that `mrmg.verify` accepts.
    """

    def __call__(self, problem: Problem, request: Request) -> Attempt:
        """Return what one attempt at a mission gave."""


def _guided_tree(problem: Problem, request: Request) -> Attempt:
    from mrmg.planning.guided_tree.strategy import guided_tree  # the default needs none

    return guided_tree(problem, request)


PLANNERS: Mapping[str, Planner] = MappingProxyType(
    {"path_following": path_following, "guided_tree": _guided_tree}
)
"""The planners of this package by name."""


def find_planner(name: str, own: Planner | None = None) -> Planner:
    """Return the planner of a name.

    Args:
        name: of the planner.
        own: a caller's own that has this name.

    Raises:
        UsageError: if there is none of that name.
        MachineError: if the package that adds it is broken.
    """
    if own is None and name in PLANNERS:
        return PLANNERS[name]
    return checked(own or extensions.load(extensions.PLANNERS, name), name)


def checked(planner: Planner, name: str) -> Planner:
    """Return a planner whose attempts are refused if they are none."""

    def attempt(problem: Problem, request: Request) -> Attempt:
        found = planner(problem, request)
        what = _fault(found)
        if what:
            raise extensions.fault(extensions.PLANNERS, name, f"returned {what}")
        return found

    return attempt


def _fault(found: object) -> str:
    """Return what was returned that is no attempt; "" where it is one."""
    if not isinstance(found, Attempt) or not isinstance(found.plans, Sequence):
        return f"{found!r}, not an Attempt"
    for plan in found.plans:
        if not isinstance(plan, Plan):
            return f"an Attempt with {plan!r} among its plans"
        if not all(np.isfinite(each.state).all() for each in plan.trajectories):
            return "a plan with states that are not finite"
    return ""
