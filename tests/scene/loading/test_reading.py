"""Scenes are built as the file says, and saved scenes load as equal scenes."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrmg import shipped
from mrmg.errors import SceneError
from mrmg.scene.loading import dump_scene, load_scene, scene_from_document
from mrmg.scene.loading.json_schema import scene_schema
from mrmg.scene.loading.yaml_text import read_yaml

EDGE_SCENES = Path(__file__).parents[2] / "scenes"
ALL_SCENES = [
    *shipped.scene_names(),
    *sorted(str(path) for path in EDGE_SCENES.glob("*.yaml")),
]


def document(**changes: Any) -> dict[str, Any]:
    """A valid scene: one car in a field of 20 x 10 m."""
    return {
        "format": 1,
        "name": "field",
        "bounds": [0, 0, 20, 10],
        "robots": [{"id": "r1", "model": "car", "pose": [3, 5, 0]}],
        **changes,
    }


@pytest.mark.parametrize("source", ALL_SCENES, ids=lambda source: Path(source).stem)
def test_saved_scene_loads_equal(source: str, tmp_path: Path) -> None:
    scene = load_scene(source)
    path = tmp_path / "elsewhere.yaml"
    path.write_text(dump_scene(scene))
    again = load_scene(path)
    assert again.digest == scene.digest
    assert again.document == scene.document
    assert again.name == scene.name


@pytest.mark.parametrize("source", ALL_SCENES, ids=lambda source: Path(source).stem)
def test_files_and_documents_follow_the_schema(source: str) -> None:
    validator = jsonschema.Draft202012Validator(scene_schema())
    path = Path(source)
    if source in shipped.scene_names():
        path = shipped.scenes_folder() / f"{source}.yaml"
    validator.validate(read_yaml(path, source=source))
    validator.validate(load_scene(source).document)


@pytest.mark.parametrize("source", ALL_SCENES, ids=lambda source: Path(source).stem)
def test_first_line_says_why_the_scene_exists(source: str) -> None:
    path = Path(source)
    if source in shipped.scene_names():
        path = shipped.scenes_folder() / f"{source}.yaml"
    assert path.read_text().startswith("# Why: ")


def test_name_defaults_to_the_file(tmp_path: Path) -> None:
    path = tmp_path / "meadow.yaml"
    path.write_text("format: 1\nbounds: [0, 0, 20, 1e1]\n")
    scene = load_scene(path)
    assert scene.name == "meadow"
    assert scene.bounds == (0.0, 0.0, 20.0, 10.0)


def test_shapes() -> None:
    scene = scene_from_document(
        document(
            obstacles=[
                {"box": {"center": [10, 5], "size": [4, 2], "yaw": math.pi / 2}},
                {"circle": {"center": [15, 5], "radius": 1}},
                {
                    "id": "yard",
                    "polygon": [[6, 0], [6, 2], [8, 2], [8, 0]],
                    "holes": [[[6.5, 0.5], [7.5, 0.5], [7.5, 1.5], [6.5, 1.5]]],
                    "blocks": ["r1"],
                },
            ]
        ),
        source="test",
    )
    box, disc, yard = scene.obstacles
    assert box.shape.bounds == pytest.approx((9, 3, 11, 7))
    assert (box.id, disc.id, yard.id) == ("obstacle_0", "obstacle_1", "yard")
    assert yard.shape.area == pytest.approx(3.0)
    assert yard.stops("r1")
    assert not yard.stops("r2")
    angle = np.linspace(0, 2 * np.pi, 1000)
    rim = np.stack([15 + np.cos(angle), 5 + np.sin(angle)], axis=1)
    # No point of the true circle may stick out of the polygon that stands for it.
    assert disc.shape.buffer(1e-9).covers(_multipoint(rim))
    assert disc.shape.area == pytest.approx(math.pi, rel=0.01)


def _multipoint(points: np.ndarray) -> Any:
    import shapely

    return shapely.multipoints(points)


@pytest.mark.parametrize(
    ("battery", "own", "capacity_m"),
    [
        ({"capacity_m": 100.0}, None, 100.0),
        ({"capacity_J": 3600.0}, None, None),
        ({"capacity_Wh": 1.0}, None, None),  # the same as 3600 J
        ({"capacity_m": 100.0}, {"capacity_m": 50.0}, 50.0),  # its own comes first
        ({"capacity_m": 100.0}, {"capacity_J": 3600.0}, None),  # also in another unit
    ],
)
def test_capacities(
    battery: dict[str, float], own: dict[str, float] | None, capacity_m: float | None
) -> None:
    robot = {"id": "r1", "model": "car", "pose": [3, 5, 0]}
    if own:
        robot["battery"] = own  # type: ignore[assignment]
    scene = scene_from_document(
        document(battery={**battery, "reserve": 0.1}, robots=[robot]), source="test"
    )
    (loaded,) = scene.robots
    per_metre_J = loaded.model.energy_model.plain_ground_J_per_m()
    expected_J = 3600.0 if capacity_m is None else capacity_m * per_metre_J
    assert loaded.battery.capacity_J == pytest.approx(expected_J)
    assert loaded.battery.start_J == loaded.battery.capacity_J
    assert loaded.battery.reserve_J == pytest.approx(0.1 * expected_J)


def test_standard_battery_without_any_capacity() -> None:
    (robot,) = scene_from_document(document(), source="test").robots
    assert robot.battery.capacity_J == robot.model.battery_capacity_J
    assert robot.battery.reserve_fraction == 0.0


@pytest.mark.parametrize(
    ("start", "share"),
    [(0.25, 0.25), ({"fraction": 0.25}, 0.25), ({"m": 50}, 0.5), (1, 1.0)],
)
def test_start_energy(start: Any, share: float) -> None:
    robots = [{"id": "r1", "model": "car", "pose": [3, 5, 0], "start_energy": start}]
    scene = scene_from_document(
        document(battery={"capacity_m": 100}, robots=robots), source="test"
    )
    battery = scene.robots[0].battery
    assert battery.start_J == pytest.approx(share * battery.capacity_J)


@given(
    x=st.floats(-100, 100),
    y=st.floats(-100, 100),
    radius=st.floats(0.1, 20),
    turns=st.lists(st.floats(0, 2 * math.pi), min_size=3, max_size=9, unique=True),
    reverse=st.booleans(),
)
@settings(max_examples=60)
def test_regions_hold_what_they_say(
    x: float, y: float, radius: float, turns: list[float], reverse: bool
) -> None:
    """Convex polygons are read either way round; their depth agrees with shapely."""
    import shapely

    angle = np.sort(turns)[:: -1 if reverse else 1]
    ring = np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=1)
    hull = shapely.Polygon(ring)
    goal = {"id": "g", "polygon": ring.tolist()}
    big = document(bounds=[-200, -200, 200, 200], goals=[goal])
    if hull.area < 1e-3:
        return
    region = scene_from_document(big, source="test").goals[0].region
    rng = np.random.default_rng(0)
    points = rng.uniform(-1.2, 1.2, (200, 2)) * radius + [x, y]
    depth = region.depth(points)
    clear = np.abs(depth) > 1e-6
    inside = shapely.contains_xy(hull, points[:, 0], points[:, 1])
    assert ((depth > 0) == inside)[clear].all()


def test_one_robot_may_be_charged_as_in_the_paper() -> None:
    robots = [
        {"id": "r1", "model": "car", "pose": [3, 5, 0], "energy": "paper"},
        {"id": "r2", "model": "car", "pose": [3, 8, 0]},
    ]
    scene = scene_from_document(document(robots=robots), source="test")
    first, second = (robot.model.energy_model for robot in scene.robots)
    assert first == second.with_preset("paper")
    assert first != second
    again = scene_from_document(scene.document, source="test")
    assert again.robots[0].model.energy_preset == "paper"
    assert again.digest == scene.digest


def test_digest_sees_every_value() -> None:
    digests = {
        scene_from_document(changed, source="test").digest
        for changed in (
            document(),
            document(name="other"),
            document(bounds=[0, 0, 20, 11]),
            document(battery={"reserve": 0.1}),
            document(goals=[{"id": "g", "circle": {"center": [9, 9], "radius": 1}}]),
            document(robots=[{"id": "r1", "model": "car", "pose": [3, 5, 0.1]}]),
            document(
                robots=[
                    {"id": "r1", "model": "car", "pose": [3, 5, 0], "energy": "paper"}
                ]
            ),
        )
    }
    assert len(digests) == 7


def test_digest_sees_defaults_as_if_written() -> None:
    written = document(
        obstacles=[],
        battery={},
        robots=[{"id": "r1", "model": "car", "pose": [3.0, 5, 0], "start_energy": 1}],
    )
    plain = scene_from_document(document(), source="test")
    assert scene_from_document(written, source="test").digest == plain.digest


def test_a_start_is_named_by_the_robots_own_place() -> None:
    """Also where an obstacle has the same id."""
    wall = {"id": "r1", "circle": {"center": [3, 5], "radius": 1}}
    with pytest.raises(SceneError) as caught:
        scene_from_document(document(obstacles=[wall]), source="test")
    places = {fault.path for fault in caught.value.faults}
    assert places == {"robots.0.id", "robots.0.pose"}


def test_keys_that_are_no_text_are_faults() -> None:
    robot = document()["robots"][0]
    odd = {**robot, "model": {"like": "car", 5: 1}}
    with pytest.raises(SceneError, match=r"robots.0.model .*5: got 5; keys must be"):
        scene_from_document(document(robots=[odd]), source="test")


def test_own_model_by_folder(tmp_path: Path) -> None:
    """A model in a folder beside the scene; the same values give the same digest."""
    shutil.copytree(shipped.models_folder() / "car", tmp_path / "mine" / "car")
    path = tmp_path / "scenes" / "field.yaml"
    path.parent.mkdir()
    path.write_text(
        "format: 1\nname: field\nbounds: [0, 0, 20, 10]\n"
        "robots:\n  - {id: r1, model: ../mine/car, pose: [3, 5, 0]}\n"
    )
    scene = load_scene(path)
    assert scene.robots[0].model.mjcf == tmp_path / "mine" / "car" / "car.xml"
    assert scene.digest == scene_from_document(document(), source="test").digest
    elsewhere = tmp_path / "run" / "scene.yaml"
    elsewhere.parent.mkdir()
    elsewhere.write_text(dump_scene(scene))
    assert load_scene(elsewhere).digest == scene.digest

    yaml_path = tmp_path / "mine" / "car" / "robot.yaml"
    yaml_path.write_text(yaml_path.read_text().replace("mass: 180.0", "mass: 181.0"))
    assert load_scene(path).digest != scene.digest


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
        lambda inner: (
            st.lists(inner, max_size=4)
            | st.dictionaries(
                st.sampled_from(
                    ["id", "polygon", "circle", "box", "center", "radius", "pose"]
                ),
                inner,
                max_size=4,
            )
        ),
        max_leaves=8,
    ),
    st.sampled_from(["bounds", "obstacles", "goals", "robots", "battery", "terrain"]),
)
def test_no_content_ends_in_anything_but_faults(value: Any, key: str) -> None:
    try:
        scene = scene_from_document(document(**{key: value}), source="test")
    except SceneError as error:
        assert error.faults
        assert all(fault.path for fault in error.faults)
    else:
        again = scene_from_document(scene.document, source="test")
        assert again.digest == scene.digest
