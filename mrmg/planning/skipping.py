"""Planning without the goals that are proven out of reach (`--skip-unreachable`)."""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import replace
from functools import partial

import numpy as np

from mrmg.background import within
from mrmg.planning.diagnosis import Proofs
from mrmg.planning.feasibility import impossible_goals
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.statistics import Statistics
from mrmg.plans import PlanResult, PlanStatus
from mrmg.scene.types import Scene


def plan_reachable(
    scene: Scene, params: PlannerParams, plan: Callable[[Scene, float], PlanResult]
) -> PlanResult:
    """Return a plan of a mission without the goals that no robot can serve.

    A goal is left out only with a proof that no plan serves it, whatever becomes of the
    others: no robot gets there, by no battery, or not within the time limit. A budget
    is for all proofs and plannings together.

    Args:
        scene: the mission.
        params: with the budget, and the time step of plans.
        plan: plans a mission, of whose budget so many seconds are spent.
    """
    clock, halt = Statistics(), np.zeros(1, np.bool_)

    def proven(call: Callable[[], dict[str, str]]) -> dict[str, str]:
        found = within(call, clock.left_s(params.budget_s))
        halt[0] = found is None
        return found or {}

    skipped = proven(partial(impossible_goals, scene, halt))
    while True:
        left = _without(scene, set(skipped))
        result = plan(left, clock.elapsed())
        clock.begin(result.statistics["time_s"]["total"])
        if result.status is not PlanStatus.INFEASIBLE:
            break
        alone = proven(partial(_proven_alone, left, params.dt_s, halt))
        if not alone:
            break
        skipped |= alone
    if result.plan is None or not skipped:
        return result
    made = replace(
        result.plan,
        scene_name=scene.name,
        scene_digest=scene.digest,
        skipped={
            goal.id: skipped[goal.id] for goal in scene.goals if goal.id in skipped
        },
    )
    return replace(result, plan=made)


def _without(scene: Scene, goals: Set[str]) -> Scene:
    left = tuple(goal for goal in scene.goals if goal.id not in goals)
    return replace(scene, goals=left) if goals else scene


def _proven_alone(scene: Scene, step_s: float, halt: np.ndarray) -> dict[str, str]:
    """Return the goals that no plan serves even if they are the only ones."""
    bare = _without(scene, {goal.id for goal in scene.goals})
    if Proofs(bare, step_s, halt).reason(tours_missing=True):
        return {}  # it is not for the goals
    found = {}
    for goal in scene.goals:
        alone = replace(scene, goals=(goal,))
        proof = Proofs(alone, step_s, halt).reason(tours_missing=True)
        if proof:
            found[goal.id] = f"goal {goal.id} alone: {proof}"
    return found
