"""The map's own frame: neither a map's place nor its robots' size makes a difference.

Maps lie along the axes, so that turns by quarters are all there are.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

import mrmg
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.frame import Frame, in_unit
from mrmg.planning.problem.problem import state_mission
from mrmg.plans import Plan
from mrmg.scene.loading import scene_from_document
from mrmg.scene.margins import Margins
from mrmg.scene.objective import MAKESPAN
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[1] / "scenes"
PARAMS = PlannerParams(samples=400, improvements=0)
NAMES = ("two_swap", "station_needed", "obstacle_with_hole", "polygon_regions")

SLOPE = {"hills": [{"center": [14, 6], "radius": 8, "height": 1.0}]}


def turned_left(point: list[float]) -> list[float]:
    return [-point[1], point[0]]


def placed(document: Any, quarters: int, shift: tuple[float, float]) -> Any:
    """Return a scene file's content turned to the left and then moved."""
    for _ in range(quarters):
        document = _mapped(document, turned_left, 0.5 * pi)
    return _mapped(document, lambda p: [p[0] + shift[0], p[1] + shift[1]], 0.0)


def _mapped(document: Any, point: Any, turn: float) -> Any:
    def shape(entry: dict[str, Any]) -> dict[str, Any]:
        new = dict(entry)
        if entry.get("polygon"):
            new["polygon"] = [point(p) for p in entry["polygon"]]
        if entry.get("holes"):
            new["holes"] = [[point(p) for p in ring] for ring in entry["holes"]]
        for kind in ("box", "circle"):
            if entry.get(kind):
                new[kind] = {**entry[kind], "center": point(entry[kind]["center"])}
        if entry.get("box"):
            new["box"]["yaw"] = new["box"].get("yaw", 0.0) + turn
        return new

    x_min, y_min, x_max, y_max = document["bounds"]
    corners = np.array([point([x_min, y_min]), point([x_max, y_max])])
    robots = [
        {**robot, "pose": [*point(robot["pose"][:2]), robot["pose"][2] + turn]}
        for robot in document["robots"]
    ]
    lists = ("obstacles", "terrain", "goals", "stations")
    return {
        **document,
        "bounds": [*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist()],
        "robots": robots,
        **{key: [shape(entry) for entry in document.get(key) or []] for key in lists},
    }


def plan_of(scene: Scene) -> Plan:
    result = plan_mission(scene, seed=3, params=PARAMS)
    assert result.plan is not None, result.reason
    return result.plan


@cache
def as_it_lies(name: str) -> tuple[Scene, Plan]:
    scene = mrmg.load_scene(SCENES / f"{name}.yaml")
    return scene, plan_of(scene)


@pytest.mark.parametrize("quarters", range(4))
@pytest.mark.parametrize("name", NAMES)
def test_moving_and_turning_a_scene_changes_nothing(name: str, quarters: int) -> None:
    """Moved, the controls are the same bit for bit; turned, but for their rounding."""
    scene, plan = as_it_lies(name)
    document = placed(scene.document, quarters, (-137.53, 61.25))
    moved = scene_from_document(document, source=name)
    other = plan_of(moved)
    assert other.cost_J == pytest.approx(plan.cost_J, rel=1e-6)
    assert other.tours == plan.tours
    for one, two in zip(plan.trajectories, other.trajectories, strict=True):
        assert two.control == pytest.approx(one.control, abs=1e-5)
        assert quarters or two.control.tobytes() == one.control.tobytes()
    assert mrmg.verify(moved, other).violations == ()
    assert other.scene_digest == moved.digest


def test_states_are_those_that_the_controls_lead_to_on_the_map() -> None:
    """Bit for bit, in plain Python, as the verifier repeats them."""
    scene, _ = as_it_lies("two_swap")
    moved = scene_from_document(placed(scene.document, 1, (0.1, 9.7)), source="moved")
    plan = plan_of(moved)
    rules = {item.rule for item in mrmg.verify(moved, plan).violations}
    assert rules == set()
    for robot, trajectory in zip(moved.robots, plan.trajectories, strict=True):
        assert tuple(trajectory.state[0, :3]) == robot.pose


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("quarters", range(4))
def test_the_mission_in_the_frame_is_one(name: str, quarters: int) -> None:
    """Wherever the map lies, the frame holds the same numbers."""
    scene, _ = as_it_lies(name)
    moved = scene_from_document(
        placed(scene.document, quarters, (412.7, -0.3)), source=name
    )
    first, second = (Frame.of(one).scene(one) for one in (scene, moved))
    assert first.bounds == second.bounds
    for one, two in zip(first.targets(), second.targets(), strict=True):
        assert one.region.center.tolist() == two.region.center.tolist()
        assert one.region.corners.tolist() == two.region.corners.tolist()
    for one, two in zip(first.obstacles, second.obstacles, strict=True):
        assert one.shape.equals_exact(two.shape, 0.0)
    for one, two in zip(first.robots, second.robots, strict=True):
        assert one.pose == pytest.approx(two.pose, abs=2e-9)
    one, two = (state_mission(item, 0, PARAMS) for item in (first, second))
    assert one.roadmap.distance.tolist() == two.roadmap.distance.tolist()


