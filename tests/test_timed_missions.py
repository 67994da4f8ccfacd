"""Missions in which time counts: planned, verified, driven, audited."""

from __future__ import annotations

import statistics
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from mrmg.energy.audit import audit
from mrmg.energy.mission_failures import over_s
from mrmg.planning import PlannerParams, plan_mission
from mrmg.plans import Plan, PlanResult, PlanStatus
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.types import Scene
from mrmg.simulation.simulation import simulate
from mrmg.verification.verify import verify

ONE_SIDED = Path(__file__).parent / "scenes" / "one_sided.yaml"
QUICK = PlannerParams(samples=400)
LONGEST_S = 26.0
"""A time limit that the plan of least energy does not keep."""


def one_sided(**changes: Any) -> Scene:
    document = load_scene(ONE_SIDED).document
    return scene_from_document({**document, **changes}, source="one_sided")


@cache
def planned(seed: int, **changes: Any) -> PlanResult:
    return plan_mission(one_sided(**changes), seed=seed, params=QUICK, with_bound=True)


def plan_of(seed: int, **changes: Any) -> Plan:
    plan = planned(seed, **changes).plan
    assert plan is not None
    return plan


def test_the_soonest_plan_shares_the_work_and_the_cheapest_does_not() -> None:
    cheap, soon = plan_of(0), plan_of(0, objective="makespan")
    assert [len(tour) for tour in cheap.tours.values()] == [4, 0]
    assert [len(tour) for tour in soon.tours.values()] == [2, 2]
    assert verify(one_sided(objective="makespan"), soon).ok
    assert soon.makespan_s < 0.8 * cheap.makespan_s
    assert soon.cost_J > cheap.cost_J


@pytest.mark.parametrize(
    "source", [ONE_SIDED, "quickstart"], ids=["one_sided", "shipped"]
)
def test_by_makespan_plans_are_sooner_in_the_median(source: Path | str) -> None:
    document = load_scene(source).document
    medians_s = []
    for wish in ({}, {"objective": "makespan"}):
        scene = scene_from_document({**document, **wish}, source=str(source))
        plans = [plan_mission(scene, seed=seed, params=QUICK).plan for seed in range(3)]
        medians_s.append(statistics.median(plan.makespan_s for plan in plans if plan))
        assert all(plans)
    assert medians_s[1] <= medians_s[0]


def test_a_blend_without_weight_on_time_is_energy() -> None:
    blend = one_sided(objective={"energy": 3.0, "makespan": 0.0})
    plan = plan_mission(blend, seed=0, params=QUICK).plan
    assert plan is not None
    for one, other in zip(plan.trajectories, plan_of(0).trajectories, strict=True):
        assert (one.state == other.state).all()


def test_a_blend_lies_between_both() -> None:
    scene = one_sided(objective={"energy": 1, "makespan": 150})
    plan = plan_mission(scene, seed=0, params=QUICK).plan
    assert plan is not None
    assert verify(scene, plan).ok
    values = [
        scene.objective.value(each.cost_J, each.makespan_s)
        for each in (plan, plan_of(0), plan_of(0, objective="makespan"))
    ]
    assert values[0] <= 1.01 * min(values)


def test_bounds_hold_and_are_told_where_they_are_valid() -> None:
    energy, makespan = (
        planned(0).statistics,
        planned(0, objective="makespan").statistics,
    )
    assert energy["bound_s"] is None
    assert makespan["bound_J"] is None
    plan = plan_of(0, objective="makespan")
    assert 0.0 < makespan["bound_s"] <= plan.makespan_s
    gap = plan.makespan_s / makespan["bound_s"] - 1.0
    assert makespan["gap"] == pytest.approx(gap)
    values = [found["objective"]["value"] for found in makespan["improvements"]]
    assert values == sorted(values, reverse=True)


def test_a_time_limit_is_kept_by_dearer_plans() -> None:
    cheap, timely = plan_of(0), plan_of(0, time_limit=LONGEST_S)
    assert cheap.makespan_s > LONGEST_S >= timely.makespan_s
    assert timely.cost_J > cheap.cost_J
    assert verify(one_sided(time_limit=LONGEST_S), timely).ok


def test_attempts_that_were_late_are_followed_by_hastier_tours() -> None:
    """The roadmap does not see how long turns on the spot take."""
    document = load_scene("diffdrive").document
    free = scene_from_document(document, source="diffdrive")
    cheap = plan_mission(free, seed=0, params=QUICK).plan
    assert cheap is not None
    limit_s = round(0.93 * cheap.makespan_s, 1)
    scene = scene_from_document({**document, "time_limit": limit_s}, source="limited")
    plan = plan_mission(scene, seed=0, params=QUICK).plan
    assert plan is not None
    assert verify(scene, plan).ok
    assert plan.makespan_s <= limit_s


def test_a_limit_below_the_bound_is_proven_impossible() -> None:
    bound_s = planned(0, objective="makespan").statistics["bound_s"]
    result = planned(0, time_limit=bound_s - 0.1)
    assert result.status is PlanStatus.INFEASIBLE
    assert "too short: even at top speed" in result.reason
    assert f"before {bound_s:.1f} s" in result.reason


def test_a_limit_that_nothing_found_keeps_is_no_proof() -> None:
    bound_s = planned(0, objective="makespan").statistics["bound_s"]
    result = planned(0, time_limit=bound_s + 0.5)
    assert result.status is PlanStatus.NO_PLAN_FOUND
    assert "time limit" in result.reason


@pytest.mark.slow
@pytest.mark.parametrize(
    "wish", [{"objective": "makespan"}, {"time_limit": LONGEST_S}], ids=str
)
def test_timed_missions_are_driven_as_planned(wish: dict[str, Any]) -> None:
    scene, plan = one_sided(**wish), plan_of(0, **wish)
    log = simulate(scene, plan)
    assert audit(scene, plan, log).reasons == ()
    assert over_s(scene, log) == pytest.approx(plan.makespan_s, abs=1.0)
