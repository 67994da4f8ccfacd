"""Distances of poses, against shapes that shapely turns and moves one by one."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon, affinity

from mrmg.verification.distances import obstacle_distance, robot_distance


def turned(outline: np.ndarray, pose: np.ndarray) -> Polygon:
    shape = affinity.rotate(Polygon(outline), pose[2], origin=(0, 0), use_radians=True)
    return affinity.translate(shape, *pose[:2])


def test_distances_agree_with_footprints_one_by_one(make_scene) -> None:
    scene = make_scene(
        obstacles=[
            {"id": "o", "box": {"center": [20, 14], "size": [4, 2], "yaw": 0.4}},
            {
                "id": "only2",
                "circle": {"center": [8, 6], "radius": 2},
                "blocks": ["r2"],
            },
        ],
        robots=[
            {"id": "r1", "model": "car", "pose": [5, 10, 0]},
            {"id": "r2", "model": "car", "pose": [30, 10, 0]},
        ],
    )
    random = np.random.default_rng(5)
    low, high = [3, 3, -3], [37, 17, 3]
    poses = [random.uniform(low, high, size=(60, 3)) for _ in scene.robots]
    shapes = [
        [turned(robot.model.footprint_m, pose) for pose in own]
        for robot, own in zip(scene.robots, poses, strict=True)
    ]
    edge = shapely.box(*scene.bounds).exterior
    for robot, own, outlines in zip(scene.robots, poses, shapes, strict=True):
        walls = [edge] + [o.shape for o in scene.obstacles if o.stops(robot.id)]
        wanted = [min(outline.distance(wall) for wall in walls) for outline in outlines]
        assert obstacle_distance(scene, robot, own) == pytest.approx(wanted)
    apart = [one.distance(other) for one, other in zip(*shapes, strict=True)]
    assert robot_distance(scene.robots, poses) == pytest.approx(
        np.array([apart, apart])
    )


def test_outside_the_bounds_nothing_is_clear(make_scene) -> None:
    scene = make_scene()
    poses = np.array([[-50.0, 10.0, 0.0], [39.9, 10.0, 0.0], [20.0, 10.0, 0.0]])
    distance_m = obstacle_distance(scene, scene.robots[0], poses)
    assert distance_m[:2].tolist() == [0.0, 0.0]
    assert distance_m[2] > 5.0


def test_of_several_robots_the_nearest_counts(make_scene) -> None:
    places = {"r1": [5, 10, 0], "r2": [15, 10, 0], "r3": [35, 10, 0]}
    scene = make_scene(
        robots=[
            {"id": name, "model": "car", "pose": pose} for name, pose in places.items()
        ]
    )
    length_m = np.ptp(scene.robots[0].model.footprint_m[:, 0])
    poses = [np.array([robot.pose]) for robot in scene.robots]
    distance = robot_distance(scene.robots, poses)
    wanted = np.array([[10.0], [10.0], [20.0]]) - length_m
    assert distance == pytest.approx(wanted)