@pytest.mark.parametrize("quarters", range(4))
def test_heights_turn_with_the_map(quarters: int) -> None:
    document = {
        "format": 1,
        "name": "slope",
        "bounds": [0, 0, 30, 20],
        "elevation": SLOPE,
        "goals": [{"id": "g", "circle": {"center": [26, 10], "radius": 1.5}}],
        "robots": [{"id": "r", "model": "car", "pose": [4, 9, 0]}],
    }
    scene = scene_from_document(document, source="slope")
    frame = Frame(scene.bounds, quarters)
    turned = frame.scene(scene)
    assert scene.elevation is not None and turned.elevation is not None
    points = np.random.default_rng(0).uniform((0, 0), (30, 20), (200, 2))
    assert turned.elevation.height_at(frame.points(points)) == pytest.approx(
        scene.elevation.height_at(points), abs=1e-6
    )
    assert np.ptp(scene.elevation.height_m) > 0.5


def test_shipped_maps_lie_in_their_frame_or_are_turned() -> None:
    scene = mrmg.load_scene("scene1")
    assert Frame.of(scene).scene(scene) is scene
    assert Frame.of(mrmg.load_scene("scene2")).quarters == 1


def test_a_fleet_around_the_middle_is_turned_by_its_first_robot() -> None:
    scene, _ = as_it_lies("two_swap")
    for quarters in range(4):
        document = placed(scene.document, quarters, (0.0, 0.0))
        moved = scene_from_document(document, source="turned")
        starts = [robot.pose[:2] for robot in Frame.of(moved).scene(moved).robots]
        reference = [robot.pose[:2] for robot in Frame.of(scene).scene(scene).robots]
        assert starts == reference


def test_maps_of_robots_with_their_own_motion_stay() -> None:
    """Their motion may depend on the place."""
    scene, _ = as_it_lies("two_swap")
    moved = scene_from_document(placed(scene.document, 2, (5.0, 5.0)), source="own")
    first, second = moved.robots
    own = replace(first, model=replace(first.model, motion_model="motion.py"))
    users = replace(moved, robots=(own, second))
    assert not Frame.of(moved).is_the_maps
    assert Frame.of(users).scene(users) is users


# --- robots of other sizes ---------------------------------------------------------


def model_of_size(model: RobotModel, size: float) -> RobotModel:
    """Return a model so many times as long that drives as many lengths a second."""
    limits = model.limits
    return replace(
        model,
        footprint_m=size * model.footprint_m,
        wheelbase_m=size * model.wheelbase_m,
        track_m=size * model.track_m,
        center_of_mass_m=size * model.center_of_mass_m,
        wheel_radius_m=size * model.wheel_radius_m,
        limits=replace(
            limits,
            v_min_m_s=size * limits.v_min_m_s,
            v_max_m_s=size * limits.v_max_m_s,
            u1_max_m_s2=size * limits.u1_max_m_s2,
        ),
    )


def of_size(scene: Scene, size: float) -> Scene:
    """Return a scene, its targets circles, in which all is so many times as long.

    Batteries hold more where robots are faster.
    """
    more = max(1.0, size) ** 2

    def shape(item: Any) -> Any:
        larger = shapely.transform(item.shape, lambda points: size * points)
        return replace(item, shape=larger)

    def target(item: Any) -> Any:
        region = item.region
        assert not len(region.corners)
        circle = replace(
            region, center=size * region.center, radius_m=size * region.radius_m
        )
        return replace(item, region=circle)

    x_min, y_min, x_max, y_max = scene.bounds
    return replace(
        scene,
        bounds=(size * x_min, size * y_min, size * x_max, size * y_max),
        obstacles=tuple(map(shape, scene.obstacles)),
        terrain=tuple(map(shape, scene.terrain)),
        goals=tuple(map(target, scene.goals)),
        stations=tuple(map(target, scene.stations)),
        robots=tuple(
            replace(
                robot,
                model=model_of_size(robot.model, size),
                pose=(size * robot.pose[0], size * robot.pose[1], robot.pose[2]),
                finish=robot.finish and target(robot.finish),
                battery=replace(
                    robot.battery,
                    capacity_J=more * robot.battery.capacity_J,
                    start_J=more * robot.battery.start_J,
                ),
                margins=Margins(obstacle_m=0.1 * size, robot_m=0.2 * size),
            )
            for robot in scene.robots
        ),
    )


