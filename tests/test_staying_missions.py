"""Missions with stays from end to end: planned, verified, driven in MuJoCo, audited."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from mrmg.energy.audit import audit
from mrmg.planning import plan_mission
from mrmg.scene.loading import load_scene
from mrmg.simulation.simulation import simulate
from mrmg.verification.verify import verify

SCENES = Path(__file__).parent / "scenes"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dwell", "charging", "one_charger"])
def test_stays_are_driven_as_planned(name: str) -> None:
    scene = load_scene(SCENES / f"{name}.yaml")
    plan = plan_mission(scene, seed=0).plan
    assert plan is not None
    assert verify(scene, plan).ok
    log = simulate(scene, plan)
    account = audit(scene, plan, log)
    assert account.reasons == ()
    assert [visit.target for visit in account.visits] == [
        visit.target for visit in plan.visits
    ]
    for driven, planned in zip(account.visits, plan.visits, strict=True):
        capacity_J = scene.robot(planned.robot).battery.capacity_J
        assert driven.energy_J == pytest.approx(planned.energy_J, abs=0.01 * capacity_J)


@pytest.mark.slow
def test_the_audit_names_what_the_simulation_owes() -> None:
    """The same motion fails a mission that asks for longer stays, or for turns."""
    scene = load_scene(SCENES / "dwell.yaml")
    plan = plan_mission(scene, seed=0).plan
    assert plan is not None
    log = simulate(scene, plan)
    first = next(goal for goal in scene.goals if goal.dwell_s > 0.0)
    longer = replace(first, dwell_s=first.dwell_s + 10.0)
    goals = tuple(longer if goal is first else goal for goal in scene.goals)
    scene = replace(scene, goals=goals)
    plan = replace(plan, scene_digest=scene.digest)
    log = replace(log, scene_digest=scene.digest, plan_digest=plan.digest)
    account = audit(scene, plan, log)
    assert account.causes == ("goal missed",)
    assert first.id not in account.goals_visited
