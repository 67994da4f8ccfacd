"""One trial of mrmg or of a peer: a problem is solved, and the answer judged."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import peer_ompl
from peer_baseline import StuckError, plain_plan
from peer_legs import Leg
from protocol import Row

import mrmg
from mrmg.planning import (
    Routing,
    RoutingProblem,
    faults_of_tours,
    plan_mission,
    profile_params,
)
from mrmg.plans import Plan
from mrmg.scene.types import Scene


def planned(scene: Scene, seed: int, router: Any = None, **profile: Any) -> Row:
    """Return the row of mrmg's first plan, or of what a profile or router gives."""
    params = replace(profile_params(**profile), improvements=0)
    own = {} if router is None else {"router": router}
    began = time.perf_counter()
    result = plan_mission(scene, seed=seed, params=params, **own)
    took_s = time.perf_counter() - began
    return judged(scene, result.plan, took_s, result.reason)


def judged(scene: Scene, plan: Plan | None, took_s: float, why: str) -> Row:
    """Return the row of a plan, judged by the verifier."""
    if plan is None:
        return {"ok": False, "time_s": took_s, "cost": None, "why": [why]}
    verdict = mrmg.verify(scene, plan)
    causes = sorted({violation.kind.value for violation in verdict.violations})
    return {"ok": verdict.ok, "time_s": took_s, "cost": plan.cost_J, "why": causes}


def ompl_row(leg: Leg, planner: str, seed: int, limit_s: float) -> Row:
    """Return the row of one of OMPL's planners."""
    controls, took_s = peer_ompl.solve(leg, planner, seed, limit_s)
    plan = None if controls is None else leg.plan(controls)
    return judged(leg.scene, plan, took_s, "time over")


def plain_row(scene: Scene) -> Row:
    """Return the row of the plain baseline."""
    began = time.perf_counter()
    try:
        plan, why = plain_plan(scene), ""
    except StuckError as error:
        plan, why = None, str(error)
    return judged(scene, plan, time.perf_counter() - began, why)


def tour_row(problem: RoutingProblem, solve: Callable[[], Routing]) -> Row:
    """Return the row of tours, judged by mrmg's rules of tours."""
    began = time.perf_counter()
    routing = solve()
    took_s = time.perf_counter() - began
    if not routing.feasible:
        return {"ok": False, "time_s": took_s, "cost": None, "why": ["no tours"]}
    faults = list(faults_of_tours(problem, routing))
    return {
        "ok": not faults, "time_s": took_s, "cost": routing.cost_J, "why": faults[:1]
    }  # fmt: skip
