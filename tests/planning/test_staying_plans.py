"""Missions in which robots stay at goals and stations, planned and judged."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from mrmg.energy.metering import battery_profile
from mrmg.energy.visits import crowded_stations, first_stay
from mrmg.planning import PlannerParams, plan_mission
from mrmg.plans import Plan
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.types import Scene
from mrmg.verification.verify import verify

SCENES = Path(__file__).parents[1] / "scenes"
PLANS = {"path following": True, "tree": False}


def changed(scene: Scene, **changes: object) -> Scene:
    """Return a scene with other sections."""
    document = {**copy.deepcopy(scene.document), **changes}
    return scene_from_document(document, source=scene.name)


def planned(scene: Scene, seed: int = 0, follow_paths: bool = True) -> Plan:
    # Without a margin, so that robots recharge no more often than they must.
    params = PlannerParams(follow_paths=follow_paths, soc_margin=0.0)
    plan = plan_mission(scene, seed=seed, params=params).plan
    assert plan is not None
    assert verify(scene, plan).violations == ()
    return plan


def standing(plan: Plan, robot: str) -> np.ndarray:
    return np.abs(plan.trajectory(robot).state[:, 3]) < 1e-6


@pytest.mark.parametrize("seed", range(3))
def test_robots_stand_at_goals_for_their_dwell_times(seed: int) -> None:
    scene = load_scene(SCENES / "dwell.yaml")
    plan = planned(scene, seed)
    for goal in scene.goals:
        (visit,) = [item for item in plan.visits if item.target == goal.id]
        motion = plan.trajectory(visit.robot)
        stay = first_stay(goal, motion.time_s, motion.state, visit.step)
        assert stay is not None and stay.first == visit.step
        if goal.dwell_s > 0.0:
            inside = goal.region.depth(motion.state[:, :2]) >= 0.0
            stood_s = plan.dt_s * (inside & standing(plan, visit.robot)).sum()
            # It brakes and sets off inside, but stands for most of the time.
            assert stood_s > 0.5 * goal.dwell_s


def test_no_dwell_time_is_a_dwell_time_of_zero() -> None:
    scene = load_scene(SCENES / "dwell.yaml")
    goals = [dict(goal) for goal in scene.document["goals"]]
    without = [{k: v for k, v in goal.items() if k != "dwell"} for goal in goals]
    zero = [{**goal, "dwell": 0} for goal in goals]
    plans = [planned(changed(scene, goals=some)) for some in (without, zero)]
    for one, other in zip(*(plan.trajectories for plan in plans), strict=True):
        assert np.array_equal(one.state, other.state)
    assert plans[0].tours == plans[1].tours


def test_dwelling_takes_its_time() -> None:
    scene = load_scene(SCENES / "one_goal.yaml")
    goal = scene.document["goals"][0]
    at_once = planned(scene)
    for dwell_s in (3.0, 30.0):
        plan = planned(changed(scene, goals=[{**goal, "dwell": dwell_s}]))
        assert plan.makespan_s >= dwell_s + 0.8 * at_once.makespan_s
        assert plan.makespan_s <= dwell_s + at_once.makespan_s + 6.0


@pytest.mark.parametrize("follow_paths", PLANS.values(), ids=PLANS)
def test_a_battery_is_filled_before_a_robot_goes_on(follow_paths: bool) -> None:
    scene = load_scene(SCENES / "charging.yaml")
    plan = planned(scene, follow_paths=follow_paths)
    battery = scene.robots[0].battery
    assert "s1" in plan.tours["r1"]
    visit = next(visit for visit in plan.visits if visit.target == "s1")
    content_J = battery_profile(scene, plan.trajectories[0], plan.visits)
    assert content_J.max() == pytest.approx(battery.capacity_J)
    lacking_J = battery.capacity_J - visit.energy_J
    full_s = plan.dt_s * float(content_J[visit.step :].argmax())
    assert full_s == pytest.approx(lacking_J / battery.charging_power_W, abs=3.0)


def test_a_huge_charging_power_costs_no_more_than_a_moment() -> None:
    scene = load_scene(SCENES / "charging.yaml")
    battery = scene.document["battery"]
    at_once = {key: battery[key] for key in ("capacity_m", "reserve")}
    quick = planned(changed(scene, battery={**battery, "charging_power": 1e9}))
    instant = planned(changed(scene, battery=at_once))
    assert quick.tours == instant.tours
    # It has to stop, though.
    assert quick.makespan_s <= instant.makespan_s + 8.0
    slow = planned(scene)
    assert slow.makespan_s > quick.makespan_s + 20.0


@pytest.fixture
def one_charger() -> Iterator[Scene]:
    yield load_scene(SCENES / "one_charger.yaml")


@pytest.mark.parametrize("seed", range(2))
def test_a_station_for_one_is_used_in_turn(one_charger: Scene, seed: int) -> None:
    plan = planned(one_charger, seed)
    assert all("s1" in tour for tour in plan.tours.values())
    ways = {item.robot: item.state[:, :2] for item in plan.trajectories}
    assert not list(crowded_stations(one_charger, ways))
    first, second = (v for v in plan.visits if v.target == "s1")
    missing_J = one_charger.robot(first.robot).battery.capacity_J - first.energy_J
    assert second.time_s > first.time_s + missing_J / 60.0
