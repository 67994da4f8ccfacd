"""Driving alone along a path: speeds, margins against shapely, and where it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate, translate

import mrmg
from mrmg.planning import PlannerParams
from mrmg.planning.path_following.band import Path, visit_steps
from mrmg.planning.path_following.following import tour_path
from mrmg.planning.path_following.tracking import (
    deceleration,
    drive_alone,
    empty_path,
    steerable_speeds,
)
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.scene.types import Scene


@pytest.mark.parametrize(
    ("name", "least", "most"), [("scene2", 0.9, 1.0), ("diffdrive", 0.1, 0.5)]
)
def test_slowing_down_leaves_rolling_to_be_overcome(
    name: str, least: float, most: float
) -> None:
    """Cars nearly roll; robots that turn by their wheels keep both of them pushing."""
    scene = mrmg.load_scene(name)
    problem = state_mission(scene, 0, PlannerParams(samples=300))
    ease = np.array([deceleration(problem, r) for r in range(len(scene.robots))])
    ground = min([1.0, *(area.multiplier for area in scene.terrain)])
    energy = [robot.model.energy_model for robot in scene.robots]
    rolling = np.array(
        [ground * each.rolling_force_N / each.effective_mass_kg for each in energy]
    )
    assert (ease >= least * rolling).all()
    assert (ease <= most * rolling).all()


@pytest.mark.parametrize("name", ["quickstart", "diffdrive"])
def test_robots_can_steer_along_an_arc_as_fast_as_is_said(name: str) -> None:
    """At that speed steering or turning change as fast as they can, or turning is."""
    problem = state_mission(mrmg.load_scene(name), 0, PlannerParams(samples=100))
    robot = problem.mission.fleet[0]
    way = np.linspace(0.0, 6.0, 601)
    bend = 0.4 * way  # a clothoid
    node = empty_path(601)
    node["bend"], node["way"], node["end"] = bend, way, 600
    speed = steerable_speeds(problem, 0, node)
    v = speed[1:-1]
    if name == "diffdrive":
        rate = v * np.diff(bend[1:]) / np.diff(way[1:]) * v
        turning = v * bend[1:-1]
    else:
        steering = np.arctan(float(robot["wheelbase"]) * bend)
        rate = v * np.diff(steering[1:]) / np.diff(way[1:])
        turning = np.zeros(len(v))
    most = np.maximum(rate / robot["limit"][4], turning / robot["limit"][2])
    assert most == pytest.approx(np.ones(len(v)), rel=0.03)


def straight_path(problem: Problem, end_x: float) -> Path:
    """Return a straight path from a robot's start."""
    x0, y0, heading = problem.start[0, :3]
    x = np.linspace(x0, end_x, 30)
    node = np.stack([x, np.full(30, y0)], axis=1)
    return Path(node, np.ones(29, np.int64), float(heading))


@pytest.mark.parametrize("model", ["car", "diffdrive"])
@pytest.mark.parametrize("south", np.linspace(9.6, 12.0, 9))
def test_a_drive_keeps_its_margin_or_ends_where_it_would_not(
    yard: Callable[..., Scene],
    state: Callable[..., Problem],
    model: str,
    south: float,
) -> None:
    """Oracle: every footprint placed and measured by shapely."""
    box = shapely.box(14.0, south, 16.0, south + 3.0)
    corners = list(box.exterior.coords)[:-1]
    wall = {"id": "wall", "polygon": [list(corner) for corner in corners]}
    robots = [{"id": "r1", "model": model, "pose": [4, 10, 0]}]
    problem = state(yard(obstacles=[wall], robots=robots))
    drive = drive_alone(problem, 0, straight_path(problem, 25.0))
    footprint = shapely.Polygon(problem.scene.robots[0].model.footprint_m)
    margin_m = float(problem.mission.fleet["margin"][0])
    clear_m = np.array(
        [
            translate(rotate(footprint, pose[2], (0, 0), use_radians=True), *pose[:2])
            .distance(box)
            for pose in drive.motion.state
        ]
    )  # fmt: skip
    assert clear_m[:-1].min() >= margin_m - 1e-9
    assert drive.arrived == (clear_m[-1] >= margin_m)
    if drive.arrived:
        assert np.hypot(*(drive.motion.state[-1, :2] - (25.0, 10.0))) < 0.1
        assert (np.diff(drive.spent_s) >= 0.0).all()
        lasting_s = len(drive.motion.control) * problem.dt_s
        assert drive.spent_s[-1] == pytest.approx(lasting_s, abs=2.0)
    else:
        assert np.isinf(drive.spent_s[-1])