@pytest.mark.parametrize("size", [2.0**-5, 2.0**-3, 4.0, 8.0])
def test_missions_of_small_and_large_robots_are_as_easy(size: float) -> None:
    """Lengths that suit robots of a metre are walls to some and blurred to others."""
    scene = replace(as_it_lies("two_swap")[0], objective=MAKESPAN)
    ordinary, other = (of_size(scene, each) for each in (1.0, size))
    plan, same = plan_of(ordinary), plan_of(other)
    assert mrmg.verify(other, same).violations == ()
    assert same.makespan_s == pytest.approx(plan.makespan_s, rel=0.2)
    assert set(same.margins.values()) == {(0.1 * size, 0.2 * size)}


def test_passages_are_told_in_metres_on_the_map() -> None:
    """A small car needs as much room to steer as it has in its frame."""
    halves = [
        {"id": name, "box": {"center": [12, y], "size": [0.3, 6.4]}}
        for name, y in (("south", 3.2), ("north", 10.8))
    ]
    document = {
        "format": 1,
        "name": "gap",
        "bounds": [0, 0, 24, 14],
        "obstacles": halves,
        "goals": [{"id": "g", "circle": {"center": [4, 9], "radius": 1}}],
        "robots": [{"id": "r1", "model": "car", "pose": [20, 4, 0.3]}],
    }
    scene = of_size(scene_from_document(document, source="gap"), 2.0**-5)
    unit_m = Frame.of(scene).unit_m
    assert unit_m < 0.1
    reason = mrmg.plan(scene).reason
    assert f"m and {0.04 * unit_m:g} m to steer" in reason
    assert "m wide near (0.4, 0.2), and it needs 0.04 m: its width of 0.03 m" in reason


def test_fleets_that_differ_in_size_alone_are_equal_in_their_frames() -> None:
    scene, _ = as_it_lies("station_needed")
    frames = [Frame.of(of_size(scene, size)) for size in (2.0**-5, 2.0**-6, 2.0**5)]
    first, *others = (
        frame.scene(of_size(scene, size))
        for frame, size in zip(frames, (2.0**-5, 2.0**-6, 2.0**5), strict=True)
    )
    assert [frame.unit_m for frame in frames] == [2.0**-5, 2.0**-6, 2.0**5]
    for other in others:
        assert other.bounds == first.bounds
        for one, two in zip(first.robots, other.robots, strict=True):
            assert one.pose == two.pose
            assert one.margins == two.margins
            assert one.model.limits == two.model.limits
            assert np.array_equal(one.model.footprint_m, two.model.footprint_m)
        for here, there in zip(first.targets(), other.targets(), strict=True):
            assert here.region.radius_m == there.region.radius_m
            assert np.array_equal(here.region.center, there.region.center)


@pytest.mark.parametrize("unit_m", [0.125, 4.0])
def test_the_unit_of_lengths_leaves_powers_as_they_are(unit_m: float) -> None:
    model = mrmg.load_scene("quickstart").robots[0].model
    rng = np.random.default_rng(0)
    v, a, turn, climb = rng.uniform(-2.0, 2.0, (4, 100))
    multiplier = rng.uniform(1.0, 3.0, 100)
    turn = np.abs(turn)
    powers = [
        each.energy_model.power_parts(v / u, a / u, turn / u, multiplier, climb / u)
        for each, u in ((model, 1.0), (in_unit(model, unit_m), unit_m))
    ]
    assert powers[1] == pytest.approx(powers[0], rel=1e-12)


def test_ordinary_robots_and_wide_maps_have_metres() -> None:
    scene, _ = as_it_lies("two_swap")
    for size in (0.25, 1.0, 1.5):
        assert Frame.of(of_size(scene, size)).unit_m == 1.0
    small = of_size(scene, 2.0**-5)
    wide = replace(small, bounds=(0.0, 0.0, 500.0, 500.0))
    assert Frame.of(wide).unit_m == 1.0
    keeps_away = Margins(obstacle_m=0.5)
    assert Frame.of(small, keeps_away).unit_m == 0.5
