"""A scene's digest is that of its values, and its document says what they are."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from shapely.geometry import Polygon

import mrmg
from mrmg import shipped
from mrmg.errors import SceneError
from mrmg.scene.content import content_digest
from mrmg.scene.loading import (
    dump_scene,
    load_scene,
    scene_from_document,
)
from mrmg.scene.loading.yaml_text import parse_yaml
from mrmg.scene.motor import Motor
from mrmg.scene.region import Region
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Battery, Goal, Robot, Scene

EDGE_SCENES = Path(__file__).parents[1] / "scenes"
ALL_SCENES = [
    *shipped.scene_names(),
    *sorted(str(path) for path in EDGE_SCENES.glob("*.yaml")),
]

RICH = {
    "format": 1,
    "name": "rich",
    "bounds": [0, 0, 40, 20],
    "obstacles": [
        {"circle": {"center": [20, 15], "radius": 1}, "blocks": ["r1"]},
        {
            "id": "yard",
            "polygon": [[30, 1], [38, 1], [38, 6], [30, 6]],
            "holes": [[[31, 2], [33, 2], [33, 4], [31, 4]]],
            "height": 2.0,
        },
    ],
    "terrain": [
        {"id": "mud", "box": {"center": [10, 10], "size": [4, 3]}, "multiplier": 2.0}
    ],
    "elevation": {"grid": [[0, 0.1, 0.2], [0, 0.05, 0.1]]},
    "goals": [
        {"id": "g1", "circle": {"center": [20, 5], "radius": 1}, "dwell": 3},
        {"id": "g2", "polygon": [[24, 8], [27, 8], [26, 11]]},
    ],
    "stations": [
        {"id": "s1", "circle": {"center": [15, 5], "radius": 1}, "capacity": 1}
    ],
    "battery": {"capacity_m": 150, "reserve": 0.1, "charging_power": 300},
    "objective": {"energy": 1, "makespan": 20},
    "time_limit": 500,
    "robots": [
        {
            "id": "r1",
            "model": "car",
            "pose": [4, 5, 0],
            "start_energy": 0.7,
            "rolling_factor": 1.1,
            "finish": "start",
        },
        {
            "id": "r2",
            "model": "diffdrive",
            "pose": [4, 15, 0.5],
            "battery": {"capacity_Wh": 3},
            "finish": {"circle": {"center": [8, 15], "radius": 2}, "heading": 1.0},
        },
    ],
}


def rich() -> Scene:
    return scene_from_document(RICH, source="rich")


def again(scene: Scene) -> Scene:
    """Return the scene that its document describes, by way of a file's text."""
    document = parse_yaml(dump_scene(scene), source="again")
    return scene_from_document(document, source="again")


@pytest.mark.parametrize("source", ALL_SCENES, ids=lambda source: Path(source).stem)
def test_every_scene_comes_back_from_its_document(source: str) -> None:
    """As it was written, and in the plain terms of values changed in memory."""
    scene = load_scene(source)
    assert scene_from_document(scene.document, source="again") == scene
    plain = replace(scene, written=None)
    assert plain.digest == scene.digest
    back = scene_from_document(plain.document, source="plain")
    assert back.digest == scene.digest
    assert back == scene


NO_CONTENT = {
    (RobotModel, "name"),
    (RobotModel, "mjcf"),
    (RobotModel, "files"),
    (RobotModel, "origin"),
    (Scene, "written"),
}
"""What a model is called and where it lies; how a scene was put."""


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the ways to all fields of dataclasses and tuples of them in a value."""
    if is_dataclass(value):
        for field in fields(value):
            if (type(value), field.name) not in NO_CONTENT:
                yield from leaves(getattr(value, field.name), (*path, field.name))
    elif isinstance(value, tuple) and value and is_dataclass(value[0]):
        yield (*path, "drop")
        for index, item in enumerate(value):
            yield from leaves(item, (*path, index))
    else:
        yield path


MISSING: dict[str, Any] = {
    "blocks": ("r1",),
    "heading_rad": 0.3,
    "skid_track_m": 0.7,
    "obstacle_m": 0.1,
    "robot_m": 0.3,
    "motor": Motor(
        torque_constant_Nm_A=0.05,
        back_emf_constant_V_s=0.05,
        resistance_Ohm=0.3,
        gear_ratio=40.0,
        gear_efficiency=0.8,
        no_load_current_A=1.0,
    ),
}
"""Values of what may be left out."""


def changed(value: Any, path: tuple[Any, ...]) -> Any:
    """Return a value with something at a path changed."""
    if not path:
        return other(value)
    first, *rest = path
    if not rest and getattr(value, str(first), 0) is None:
        return replace(value, **{first: MISSING[str(first)]})
    if first == "drop":
        return value[:-1]
    if isinstance(first, int):
        new = changed(value[first], tuple(rest))
        return (*value[:first], new, *value[first + 1 :])
    return replace(value, **{first: changed(getattr(value, first), tuple(rest))})


def other(value: Any) -> Any:
    """Return a value of the same kind that is a little different."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, float | int):
        return 2 * value + 1 if value < 1e3 and isinstance(value, int) else value + 0.01
    if isinstance(value, str):
        return {"full": "paper", "car": "unicycle", "unicycle": "car"}.get(
            value, f"{value}x"
        )
    if isinstance(value, np.ndarray):
        moved = np.asarray(value, dtype=float).copy()
        moved[..., 0] += 0.01
        return moved if moved.size else np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    if isinstance(value, Polygon):
        return shapely.transform(value, lambda points: points + 0.01)
    if isinstance(value, tuple):
        return (*value[:-1], other(value[-1])) if value else ("r1",)
    raise AssertionError(value)


