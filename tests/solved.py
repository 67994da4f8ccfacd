"""Plans that the planner finds, and the verifier has nothing against."""

from __future__ import annotations

import mrmg
from mrmg.planning import PlannerParams, plan_mission
from mrmg.plans import Plan, PlanStatus
from mrmg.scene.types import Scene


def verified_plan(scene: Scene, seed: int, params: PlannerParams) -> Plan:
    result = plan_mission(scene, seed=seed, params=params)
    assert result.status is PlanStatus.SOLVED, result.reason
    assert result.plan is not None
    verdict = mrmg.verify(scene, result.plan)
    assert verdict.ok, verdict.violations
    return result.plan
