"""Stays that a stop of the fleet falls into are brought to their end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrmg.energy.audit import audit
from mrmg.energy.visits import runs
from mrmg.planning import plan_mission
from mrmg.plans import Visit
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.types import Scene
from mrmg.supervision.driving import drive_mission
from mrmg.supervision.history import History
from mrmg.supervision.remaining import FleetCondition, remaining_scene
from mrmg.supervision.stays import OngoingStay, keeps_stays, stays_under_way

DWELL = Path(__file__).parents[1] / "scenes" / "dwell.yaml"


@pytest.fixture
def scene() -> Scene:
    """g1 of 6 s lies at (12, 5)."""
    return load_scene(DWELL)


def way(*places: tuple[float, float]) -> np.ndarray:
    return np.array(places)


def test_a_stay_counts_from_when_it_was_last_begun(scene: Scene) -> None:
    time_s = np.array([0.0, 1.0, 2.0, 3.5, 4.0])
    there, away = (12.0, 5.0), (4.0, 5.0)
    ways = {
        "r1": way(there, away, there, there, there),
        "r2": way(away, away, away, there, away),
    }
    stays = stays_under_way(scene.goals, time_s, ways)
    assert stays == {"g1": OngoingStay("r1", 2.0)}


def test_the_longest_stay_under_way_counts(scene: Scene) -> None:
    time_s, there = np.array([0.0, 1.0, 2.0]), (12.0, 5.0)
    ways = {"r1": way((4, 5), there, there), "r2": way(there, there, there)}
    assert stays_under_way(scene.goals, time_s, ways)["g1"].robot == "r2"
    late = {"r1": way((4, 5), (4, 5), there)}
    assert stays_under_way(scene.goals, time_s, late) == {}


@pytest.mark.parametrize("radius_m", [0.04, 1.0])
def test_goals_may_be_small(radius_m: float, scene: Scene) -> None:
    """The first robot starts in the middle of its goal."""
    (x, y, _), _ = (robot.pose for robot in scene.robots)
    goal = {"id": "g", "circle": {"center": [x, y], "radius": radius_m}}
    scene = scene.with_(goals=[goal])
    assert History(scene).visited() == {"g"}
    edge_m = {"r1": way((x + 0.99 * radius_m, y), (x + 0.99 * radius_m, y))}
    assert stays_under_way(scene.goals, np.array([0.0, 1.0]), edge_m) == {}


def test_the_rest_of_the_stay_is_left(scene: Scene) -> None:
    condition = FleetCondition(
        pose={robot.id: robot.pose for robot in scene.robots},
        energy_J={robot.id: robot.battery.start_J for robot in scene.robots},
        rolling_factor=dict.fromkeys(("r1", "r2"), 1.0),
        stays={"g1": OngoingStay("r1", 3.5), "g3": OngoingStay("r2", 1.0)},
    )
    dwell_s = [goal.dwell_s for goal in remaining_scene(scene, condition).goals]
    assert dwell_s == [2.5, 4.0, 0.0, 5.0]


def test_only_who_is_there_from_the_start_keeps_a_stay() -> None:
    visit = Visit(
        robot="r1", target="g1", kind="goal", step=0, time_s=0.0, energy_J=1.0
    )
    stays = {"g1": OngoingStay("r1", 2.0)}

    assert keeps_stays([visit], stays)
    assert not keeps_stays([replace(visit, robot="r2")], stays)
    assert not keeps_stays([replace(visit, step=30)], stays)
    assert not keeps_stays([replace(visit, target="g2")], stays)


@pytest.mark.slow
def test_a_fleet_stopped_in_the_middle_of_a_stay_brings_it_to_its_end(
    scene: Scene,
) -> None:
    """Whoever stays is not made to begin anew because another broke down."""
    longer = [{**goal, "dwell": 20} for goal in scene.document["goals"]]
    scene = scene_from_document({**scene.document, "goals": longer}, source="longer")
    plan = plan_mission(scene, seed=0).plan
    assert plan is not None
    begun = next(visit for visit in plan.visits if visit.target == "g1")
    other = next(robot.id for robot in scene.robots if robot.id != begun.robot)
    fault = f"{other}@{begun.step * plan.dt_s + 1.5:.1f}s"
    drive = drive_mission(scene, plan, faults=[fault])
    assert audit(scene, drive.plan, drive.log).mission_ok
    rest = drive.replans[0].scene
    assert rest is not None
    left_s = next(goal.dwell_s for goal in rest.goals if goal.id == "g1")
    assert 10.0 < left_s < 18.0
    index = [robot.id for robot in scene.robots].index(begun.robot)
    points = drive.log.state[index, :, :2]
    region = next(goal.region for goal in scene.goals if goal.id == "g1")
    stays_s = [
        drive.log.time_s[end - 1] - drive.log.time_s[first]
        for first, end in runs(region.depth(points) >= 0.0)
    ]
    assert 20.0 <= max(stays_s) < 24.0