@pytest.mark.parametrize("x_m", [4.0, 25.0])
def test_a_drive_ends_at_rest_with_the_heading_asked_for(
    x_m: float, yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """Also if it only turns, as the robot stands where it ends."""
    finish = {"circle": {"center": [25, 10], "radius": 1}, "heading": 1.5}
    robot = {"id": "r1", "model": "diffdrive", "pose": [x_m, 10, 0], "finish": finish}
    problem = state(yard(robots=[robot]))
    end = int(problem.mission.targets.finish[0])
    straight = straight_path(problem, 25.0)
    nodes = 30 if x_m < 25.0 else 1
    path = replace(
        straight,
        node=straight.node[:nodes],
        gear=straight.gear[: nodes - 1],
        stop=np.array([nodes - 1]),
        target=np.array([end]),
        deeper=np.zeros(1),
        pause_s=np.zeros(1),
        aim=np.array([1.5]),
    )
    drive = drive_alone(problem, 0, path)
    assert drive.arrived
    assert np.abs(drive.motion.state[-1, 3:]).max() < 1e-9
    tolerance = float(problem.mission.targets.target["tolerance"][end])
    assert tolerance < 0.3
    assert abs(drive.motion.state[-1, 2] - 1.5) <= tolerance


@pytest.mark.parametrize("angle", [0.3, 1.0, 1.5, 3.0])
def test_robots_turn_on_the_spot_nearly_as_fast_as_they_can(
    angle: float, yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """Closed form: they gather speed for half of the angle, up to the most, and lose it
    again. None is lost by turning too far.
    """
    finish = {"circle": {"center": [25, 10], "radius": 1}, "heading": angle}
    robot = {"id": "r1", "model": "diffdrive", "pose": [25, 10, 0], "finish": finish}
    problem = state(yard(robots=[robot]))
    end = int(problem.mission.targets.finish[0])
    path = Path(
        node=np.array([[25.0, 10.0]]),
        gear=np.zeros(0, np.int64),
        heading=0.0,
        stop=np.array([0]),
        target=np.array([end]),
        deeper=np.zeros(1),
        pause_s=np.zeros(1),
        aim=np.array([angle]),
    )
    drive = drive_alone(problem, 0, path)
    assert drive.arrived
    assert drive.motion.state[:, 4].min() >= -0.05
    limit = problem.mission.fleet["limit"][0]
    most = min(limit[2], np.sqrt(angle * limit[4]))
    least_s = angle / most + most / limit[4]
    taken_s = len(drive.motion.control) * problem.dt_s
    assert taken_s <= 1.1 * least_s + 3.0 * problem.dt_s


def test_robots_that_turn_on_the_spot_turn_to_headings_on_their_way(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """Its path leads east past a target that wants it to look back, and on north."""
    wanted = {"heading": -2.6, "heading_tolerance": 0.2}
    scene = yard(
        goals=[
            {"id": "g", "circle": {"center": [10, 10], "radius": 0.5}, **wanted},
            {"id": "h", "circle": {"center": [10, 16], "radius": 0.5}},
        ],
        robots=[{"id": "r", "model": "diffdrive", "pose": [4, 10, 0]}],
    )
    problem = state(scene, samples=50)
    path = Path(
        node=np.array([[4.0, 10.0], [10.0, 10.0], [10.0, 16.0]]),
        gear=np.ones(2, np.int64),
        stop=np.array([1, 2]),
        target=np.array([0, 1]),
        deeper=np.zeros(2),
        pivot=np.array([1]),
        heading=0.0,
        pause_s=np.zeros(2),
        aim=np.array([-2.6, np.nan]),
    )
    drive = drive_alone(problem, 0, path)
    assert drive.arrived
    assert len(visit_steps(problem.mission.targets, [0, 1], drive.motion.state)) == 2


def test_slow_robots_do_not_stop_in_bends(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """They would if they counted as standing, and turned on the spot, all the while."""
    robots = [{"id": "r1", "model": "diffdrive", "pose": [4, 10, 0]}]
    way = np.linspace(0.0, 6.0, 61)
    bends = np.stack([4.0 + way, 10.0 + 0.3 * (1.0 - np.cos(2.0 * way))], axis=1)
    goals = [{"id": "g", "circle": {"center": bends[-1].tolist(), "radius": 0.5}}]
    taken_s = []
    for times in (1.0, 40.0):
        scene = yard(robots=robots, goals=goals)
        robot = scene.robots[0]
        limits = replace(
            robot.model.limits,
            v_min_m_s=robot.model.limits.v_min_m_s / times,
            v_max_m_s=robot.model.limits.v_max_m_s / times,
            w_max=robot.model.limits.w_max / times,
            u1_max_m_s2=robot.model.limits.u1_max_m_s2 / times**2,
            u2_max=robot.model.limits.u2_max / times**2,
        )
        slow = replace(robot, model=replace(robot.model, limits=limits))
        problem = state(replace(scene, robots=(slow,)), samples=0)
        straight = tour_path(problem, 0, [0])
        path = replace(
            straight,
            node=bends,
            gear=np.ones(len(bends) - 1, np.int64),
            stop=np.array([len(bends) - 1]),
            pivot=np.zeros(0, np.int64),
        )
        drive = drive_alone(problem, 0, path)
        assert drive.arrived
        taken_s.append(len(drive.motion.control) * problem.dt_s / times)
    assert taken_s[1] < 0.85 * taken_s[0], taken_s


def test_robots_that_brake_slowly_do_so_before_bends(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """Even when they drive as fast as they can."""
    scene = yard(robots=[{"id": "r1", "model": "husky", "pose": [4, 10, 0]}])
    robot = scene.robots[0]
    weak = replace(robot.model.limits, u1_max_m_s2=0.06)
    robot = replace(robot, model=replace(robot.model, limits=weak))
    problem = state(replace(scene, robots=(robot,)), samples=0)
    angle = np.linspace(-0.5 * np.pi, 0.0, 17)
    bend = np.array([14.0, 11.0]) + np.stack([np.cos(angle), np.sin(angle)], axis=1)
    straight = np.linspace([4.0, 10.0], [14.0, 10.0], 101)
    nodes = np.vstack([straight, bend[1:], [[15.0, 12.0], [15.0, 13.0]]])
    path = replace(
        straight_path(problem, 25.0),
        node=nodes,
        gear=np.ones(len(nodes) - 1, np.int64),
    )
    drive = drive_alone(replace(problem, minimum_time=True), 0, path)
    assert drive.arrived
    assert drive.motion.state[:, 3].max() > 0.6
    driven = shapely.LineString(drive.motion.state[:, :2])
    assert driven.hausdorff_distance(shapely.LineString(nodes)) < 0.15


@pytest.mark.parametrize("model", ["car", "diffdrive"])
@pytest.mark.parametrize("most_m_s2", [0.3, 1.0, 3.0])
def test_robots_that_brake_hard_come_to_rest_where_their_paths_end(
    model: str,
    most_m_s2: float,
    yard: Callable[..., Scene],
    state: Callable[..., Problem],
) -> None:
    """A step earlier than braking seems due: it drives on as fast through each step."""
    scene = yard(robots=[{"id": "r1", "model": model, "pose": [4, 10, 0]}])
    robot = scene.robots[0]
    limits = replace(robot.model.limits, v_max_m_s=2.0, u1_max_m_s2=most_m_s2)
    robot = replace(robot, model=replace(robot.model, limits=limits))
    problem = state(replace(scene, robots=(robot,)), samples=0)
    problem = replace(problem, minimum_time=True)
    for end_x in np.linspace(24.0, 25.0, 12):
        drive = drive_alone(problem, 0, straight_path(problem, end_x))
        assert drive.arrived
        assert drive.motion.state[:, 3].max() > 1.6
        assert -0.02 < drive.motion.state[-1, 0] - end_x < 0.01


@pytest.mark.parametrize("share", [1.0, 0.15, 0.05])
def test_robots_that_steer_slowly_come_back_to_their_paths(
    share: float, yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """From a heading 30 degrees off; they swing too far where they do not slow down."""
    scene = yard(robots=[{"id": "r1", "model": "car", "pose": [4, 10, 0.5]}])
    robot = scene.robots[0]
    slowly = replace(robot.model.limits, u2_max=share * robot.model.limits.u2_max)
    robot = replace(robot, model=replace(robot.model, limits=slowly))
    problem = state(replace(scene, robots=(robot,)), samples=0)
    drive = drive_alone(problem, 0, straight_path(problem, 25.0))
    assert drive.arrived