REFUSED = {
    "bounds",
    "blocks",
    "center",
    "corners",
    "radius_m",
    "footprint_m",
    "motion_model",
    "heading_rad",
    "id",
    "start_J",
    # Of another robot than the MJCF describes:
    "center_of_mass_m",
    "mass_kg",
    "skid_track_m",
    "track_m",
    "wheel_count",
    "wheel_radius_m",
    "wheelbase_m",
    # A whole of its own, which the robots at hand have not:
    "motor",
    # Of planning alone:
    "unit_m",
}
"""Changed alone these make no valid scene, or none that a file can state."""


@pytest.mark.parametrize("path", list(leaves(rich())), ids=lambda path: str(path))
def test_every_value_counts_and_is_written_or_refused(path: tuple[Any, ...]) -> None:
    scene = rich()
    edited = changed(scene, path)
    digest = edited.digest
    assert digest != scene.digest
    assert edited != scene
    try:
        back = again(edited)
    except SceneError as error:
        assert error.faults
        assert path[-1] in REFUSED, error
    else:
        assert back.digest == digest


def test_what_a_model_is_called_does_not_count() -> None:
    scene = rich()
    model = replace(scene.robots[0].model, name="other")
    renamed = replace(scene.robots[0], model=model)
    assert replace(scene, robots=(renamed, scene.robots[1])) == scene


def test_values_that_did_not_change_stay_as_written() -> None:
    scene = rich()
    r1, r2 = scene.robots
    bigger = replace(r2.battery, capacity_J=20000.0)
    document = replace(
        scene, robots=(r1, replace(r2, battery=bigger)), time_limit_s=float("inf")
    ).document
    assert "time_limit" not in document
    assert document["obstacles"] == scene.document["obstacles"]
    assert document["robots"][0] == scene.document["robots"][0]
    assert document["robots"][1]["battery"]["capacity_J"] == 20000.0


def test_a_document_is_the_callers_to_change() -> None:
    scene = rich()
    scene.document["goals"][0]["dwell"] = 99
    assert scene.document["goals"][0]["dwell"] == 3


def test_a_shape_counts_whichever_way_its_corners_go() -> None:
    scene = rich()
    corners = scene.goals[1].region.corners
    region = replace(scene.goals[1].region, corners=np.roll(corners, 1, axis=0))
    turned = replace(scene.obstacles[1], shape=scene.obstacles[1].shape.reverse())
    same = replace(
        scene,
        goals=(scene.goals[0], replace(scene.goals[1], region=region)),
        obstacles=(scene.obstacles[0], turned),
    )
    assert same == scene == again(same)


@pytest.mark.parametrize("kind", [int, np.int64, np.float32, np.float64])
def test_numbers_count_by_their_value(kind: Any) -> None:
    """Also where they are the default."""
    scene = rich()
    first, second = scene.goals
    goals = (replace(first, dwell_s=kind(3)), replace(second, dwell_s=kind(0)))
    assert replace(scene, goals=goals, time_limit_s=kind(500)) == scene


def test_an_instant_charge_is_written_against_the_fleets_power() -> None:
    scene = rich()
    at_once = replace(scene.robots[0].battery, charging_power_W=float("inf"))
    robots = (replace(scene.robots[0], battery=at_once), scene.robots[1])
    edited = replace(scene, robots=robots)
    assert again(edited) == edited


def test_a_scene_made_in_memory_is_written_down() -> None:
    car = load_scene("quickstart").robots[0].model
    scene = Scene(
        name="bare",
        bounds=(0.0, 0.0, 20.0, 20.0),
        obstacles=(),
        terrain=(),
        goals=(
            Goal(
                id="g",
                region=Region(
                    center=np.array([12.0, 10.0]),
                    radius_m=1.0,
                    corners=np.zeros((0, 2)),
                ),
            ),
        ),
        stations=(),
        robots=(
            Robot(
                id="r1",
                model=car,
                pose=(4, 10, 0),
                battery=Battery(capacity_J=9e3, start_J=8e3, reserve_fraction=0.1),
            ),
        ),
    )
    assert again(scene) == scene


