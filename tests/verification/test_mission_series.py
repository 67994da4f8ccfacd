"""What a mission looks like over time, against closed forms and dense sampling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from mrmg.energy.audit import audit
from mrmg.energy.metering import LoggedMotion, find_visits
from mrmg.verification import mission_series as series
from mrmg.viz.scene_drawing import footprint_at


def motion_of(speed: list[tuple[float, float]], tick_s: float = 0.1) -> LoggedMotion:
    """Return a drive along x from (duration [s], speed [m/s]) pieces."""
    v = np.concatenate([np.full(round(t / tick_s), v) for t, v in speed] + [[0.0]])
    state = np.zeros((len(v), 5))
    state[:, 0] = 5.0 + np.concatenate([[0.0], np.cumsum(v[:-1]) * tick_s])
    state[:, 1], state[:, 3] = 10.0, v
    return LoggedMotion(robot="r1", time_s=tick_s * np.arange(len(v)), state=state)


def told(spans) -> list[tuple[str, float, float]]:
    return [(s.kind, round(s.start_s, 6), round(s.end_s, 6)) for s in spans]


def test_activities_are_the_pieces_of_the_drive(make_scene) -> None:
    motion = motion_of([(2.0, 1.0), (3.0, 0.0), (4.0, 2.0), (1.5, 0.0)])
    assert told(series.activities(make_scene(), motion, ())) == [
        ("driving", 0.0, 2.0),
        ("waiting", 2.0, 5.0),
        ("driving", 5.0, 9.0),
        ("finished", 9.0, 10.5),
    ]


def test_a_moment_s_standing_still_is_part_of_driving(make_scene) -> None:
    motion = motion_of([(2.0, 1.0), (0.3, 0.0), (2.0, -1.0), (1.0, 0.0)])
    assert told(series.activities(make_scene(), motion, ())) == [
        ("driving", 0.0, 4.3),
        ("finished", 4.3, 5.3),
    ]


def test_charging_lasts_while_the_robot_is_in_the_station_of_its_tour(
    make_scene,
) -> None:
    scene = make_scene(
        stations=[{"id": "s", "circle": {"center": [10, 10], "radius": 1}}]
    )
    motion = motion_of([(20.0, 1.0), (1.0, 0.0)])
    visits = find_visits(scene, motion, ("s", "g"))
    spans = series.activities(scene, motion, visits)
    assert told(spans)[:3] == [
        ("driving", 0.0, 4.0),
        ("charging", 4.0, 6.1),
        ("driving", 6.1, 20.0),
    ]
    assert spans[1].target == "s"
    passing_by = series.activities(scene, motion, ())
    assert [span.kind for span in passing_by] == ["driving", "finished"]


def test_activities_leave_no_gap(case, make_log) -> None:
    scene, plan = case()
    for motion in series.shown_motions(plan, make_log(scene, plan)):
        spans = series.activities(scene, motion, ())
        assert spans[0].start_s == 0.0
        assert spans[-1].end_s == motion.time_s[-1]
        for before, after in zip(spans, spans[1:], strict=False):
            assert before.end_s == after.start_s


def test_tracking_error_is_the_distance_from_the_reference(case, make_log) -> None:
    scene, plan = case()
    log = make_log(scene, plan)
    aside = log.reference.copy()
    aside[:, :, 0] += 0.3
    aside[:, :, 1] -= 0.4
    assert series.tracking_error(replace(log, reference=aside)) == pytest.approx(0.5)


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
        [shapely.Polygon(footprint_at(robot, tuple(pose))) for pose in own]
        for robot, own in zip(scene.robots, poses, strict=True)
    ]
    edge = shapely.box(*scene.bounds).exterior
    for robot, own, outlines in zip(scene.robots, poses, shapes, strict=True):
        walls = [edge] + [o.shape for o in scene.obstacles if o.stops(robot.id)]
        wanted = [min(outline.distance(wall) for wall in walls) for outline in outlines]
        assert series.obstacle_distance(scene, robot, own) == pytest.approx(wanted)
    apart = [one.distance(other) for one, other in zip(*shapes, strict=True)]
    assert series.robot_distance(scene.robots, poses) == pytest.approx(
        np.array([apart, apart])
    )


def test_of_several_robots_the_nearest_counts(make_scene) -> None:
    places = {"r1": [5, 10, 0], "r2": [15, 10, 0], "r3": [35, 10, 0]}
    scene = make_scene(
        robots=[
            {"id": name, "model": "car", "pose": pose} for name, pose in places.items()
        ]
    )
    length_m = np.ptp(scene.robots[0].model.footprint_m[:, 0])
    poses = [np.array([robot.pose]) for robot in scene.robots]
    distance = series.robot_distance(scene.robots, poses)
    wanted = np.array([[10.0], [10.0], [20.0]]) - length_m
    assert distance == pytest.approx(wanted)


def test_energy_by_terrain_adds_up_to_the_audit(case, make_log) -> None:
    scene, plan = case(
        terrain=[
            {"polygon": [[8, 5], [12, 5], [12, 15], [8, 15]], "multiplier": 2.0},
            {"polygon": [[10, 5], [14, 5], [14, 15], [10, 15]], "multiplier": 0.5},
        ]
    )
    log = make_log(scene, plan)
    classes = series.energy_by_terrain(scene, plan, log)
    assert [item.multiplier for item in classes] == [0.5, 1.0, 2.0]
    account = audit(scene, plan, log)
    for meter in ("planned", "metered", "measured"):
        total_J = getattr(account, meter).total_J()
        parts_J = [getattr(item, f"{meter}_J") for item in classes]
        assert sum(parts_J) == pytest.approx(total_J)
    assert sum(item.planned_m for item in classes) == pytest.approx(12.0, abs=0.1)
    ways = {item.multiplier: item.planned_m for item in classes}
    assert ways[2.0] == pytest.approx(2.0, abs=0.2)
    assert ways[0.5] == pytest.approx(4.0, abs=0.2)


def test_energy_by_terrain_of_a_plan_alone_has_no_driven_figures(case) -> None:
    scene, plan = case()
    (only,) = series.energy_by_terrain(scene, plan, None)
    assert only.planned_J == pytest.approx(plan.ledger.total_J())
    assert (only.driven_m, only.metered_J, only.measured_J) == (None, None, None)
