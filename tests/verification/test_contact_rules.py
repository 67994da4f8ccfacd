"""Contacts and clearances of whole plans, in places a sampling check would miss."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from mrmg.verification.clearance import MINIMUM_ACCURACY_M
from mrmg.verification.swept_footprint import SweptFootprint
from mrmg.verification.verdict import Verdict, ViolationKind
from mrmg.verification.verify import verify

TWO_ROBOTS = [
    {"id": "r1", "model": "car", "pose": [5, 10, 0]},
    {"id": "r2", "model": "car", "pose": [5, 14, 0]},
]
WALL = {"id": "wall", "box": {"center": [13.5, 10], "size": [1, 4]}, "height": 1}


def test_obstacle_of_another_robot_is_no_obstacle(case: Any) -> None:
    only_r2 = {**WALL, "blocks": ["r2"]}
    assert verify(*case(obstacles=[only_r2], robots=TWO_ROBOTS)).ok
    only_r1 = {**WALL, "blocks": ["r1"]}
    verdict = verify(*case(obstacles=[only_r1], robots=TWO_ROBOTS))
    assert {item.robot for item in verdict.violations} == {"r1"}


def test_robot_drives_inside_the_hole_of_an_obstacle(case: Any) -> None:
    ring = {
        "id": "ring",
        "polygon": [[1, 6], [22, 6], [22, 14], [1, 14]],
        "holes": [[[2, 7], [21, 7], [21, 13], [2, 13]]],
        "height": 1,
    }
    verdict = verify(*case(obstacles=[ring]))
    assert verdict.ok
    # The nose ends at 5 + 12 + 1.5, the sides run 3 - 0.55 from the hole's rim.
    assert verdict.min_obstacle_clearance_m == pytest.approx(2.45, abs=2e-3)


def test_clearances_are_certified_from_below(case: Any) -> None:
    beside = {"id": "b", "box": {"center": [12, 8], "size": [2, 1]}, "height": 1}
    verdict = verify(*case(obstacles=[beside], robots=TWO_ROBOTS))
    beside_m, apart_m = 1.5 - 0.55, 4.0 - 1.1
    obstacle_m, robot_m = verdict.min_obstacle_clearance_m, verdict.min_robot_distance_m
    assert beside_m - MINIMUM_ACCURACY_M <= obstacle_m <= beside_m + 1e-9
    assert apart_m - MINIMUM_ACCURACY_M <= robot_m <= apart_m + 1e-9


def test_lone_robot_has_no_distance_to_others(case: Any) -> None:
    assert verify(*case()).min_robot_distance_m is None


def test_corner_that_cuts_a_post_between_two_samples_is_caught(
    make_scene: Any, make_plan: Any
) -> None:
    """The outer front corner swings out furthest between two samples."""
    turn = [(1.5, 1.0)] * 5 + [(1.5, 0.0)] * 5 + [(0.0, 0.0)] * 6 + [(-1.5, 0.0)] * 10
    free = make_scene(goals=[])
    plan = make_plan(free, {"r1": turn}, {"r1": ()})
    footprint = SweptFootprint(free.robots[0].model, plan.trajectories[0])
    corner = footprint.corners_at(np.array([13]), np.array([0.05]))[0, 1]
    heading = footprint.states_at(np.array([13]), np.array([0.05]))[0, 2]
    post = corner + 0.004 * np.array([np.sin(heading), -np.cos(heading)])
    post -= 0.008 * np.array([np.cos(heading), np.sin(heading)])
    box = {"center": post.tolist(), "size": [0.01, 0.01], "yaw": float(heading)}
    scene = make_scene(goals=[], obstacles=[{"id": "post", "box": box, "height": 1}])

    state = plan.trajectories[0].state
    sampled = shapely.polygons(scene.robots[0].model.footprint_at(state))
    assert shapely.distance(sampled, scene.obstacles[0].shape).min() > 0.0
    verdict = verify(scene, replace(plan, scene_digest=scene.digest))
    (violation,) = verdict.violations
    assert violation.kind is ViolationKind.OBSTACLE
    assert 1.3 < violation.time_s < 1.4
    assert verdict.min_obstacle_clearance_m == 0.0


@pytest.mark.parametrize("offset", [(100.0, 0.0), (-37.5, 1000.0)])
def test_moving_the_scene_changes_nothing(
    offset: tuple[float, float], make_scene: Any, make_plan: Any
) -> None:
    rng = np.random.default_rng(5)
    wiggle = [(1.0, float(u2)) for u2 in rng.uniform(-1, 1, 12)]
    wiggle += [(-1.0, float(u2)) for u2 in rng.uniform(-1, 1, 12)]

    def judged(dx: float, dy: float) -> Verdict:
        scene = make_scene(
            bounds=[dx, dy, 40 + dx, 20 + dy],
            goals=[],
            robots=[{"id": "r1", "model": "car", "pose": [5 + dx, 10 + dy, 0]}],
            obstacles=[
                {
                    "id": "post",
                    "circle": {"center": [7.5 + dx, 10.5 + dy], "radius": 0.4},
                    "height": 1,
                }
            ],
        )
        return verify(scene, make_plan(scene, {"r1": wiggle}, {"r1": ()}))

    here, there = judged(0.0, 0.0), judged(*offset)
    assert here.min_obstacle_clearance_m == pytest.approx(
        there.min_obstacle_clearance_m, abs=1e-6
    )
    assert [item.kind for item in here.violations] == [
        item.kind for item in there.violations
    ]


def test_every_obstacle_under_a_footprint_is_named(case: Any) -> None:
    second = {**WALL, "id": "second"}
    verdict = verify(*case(obstacles=[WALL, second]))
    assert [item.other for item in verdict.violations] == ["wall", "second"]


def test_a_rest_in_contact_is_one_contact(make_scene: Any, make_plan: Any) -> None:
    """The nose comes to x = 8, rests there for two seconds, and goes back."""
    there, back = [(1.5, 0.0)] * 10, [(-1.5, 0.0)] * 10
    controls = [*there, *back, *[(0.0, 0.0)] * 20, *back, *there]
    for wall_x, found in ((8.4, []), (8.2, [ViolationKind.OBSTACLE])):
        box = {"center": [wall_x, 10], "size": [0.6, 4]}
        scene = make_scene(
            goals=[], obstacles=[{"id": "wall", "box": box, "height": 1}]
        )
        verdict = verify(scene, make_plan(scene, {"r1": controls}, {"r1": ()}))
        kinds = [item.kind for item in verdict.violations]
        assert [kind for kind in kinds if kind is ViolationKind.OBSTACLE] == found
        clearance_m = max(wall_x - 0.3 - 8.0, 0.0)
        assert verdict.min_obstacle_clearance_m == pytest.approx(clearance_m, abs=2e-3)