def test_a_model_without_a_folder_is_refused_by_name() -> None:
    scene = rich()
    own = replace(scene.robots[0], model=replace(scene.robots[0].model, origin=None))
    with pytest.raises(SceneError, match="r1's model 'car'.* was made in memory"):
        _ = replace(scene, robots=(own, scene.robots[1])).document


@pytest.mark.parametrize(
    "shape",
    [
        shapely.MultiPolygon([shapely.box(9, 2, 10, 3), shapely.box(12, 2, 13, 3)]),
        Polygon(),
    ],
)
def test_what_is_no_polygon_is_refused(shape: Any) -> None:
    scene = rich()
    walls = (replace(scene.obstacles[0], shape=shape), scene.obstacles[1])
    with pytest.raises(SceneError, match="rich: 1 fault\n.*expected one polygon"):
        dump_scene(replace(scene, obstacles=walls))


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_are_refused(number: float) -> None:
    """Before they are planned with: kernels would not return from some of them."""
    scene = rich()
    wild = replace(
        scene,
        robots=(replace(scene.robots[0], pose=(4.0, number, 0.0)), scene.robots[1]),
        goals=(replace(scene.goals[0], id="nan", dwell_s=number), scene.goals[1]),
        elevation=replace(scene.elevation, height_m=np.full((2, 2), number)),
    )
    where = r"3 faults\n.*dwell_s: .*\n.*robots.0.pose.1: .*\n.*height_m.1: "
    for use in (mrmg.plan, lambda _: wild.digest):
        with pytest.raises(SceneError, match=where):
            use(wild)


def test_what_a_file_would_read_otherwise_is_refused() -> None:
    scene = rich()
    other = replace(scene.goals[0], id="g1", region=scene.goals[1].region, dwell_s=-1.0)
    with pytest.raises(SceneError, match=r"goals.0.*dwell"):
        dump_scene(replace(scene, goals=(other, scene.goals[1])))


def own_model(folder: Path, document: dict[str, Any] | None = None) -> Scene:
    """Return a scene with the car in a folder of one's own, with a mesh."""
    if not folder.exists():
        shutil.copytree(shipped.models_folder() / "car", folder / "car")
        (folder / "car" / "parts").mkdir()
        xml = folder / "car" / "car.xml"
        text = xml.read_text()
        asset = '<include file="parts/more.xml"/>'
        xml.write_text(text.replace("</mujoco>", f"{asset}</mujoco>"))
        (folder / "car" / "parts" / "more.xml").write_text(
            '<mujoco><compiler meshdir="../meshes"/><asset>'
            '<mesh name="box" file="box.obj"/></asset></mujoco>'
        )
        (folder / "meshes").mkdir()
        corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
        sides = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
        (folder / "meshes" / "box.obj").write_text(corners + sides)
    robots = [{"id": "r1", "model": f"{folder}/car", "pose": [4, 5, 0]}]
    field = {"format": 1, "name": "field", "bounds": [0, 0, 20, 10], "robots": robots}
    return scene_from_document({**field, **(document or {})}, source="field")


@pytest.mark.parametrize(
    "file", ["car/car.xml", "car/parts/more.xml", "meshes/box.obj"]
)
def test_an_edited_file_of_a_model_is_another_scene(tmp_path: Path, file: str) -> None:
    folder = tmp_path / "own"
    scene = own_model(folder)
    assert own_model(folder) == scene
    with (folder / file).open("a") as edited:
        edited.write("# edited" if file.endswith(".obj") else "<!-- edited -->")
    assert own_model(folder) != scene
    (changed_file,) = scene.robots[0].model.files.changed()
    assert changed_file.resolve() == (folder / file).resolve()
    # A value once loaded stays what it is.
    assert replace(scene, name="field").digest == scene.digest


def test_a_field_of_a_later_version_leaves_digests_as_they_are() -> None:
    @dataclass(frozen=True)
    class Now:
        x: float
        time_limit_s: float = float("inf")

    @dataclass(frozen=True)
    class Later(Now):
        slope: str | None = None
        shares: tuple[float, ...] = (0.5,)

    assert content_digest(Later(1.0)) == content_digest(Now(1.0))
    assert content_digest(Later(1.0, slope="avoid")) != content_digest(Now(1.0))
    assert content_digest(Now(1.0, 5.0)) != content_digest(Now(1.0))
