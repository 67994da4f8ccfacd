"""Robots that break down in shipped missions: on slopes, in mixed fleets, with homes.

Whatever becomes of the goals, nobody is touched, and the fleet ends at rest.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mrmg.energy.audit import audit
from mrmg.planning import PlannerParams, plan_mission
from mrmg.plans import Plan
from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene
from mrmg.supervision.driving import Drive, drive_mission

pytestmark = pytest.mark.slow


ONE_PLAN = PlannerParams(improvements=0)
"""What matters here is how the fleet goes on, not how good its plans are."""


def planned(scene: Scene) -> Plan:
    plan = plan_mission(scene, seed=0, params=ONE_PLAN).plan
    assert plan is not None
    return plan


def stopped_safely(drive: Drive, robot: str, time_s: float) -> None:
    """Check the stop of all, and that the robot does not move after it."""
    log = drive.log
    assert log.completed, log.gave_up
    assert log.contacts == ()
    first = log.events[0]
    assert (first.cause, first.robot, first.action) == ("fault", robot, "stop")
    assert first.time_s == pytest.approx(time_s, abs=0.03)
    rested = log.time_s >= log.events[1].time_s
    wreck = log.state[log.robots.index(robot), rested, :2]
    assert np.hypot(*np.ptp(wreck, axis=0)) < 0.05


@pytest.mark.parametrize("time_s", [20.0, pytest.param(35.0, marks=pytest.mark.ci)])
def test_on_slopes_the_other_finishes(time_s: float) -> None:
    scene = load_scene("hills")
    drive = drive_mission(
        scene, planned(scene), faults=[f"r1@{time_s}s"], planner=ONE_PLAN
    )
    stopped_safely(drive, "r1", time_s)
    account = audit(scene, drive.plan, drive.log)
    assert account.mission_ok, account.reasons
    # Braking downhill, with most of the weight on the front axle, takes longer: on
    # slopes of 17 %, half a metre.
    assert max(robot.tracking_max_m for robot in account.robots) < 0.7
    for robot in account.robots:
        assert robot.metered_J == pytest.approx(robot.planned_J, rel=0.03)


@pytest.mark.parametrize(
    ("robot", "time_s"),
    [
        ("r1", 15.0),
        ("r3", 10.0),
        pytest.param("r3", 15.0, marks=pytest.mark.ci),  # hard to go on from
        pytest.param("r1", 30.0, marks=pytest.mark.ci),  # goals are given up
    ],
)
def test_in_a_mixed_fleet_the_others_do_what_they_can(
    robot: str, time_s: float
) -> None:
    """Goals that only the broken robot fits to are given up, and that is said."""
    scene = load_scene("mixed")
    drive = drive_mission(
        scene, planned(scene), faults=[f"{robot}@{time_s}s"], planner=ONE_PLAN
    )
    stopped_safely(drive, robot, time_s)
    account = audit(scene, drive.plan, drive.log)
    missed = {goal.id for goal in scene.goals} - set(account.goals_visited)
    given_up = {name for replan in drive.replans for name in replan.given_up}
    assert missed == given_up
    assert account.mission_ok == (not missed)
    assert "battery empty" not in account.causes


def test_robots_with_a_finish_still_end_there(make_yard: Callable[..., Scene]) -> None:
    homes = [
        {"id": "r1", "model": "car", "pose": [5, 18, 0], "finish": "start"},
        {"id": "r2", "model": "car", "pose": [5, 5, 0], "finish": "start"},
    ]
    scene = make_yard(robots=homes, battery={"capacity_m": 200, "reserve": 0.05})
    drive = drive_mission(scene, planned(scene), faults=["r1@4s"], planner=ONE_PLAN)
    stopped_safely(drive, "r1", 4.0)
    account = audit(scene, drive.plan, drive.log)
    assert set(account.goals_visited) == {"g1", "g2", "g3"}
    home = scene.robots[1].finish
    assert home is not None
    end = drive.log.state[1, -1, :2]
    assert float(home.region.depth(end[None])[0]) >= -0.05
    away = drive.log.state[1, :, :2]
    assert home.region.depth(away).min() < -5.0
