"""What the planner refuses to call a plan, each rule by the least that breaks it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from mrmg.planning.assembly import make_plan
from mrmg.planning.parameters import PlannerParams
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.verification.verify import verify

TWO_ROBOTS = [
    {"id": "r1", "model": "car", "pose": [5, 10, 0]},
    {"id": "r2", "model": "car", "pose": [5, 14, 0]},
]


def assembled(scene: Scene, plan: Plan, soc_margin: float = 0.0) -> Plan | str:
    """The plan of a plan's trajectories and tours, or why there is none."""
    problem: Any = SimpleNamespace(scene=scene, soc_margin=soc_margin)
    params, ways = PlannerParams(), plan.trajectories
    made, refusal = make_plan(problem, 3, params, ways, plan.tours)
    return made or refusal.why


def test_trajectories_that_keep_every_rule_are_a_plan(case: Any) -> None:
    scene, plan = case(robots=TWO_ROBOTS)
    made = assembled(scene, plan)
    assert isinstance(made, Plan)
    assert verify(scene, made).ok
    assert made.visits == plan.visits
    assert made.cost_J == pytest.approx(plan.cost_J)


def test_a_target_of_a_tour_that_is_not_entered_is_refused(case: Any) -> None:
    aside = {"id": "s", "circle": {"center": [15, 15], "radius": 1}}
    scene, plan = case(stations=[aside], tour=("g", "s"))
    assert assembled(scene, plan) == "r1 misses s"


@pytest.mark.parametrize(("soc_margin", "kept"), [(0.0, True), (0.1, False)])
def test_batteries_keep_reserve_and_margin(
    soc_margin: float, kept: bool, case: Any
) -> None:
    scene, plan = case()
    battery = scene.robots[0].battery
    start_J = battery.reserve_J + plan.cost_J + 0.05 * battery.capacity_J
    robot = replace(scene.robots[0], battery=replace(battery, start_J=start_J))
    made = assembled(replace(scene, robots=(robot,)), plan, soc_margin)
    assert isinstance(made, Plan) == kept
    if isinstance(made, str):
        short_J = soc_margin * battery.capacity_J - 0.05 * battery.capacity_J
        assert f"{short_J:.0f} J" in made


def test_a_station_for_one_robot_holds_one(case: Any) -> None:
    station = {"id": "s", "circle": {"center": [5, 12], "radius": 3}}
    scene, plan = case(robots=TWO_ROBOTS, stations=[station])
    assert isinstance(assembled(scene, plan), Plan)
    lone = replace(scene.stations[0], one_at_a_time=True)
    refused = assembled(replace(scene, stations=(lone,)), plan)
    assert refused == "two robots are at a station for one at a time"


def test_every_goal_is_visited(case: Any) -> None:
    scene, plan = case()
    assert assembled(scene, replace(plan, tours={"r1": ()})) == "nobody visits g"
