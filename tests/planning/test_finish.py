"""Finishes: where robots must be at rest at the end, in plan and verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import pi, remainder, tau
from typing import Any

import numpy as np
import pytest
from solved import verified_plan

import mrmg
from mrmg.planning import PlannerParams, plan_mission
from mrmg.scene.types import Scene

MakeScene = Callable[..., Scene]
QUICK = PlannerParams(improvements=0, samples=500)


def robot(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"id": name, "model": "car", "pose": [x, y, 0.0], **more}


def disc(x: float, y: float, radius: float, **more: Any) -> dict[str, Any]:
    return {"circle": {"center": [x, y], "radius": radius}, **more}


def planned(scene: Scene, seed: int = 0) -> Any:
    return verified_plan(scene, seed, QUICK)


@pytest.mark.parametrize("seed", range(3))
def test_robots_return_to_where_they_started(yard: MakeScene, seed: int) -> None:
    robots = [
        robot("r1", 4, 5, finish="start"),
        robot("r2", 4, 15, finish="start"),
    ]
    plan = planned(yard(robots=robots), seed)
    for one, trajectory in zip(robots, plan.trajectories, strict=True):
        last = trajectory.state[-1]
        assert np.hypot(*(last[:2] - one["pose"][:2])) <= 1.0
        assert last[3] == pytest.approx(0.0, abs=1e-9)


def test_cars_change_places_without_any_goal(yard: MakeScene) -> None:
    robots = [
        robot("r1", 4, 10, finish=disc(26, 10, 1)),
        {**robot("r2", 26, 10, finish=disc(4, 10, 1)), "pose": [26, 10, pi]},
    ]
    plan = planned(yard(goals=[], robots=robots))
    assert plan.visits == ()
    ends = [trajectory.state[-1, 0] for trajectory in plan.trajectories]
    assert ends == pytest.approx([26, 4], abs=1.0)


def test_a_robot_that_turns_on_the_spot_ends_with_its_heading(yard: MakeScene) -> None:
    wanted = disc(20, 14, 0.6, heading=2.5, heading_tolerance=0.1)
    drive = {**robot("r1", 4, 10, finish=wanted), "model": "diffdrive"}
    plan = planned(yard(robots=[drive]))
    yaw = plan.trajectories[0].state[-1, 2]
    assert abs(remainder(yaw - 2.5, tau)) <= 0.1


def test_a_plan_that_ends_elsewhere_is_refused(yard: MakeScene) -> None:
    scene = yard(robots=[robot("r1", 4, 10, finish="start")])
    plan = planned(scene)
    moved = yard(robots=[robot("r1", 4, 10, finish=disc(25, 17, 1))])
    verdict = mrmg.verify(moved, replace(plan, scene_digest=moved.digest))
    assert [violation.kind.value for violation in verdict.violations] == ["finish"]


def test_cars_end_with_their_headings(yard: MakeScene) -> None:
    ways = [(pi, 20.0, 14.0), (-0.5 * pi, 12.0, 6.0)]
    robots = [
        robot(f"r{i}", 4, 5 + 9 * i, finish=disc(x, y, 0.6, heading=yaw))
        for i, (yaw, x, y) in enumerate(ways)
    ]
    plan = planned(yard(robots=robots))
    for trajectory, (yaw, _, _) in zip(plan.trajectories, ways, strict=True):
        assert abs(remainder(trajectory.state[-1, 2] - yaw, tau)) <= 0.2


def test_a_battery_must_last_to_the_finish(yard: MakeScene) -> None:
    """The way there and back is longer than the battery lasts; one way is not."""
    battery = {"capacity_m": 30, "reserve": 0.0}
    goals = [{"id": "g1", **disc(24, 10, 1)}]
    there = yard(goals=goals, robots=[robot("r1", 4, 10, battery=battery)])
    assert planned(there)
    back = yard(
        goals=goals, robots=[robot("r1", 4, 10, battery=battery, finish="start")]
    )
    result = plan_mission(back, params=replace(QUICK, trees=2))
    assert result.plan is None
