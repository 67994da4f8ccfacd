"""Scenes are changed by the keys of their files, under the loader's checks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg import shipped
from mrmg.errors import SceneError
from mrmg.scene.elevation import Elevation
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.margins import STATES_NONE, Margins
from mrmg.scene.objective import MAKESPAN
from mrmg.scene.types import Scene


def field(**changes: Any) -> Scene:
    """Two cars, the second with a battery of its own."""
    robots = [
        {"id": "r1", "model": "car", "pose": [4, 5, 0], "start_energy": 0.5},
        {
            "id": "r2",
            "model": "car",
            "pose": [4, 15, 0],
            "battery": {"capacity_Wh": 5, "charging_power": 100},
        },
    ]
    document = {
        "format": 1,
        "name": "field",
        "bounds": [0, 0, 40, 20],
        "obstacles": [{"circle": {"center": [20, 15], "radius": 1}}],
        "goals": [{"id": "g1", "circle": {"center": [30, 5], "radius": 1}}],
        "battery": {"capacity_m": 200, "reserve": 0.1},
        "robots": robots,
        **changes,
    }
    return scene_from_document(document, source="field")


@pytest.mark.parametrize("name", ["scene1", "hills", "mixed"])
def test_a_change_is_what_the_file_with_it_loads_as(name: str) -> None:
    scene = load_scene(name)
    wanted = {**scene.document, "objective": "makespan"}
    changed = scene.with_(objective="makespan")
    assert changed == scene_from_document(wanted, source="x") != scene


def test_batteries_of_the_whole_fleet() -> None:
    scene = field()
    per_m = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    first, second = scene.with_(battery={"capacity_m": 300}).robots
    for robot in (first, second):
        assert robot.battery.capacity_J == pytest.approx(300 * per_m)
        assert robot.battery.reserve_fraction == 0.1
    assert first.battery.start_J == pytest.approx(150 * per_m)  # still half full
    assert not first.battery.takes_time_to_fill
    assert second.battery.charging_power_W == 100
    full, own = scene.with_(battery={"reserve": 0.2}).robots
    assert full.battery.capacity_J == pytest.approx(200 * per_m)
    assert own.battery.capacity_J == 5 * 3600
    assert (full.battery.reserve_fraction, own.battery.reserve_fraction) == (0.2, 0.2)


def test_batteries_of_a_scene_changed_in_memory() -> None:
    scene = field()
    r1 = scene.robots[0]
    edited = replace(scene, robots=(replace(r1, pose=(5.0, 5.0, 0.0)), scene.robots[1]))
    wide = edited.with_(battery={"capacity_J": 9000.0})
    assert [robot.battery.capacity_J for robot in wide.robots] == [9000.0, 9000.0]
    assert wide.robots[0].pose == (5.0, 5.0, 0.0)
    assert wide.robots[0].battery.start_J == 4500.0


@pytest.mark.parametrize("stated", [STATES_NONE, Margins(robot_m=0.5)])
def test_a_robot_may_state_fewer_margins_than_the_fleet(stated: Margins) -> None:
    scene = field(margins={"obstacle": 0.3, "robot": 0.4})
    r1, r2 = scene.robots
    edited = replace(scene, robots=(replace(r1, margins=stated), r2))
    again = scene_from_document(edited.document, source="again")
    assert again == edited
    assert [robot.margins for robot in again.robots] == [stated, r2.margins]
    assert "margins" not in edited.document


def test_one_robot() -> None:
    scene = field()
    changed = scene.with_robot("r2", battery={"capacity_J": 7e3}, pose=(6, 15, 0.1))
    r1, r2 = changed.robots
    assert r1 == scene.robots[0]
    assert r2.battery.capacity_J == 7e3
    assert r2.battery.charging_power_W == 100
    assert r2.pose == (6.0, 15.0, 0.1)
    plain = scene.with_robot("r2", battery=None).robots[1].battery
    assert plain.capacity_J == scene.with_(battery={}).robots[0].battery.capacity_J
    softer = scene.with_robot("r1", model={"like": "car", "rolling_coefficient": 0.09})
    assert softer.robots[0].model.rolling_coefficient == 0.09
    assert softer.robots[0].model.mass_kg == scene.robots[0].model.mass_kg
    again = scene_from_document(softer.document, source="again")
    assert again == softer != scene


def test_lists_mix_entries_and_values() -> None:
    scene = field()
    goal = {"id": "g2", "circle": {"center": np.array([12.0, 5.0]), "radius": 1}}
    both = scene.with_(goals=[*scene.goals, goal])
    assert [item.id for item in both.goals] == ["g1", "g2"]
    other = load_scene("quickstart")
    mixed = scene.with_(
        bounds=other.bounds,
        obstacles=other.obstacles,
        goals=other.goals,
        stations=other.stations,
        robots=other.robots,
        terrain=other.terrain,
        name=other.name,
    )
    assert mixed == replace(
        other, objective=scene.objective, time_limit_s=scene.time_limit_s
    )
    fewer = scene.with_(obstacles=[other.obstacles[0], *scene.obstacles])
    assert fewer.obstacles == (other.obstacles[0], *scene.obstacles)


def test_none_takes_back() -> None:
    scene = field(time_limit=100, objective="makespan")
    free = scene.with_(time_limit=None, objective=None)
    assert free == field()
    assert free.with_(time_limit=float("inf")) == free
    assert free.with_(objective=MAKESPAN, time_limit=100) == scene


def test_a_relief_goes_with_new_bounds() -> None:
    hills = load_scene("hills")
    x_min, y_min, x_max, y_max = hills.bounds
    wider = hills.with_(bounds=[x_min, y_min, x_max + 10, y_max])
    assert wider.elevation is not None
    assert wider.elevation.bounds == wider.bounds
    flat = Elevation(bounds=hills.bounds, height_m=np.zeros((2, 2)))
    assert hills.with_(elevation=flat).digest != hills.with_(elevation=None).digest


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time_limit_s": 5}, r"time_limit_s: unknown key \(did you mean 'time_limit'"),
        ({"time_limit_s": None}, r"time_limit_s: unknown key \(did you"),
        ({"batery": {}}, r"batery: unknown key \(did you mean 'battery'"),
        ({"battery": {"capacity": 3}}, r"battery.capacity: unknown key"),
        ({"battery": {"capacity": None}}, r"battery.capacity: unknown key"),
        ({"battery": 300}, "expected a mapping with keys"),
        ({"goals": [{"id": "r1", "circle": {}}]}, "goals.0"),
        ({"robots": [{"id": "a", "model": "cat", "pose": [1, 1, 0]}]}, "mean 'car'"),
        ({"time_limit": -1}, "time_limit: got -1"),
        ({"bounds": [0, 0, 10, 10]}, "lies outside the bounds"),
    ],
)
def test_faults_are_those_of_files(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        field().with_(**changes)


@pytest.mark.parametrize(
    ("robot", "changes", "message"),
    [
        ("r3", {}, "no robot 'r3'.*; robots: r1, r2"),
        ("r2", {"position": [1, 1, 0]}, r"robots.1.position \(r2\): unknown key"),
        ("r2", {"position": None}, r"robots.1.position \(r2\): unknown key"),
        ("r1", {"pose": [20, 15, 0]}, "starts on the obstacle 'obstacle_0'"),
        ("r1", {"model": {"mass": 3}}, "robots.0.model.*like"),
        ("r1", {"model": {"like": "car", "masss": 3}}, "did you mean 'mass'"),
    ],
)
def test_faults_of_one_robot(robot: str, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        field().with_robot(robot, **changes)


def test_relative_models_lie_beside_the_scenes_file(tmp_path: Path) -> None:
    import shutil

    shutil.copytree(shipped.models_folder() / "car", tmp_path / "mine" / "car")
    path = tmp_path / "field.yaml"
    path.write_text("format: 1\nbounds: [0, 0, 20, 10]\n")
    scene = mrmg.load_scene(path).with_(
        robots=[{"id": "r1", "model": "./mine/car", "pose": [3, 5, 0]}]
    )
    assert scene.robots[0].model.mjcf == tmp_path / "mine" / "car" / "car.xml"
