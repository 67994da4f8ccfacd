"""What is left of a mission is a scene like any other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import Polygon

from mrmg.errors import SceneError
from mrmg.scene.loading import dump_scene, scene_from_document
from mrmg.scene.types import Scene
from mrmg.supervision.remaining import FleetCondition, is_over, remaining_scene


@pytest.fixture
def condition(yard: Scene) -> FleetCondition:
    """Both cars have moved and used half of their energy."""
    return FleetCondition(
        pose={"r1": (12.0, 17.0, 0.3), "r2": (15.0, 6.0, -2.0)},
        energy_J={robot.id: 0.5 * robot.battery.capacity_J for robot in yard.robots},
        rolling_factor={"r1": 1.0, "r2": 1.25},
    )


def test_robots_start_from_where_they_are(
    yard: Scene, condition: FleetCondition
) -> None:
    rest = remaining_scene(yard, condition)
    assert [robot.id for robot in rest.robots] == ["r1", "r2"]
    for before, after in zip(yard.robots, rest.robots, strict=True):
        assert after.pose == condition.pose[after.id]
        assert after.battery.start_J == condition.energy_J[after.id]
        assert after.battery.capacity_J == before.battery.capacity_J
        assert after.battery.reserve_J == before.battery.reserve_J
    assert rest.digest != yard.digest


def test_the_energy_model_is_the_measured_one(
    yard: Scene, condition: FleetCondition
) -> None:
    rest = remaining_scene(yard, condition)
    before, after = (
        [robot.model.energy_model for robot in scene.robots] for scene in (yard, rest)
    )
    assert after[0] == before[0]
    rolling_N = 1.25 * before[1].rolling_force_N
    assert after[1] == replace(before[1], rolling_force_N=rolling_N)


def test_measured_factors_multiply_those_of_the_scene(
    make_yard: Callable[..., Scene], condition: FleetCondition
) -> None:
    worn = [
        {"id": "r1", "model": "car", "pose": [5, 18, 0], "rolling_factor": 2.0},
        {"id": "r2", "model": "car", "pose": [5, 5, 0], "rolling_factor": 2.0},
    ]
    rest = remaining_scene(make_yard(robots=worn), condition)
    plain = remaining_scene(make_yard(), condition)
    for one, other in zip(rest.robots, plain.robots, strict=True):
        ratio = one.model.rolling_coefficient / other.model.rolling_coefficient
        assert ratio == pytest.approx(2.0)


def test_visited_goals_are_gone(yard: Scene, condition: FleetCondition) -> None:
    rest = remaining_scene(yard, replace(condition, visited=frozenset({"g2"})))
    assert [goal.id for goal in rest.goals] == ["g1", "g3"]
    done = remaining_scene(
        yard, replace(condition, visited=frozenset({"g1", "g2", "g3"}))
    )
    assert done.goals == ()


def test_robots_out_of_service_are_obstacles(
    yard: Scene, condition: FleetCondition
) -> None:
    gone = replace(condition, out_of_service=frozenset({"r2"}))
    rest = remaining_scene(yard, gone)
    assert [robot.id for robot in rest.robots] == ["r1"]
    (wreck,) = rest.obstacles
    assert wreck.id == "r2"
    assert wreck.stops("r1")
    model = yard.robot("r2").model
    assert wreck.shape.area == pytest.approx(Polygon(model.footprint_m).area)
    x, y, yaw = condition.pose["r2"]
    front = np.array([np.cos(yaw), np.sin(yaw)]) * model.wheelbase_m + (x, y)
    assert wreck.shape.contains(Polygon(front + 0.1 * model.footprint_m))


def test_obstacles_keep_their_ids_and_whom_they_stop(
    make_yard: Callable[..., Scene], condition: FleetCondition
) -> None:
    box = {"box": {"center": [30, 11], "size": [2, 2]}}
    scene = make_yard(obstacles=[{**box, "blocks": ["r2"]}, box, {"id": "shed", **box}])
    gone = replace(condition, out_of_service=frozenset({"r2"}))
    ids = [obstacle.id for obstacle in remaining_scene(scene, gone).obstacles]
    assert ids == ["obstacle_1", "shed", "r2"]
    assert [item.id for item in remaining_scene(scene, condition).obstacles] == [
        "obstacle_0",
        "obstacle_1",
        "shed",
    ]


def test_a_battery_at_its_reserve_may_use_it(
    yard: Scene, condition: FleetCondition
) -> None:
    capacity_J = yard.robot("r1").battery.capacity_J
    low = replace(condition, energy_J={"r1": 0.04 * capacity_J, "r2": capacity_J})
    rest = remaining_scene(yard, low)
    assert rest.robot("r1").battery.reserve_J == 0.0
    assert rest.robot("r2").battery.reserve_J == yard.robot("r2").battery.reserve_J
    empty = replace(condition, energy_J={"r1": -3.0, "r2": 2 * capacity_J})
    batteries = [robot.battery for robot in remaining_scene(yard, empty).robots]
    assert batteries[0].start_J == pytest.approx(0.0, abs=1e-6)
    assert batteries[1].start_J == capacity_J


def test_reserves_can_be_lowered(yard: Scene, condition: FleetCondition) -> None:
    rest = remaining_scene(yard, condition, reserve_share=0.5)
    for before, after in zip(yard.robots, rest.robots, strict=True):
        assert after.battery.reserve_J == pytest.approx(0.5 * before.battery.reserve_J)


def test_more_than_the_reserve_is_asked_for_where_it_is_there(
    yard: Scene, condition: FleetCondition
) -> None:
    capacity_J = yard.robot("r1").battery.capacity_J
    # Room to do something is 2 % of the capacity, the reserve 5 %.
    low = replace(condition, energy_J={"r1": 0.08 * capacity_J, "r2": capacity_J})
    rest = remaining_scene(yard, low, reserve_share=1.25)
    fractions = [robot.battery.reserve_fraction for robot in rest.robots]
    assert fractions == pytest.approx([0.06, 0.0625])


def test_the_rest_can_be_saved_and_loaded(
    yard: Scene, condition: FleetCondition
) -> None:
    rest = remaining_scene(yard, replace(condition, out_of_service=frozenset({"r1"})))
    again = scene_from_document(rest.document, source="again")
    assert again.digest == rest.digest
    assert dump_scene(again) == dump_scene(rest)


def test_robots_that_touch_cannot_be_planned_for(
    yard: Scene, condition: FleetCondition
) -> None:
    at = dict.fromkeys(("r1", "r2"), (12.0, 17.0, 0.3))
    with pytest.raises(SceneError, match="r2 starts where r1 stands"):
        remaining_scene(yard, replace(condition, pose=at))


def test_who_is_to_end_at_its_start_still_is(
    make_yard: Callable[..., Scene], condition: FleetCondition
) -> None:
    robots = [
        {"id": "r1", "model": "car", "pose": [5, 18, 0], "finish": "start"},
        {"id": "r2", "model": "car", "pose": [5, 5, 0]},
    ]
    scene = make_yard(robots=robots)
    rest = remaining_scene(scene, condition)
    before, after = scene.robot("r1").finish, rest.robot("r1").finish
    assert before is not None and after is not None
    np.testing.assert_array_equal(after.region.center, before.region.center)
    assert after.region.radius_m == before.region.radius_m
    assert rest.robot("r2").finish is None


def test_a_mission_is_over_when_all_is_visited_and_all_are_home(
    make_yard: Callable[..., Scene], condition: FleetCondition
) -> None:
    robots = [
        {"id": "r1", "model": "car", "pose": [5, 18, 0], "finish": "start"},
        {"id": "r2", "model": "car", "pose": [5, 5, 0]},
    ]
    scene = make_yard(robots=robots)
    done = replace(condition, visited=frozenset({"g1", "g2", "g3"}))
    home = replace(done, pose={**done.pose, "r1": (5.3, 18.2, 1.0)})
    away = replace(done, out_of_service=frozenset({"r1"}))
    assert not is_over(scene, condition)
    assert not is_over(scene, done)
    assert is_over(scene, home)
    assert is_over(scene, away)


def test_what_is_left_of_the_time_limit_still_holds(
    make_yard: Callable[..., Scene], condition: FleetCondition
) -> None:
    yard = make_yard(time_limit=100, objective="makespan")
    later = replace(condition, time_s=40.0)
    rest = remaining_scene(yard, later)
    assert rest.time_limit_s == 60.0
    assert rest.objective == yard.objective
    assert remaining_scene(yard, later, timely=False).time_limit_s == np.inf
    over = replace(condition, time_s=100.0)
    assert remaining_scene(yard, over).time_limit_s == np.inf
