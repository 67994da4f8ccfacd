"""The ways of stating an elevation give the same ground; bad ones are named."""

from __future__ import annotations

import re
import struct
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import shapely
import yaml
from PIL import Image

from mrmg.errors import SceneError
from mrmg.scene.loading import dump_scene, load_scene, scene_from_document
from mrmg.scene.loading.json_schema import scene_schema
from mrmg.scene.slopes import steepest_climb
from mrmg.scene.types import Scene

NORTH_UP = np.array([[0.0, 0.5, 1.0], [0.0, 0.2, 0.4]])
"""Heights of a map of 20 x 10 m: level in the west, highest in the north-east."""


def make_scene(elevation: Any, base: Path | None = None, **changes: Any) -> Scene:
    document = {
        "format": 1,
        "name": "field",
        "bounds": [0, 0, 20, 10],
        "elevation": elevation,
        "robots": [{"id": "r1", "model": "car", "pose": [3, 5, 0]}],
        **changes,
    }
    return scene_from_document(document, source="field", base=base)


def heights(scene: Scene) -> np.ndarray:
    assert scene.elevation is not None
    return scene.elevation.height_m


def test_a_grid_is_read_like_a_map_north_up() -> None:
    scene = make_scene({"grid": NORTH_UP.tolist()})
    assert scene.elevation is not None
    corners = np.array([[20.0, 10.0], [20.0, 0.0], [0.0, 10.0], [10.0, 0.0]])
    assert scene.elevation.height_at(corners).tolist() == [1.0, 0.4, 0.0, 0.2]


def test_files_of_metres_and_grey_pictures_say_the_same(tmp_path: Path) -> None:
    np.save(tmp_path / "hills.npy", NORTH_UP)
    grey = np.round(NORTH_UP * 255.0).astype(np.uint8)
    Image.fromarray(grey).save(tmp_path / "eight.png")
    fine = np.round(NORTH_UP * 65535.0).astype(np.uint16)
    Image.fromarray(fine).save(tmp_path / "sixteen.png")
    expected = heights(make_scene({"grid": NORTH_UP.tolist()}))
    for entry, tolerance in (
        ({"file": "hills.npy"}, 1e-12),
        ({"file": "eight.png", "range": [0, 1]}, 0.5 / 255 + 1e-4),
        ({"file": "sixteen.png", "range": [0, 1]}, 1e-4),
    ):
        found = heights(make_scene(entry, tmp_path))
        np.testing.assert_allclose(found, expected, atol=tolerance)
    sunk = heights(make_scene({"file": "sixteen.png", "range": [-1, -0.5]}, tmp_path))
    np.testing.assert_allclose(sunk, -1.0 + 0.5 * expected, atol=1e-4)


def test_a_hill_has_its_height_its_radius_and_no_edge() -> None:
    hill = {"center": [10, 5], "height": 0.5, "radius": 5}
    scene = make_scene({"hills": [hill], "cell": 0.1})
    assert scene.elevation is not None
    away = np.array([0.0, 2.5, 5.0, 6.0])
    points = np.stack([10.0 + away, np.full(4, 5.0)], axis=1)
    expected = [0.5, 0.25, 0.0, 0.0]
    assert scene.elevation.height_at(points) == pytest.approx(expected, abs=1e-3)
    assert scene.elevation.steepest().max() == pytest.approx(
        0.5 * np.pi / 10.0, rel=0.02
    )
    hollow = {**hill, "height": -0.5}
    level = make_scene({"hills": [hill, hollow]})
    assert np.abs(heights(level)).max() < 1e-12


@pytest.mark.parametrize("form", ["grid", "file", "hills"])
def test_saved_scenes_need_no_other_file(form: str, tmp_path: Path) -> None:
    np.save(tmp_path / "hills.npy", NORTH_UP + 1e-5 * np.pi)
    entry: dict[str, Any] = {
        "grid": {"grid": NORTH_UP.tolist()},
        "file": {"file": "hills.npy"},
        "hills": {"hills": [{"center": [10, 5], "height": 0.5, "radius": 5}]},
    }[form]
    scene = make_scene(entry, tmp_path)
    jsonschema.Draft202012Validator(scene_schema()).validate(scene.document)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "scene.yaml").write_text(dump_scene(scene))
    again = load_scene(elsewhere / "scene.yaml")
    np.testing.assert_array_equal(heights(again), heights(scene))
    assert again.digest == scene.digest
    assert again.document == scene.document


def test_digests_see_heights() -> None:
    flat = make_scene({"grid": [[0, 0], [0, 0]]})
    assert flat.digest != make_scene({"grid": [[0, 0], [0, 0.1]]}).digest
    assert not heights(flat).any()
    assert not heights(flat).flags.writeable


def save(path: Path, name: str) -> None:
    if name == "flat.npy":
        np.save(path / name, np.zeros(4))
    elif name == "text.npy":
        np.save(path / name, np.array([["high", "low"], ["low", "low"]]))
    elif name == "hole.npy":
        np.save(path / name, np.array([[0.0, 0.0], [np.nan, 0.0]]))
    elif name == "colour.png":
        Image.new("RGB", (3, 3)).save(path / name)
    elif name == "grey.png":
        Image.new("L", (3, 3)).save(path / name)
    elif name == "zipped.npy":
        with (path / name).open("wb") as file:
            np.savez(file, np.zeros((2, 2)))
    elif name in ("unclosed.npy", "vast.npy"):
        shape = "(2, 2" if name == "unclosed.npy" else "(10000000, 10000000)"
        head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}"
        head = f"{head:<117}\n"
        length = struct.pack("<H", len(head))
        (path / name).write_bytes(b"\x93NUMPY\1\0" + length + head.encode())
    elif name in ("vast.png", "torn.png"):
        side = 60_000 if name == "vast.png" else 3
        chunks = [struct.pack(">4sIIBBBBB", b"IHDR", side, side, 8, 0, 0, 0, 0)]
        chunks += [b"IDAT" + zlib.compress(bytes(12))[:4], bytes(4)]
        data = b"\x89PNG\r\n\x1a\n"
        for chunk in chunks:
            data += struct.pack(">I", len(chunk) - 4) + chunk
            data += struct.pack(">I", zlib.crc32(chunk))
        (path / name).write_bytes(data)
    else:
        (path / name).write_text("no such format")


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({}, r"elevation: has no heights; expected exactly one of file, grid, hills"),
        (
            {"grid": [[0, 0], [0, 0]], "file": "a.npy"},
            r"has file and grid; expected exactly one",
        ),
        ({"file": "hils.npy"}, r"got 'hils.npy'; no such file"),
        ({"file": "grey.pgm"}, r"expected .npy \(heights in m\) or .png"),
        ({"file": "broken.npy"}, r"'broken.npy' is no readable .npy file"),
        ({"file": "zipped.npy"}, r"'zipped.npy' is no readable .npy file"),
        ({"file": "unclosed.npy"}, r"'unclosed.npy' is no readable .npy file"),
        ({"file": "vast.npy"}, r"'vast.npy' is no readable .npy file"),
        ({"file": "vast.png", "range": [0, 1]}, r"'vast.png' is no readable picture"),
        ({"file": "torn.png", "range": [0, 1]}, r"'torn.png' is no readable picture"),
        ({"file": f"{'long' * 99}.npy"}, r"elevation.file: got 'long.*; no such file"),
        ({"file": "broken.png", "range": [0, 1]}, r"is no readable picture"),
        ({"file": "grey.png"}, r"elevation.range: missing; expected \[height of bl"),
        ({"file": "colour.png", "range": [0, 1]}, r"kind RGB; expected plain grey"),
        ({"file": "flat.npy"}, r"elevation.file: is 4; expected at least 2 x 2"),
        ({"file": "text.npy"}, r"holds <U4; expected numbers, metres"),
        ({"file": "hole.npy"}, r"is nan at row 1, column 0; expected finite"),
        ({"grid": [[0, 0], [0]]}, r"rows of 1 to 2 numbers; must be equal"),
        ({"grid": [[0, 0], [0, 0]], "range": [0, 1]}, r"belongs to a picture"),
        ({"grid": [[0, 0], [0, 0]], "cell": 1}, r"belongs to hills"),
        (
            {"hills": [{"center": [5, 5], "height": 1, "radius": 9}], "cell": 0.001},
            r"would have 10001 x 20001 heights within these bounds; at most 1000000",
        ),
        (
            {"packed": {"rows": 2, "columns": 2, "heights": "???"}},
            r"elevation.packed.heights: got '\?\?\?'; not what was once packed",
        ),
        (
            {"packed": {"rows": 2, "columns": 2, "heights": "größe"}},
            r"elevation.packed.heights: got 'größe'; not what was once packed",
        ),
        (
            {"packed": {"rows": 2, "columns": 2, "heights": "eJwDAAAAAAE="}},
            r"holds 0 heights; expected 2 x 2",
        ),
        (
            {"packed": {"rows": 2000, "columns": 2000, "heights": "eJwDAAAAAAE="}},
            r"expected 2000 x 2000, at most 1000000 in all",
        ),
        ({"hils": []}, r"did you mean 'hills'\?"),
        (
            {"grid": [[0, 0, 3], [0, 0, 3]]},
            r"rises by 30 % at \(15.0, 5.0\), where r1 climbs at most 21 %",
        ),
    ],
)
def test_bad_elevations(entry: dict[str, Any], message: str, tmp_path: Path) -> None:
    name = str(entry.get("file", "none"))
    if name not in ("hils.npy", "none", "a.npy") and len(name) < 99:
        save(tmp_path, name)
    with pytest.raises(SceneError, match=message) as caught:
        make_scene(entry, tmp_path)
    assert len(caught.value.faults) == 1


STEEP = {"grid": [[0, 0, 3], [0, 0, 3]]}


def test_steep_ground_below_an_obstacle_does_no_harm() -> None:
    wall = {"id": "cliff", "polygon": [[8, 0], [20, 0], [20, 10], [8, 10]]}
    scene = make_scene(STEEP, obstacles=[wall])
    assert heights(scene).max() == 3.0
    others = {**wall, "blocks": ["r1"]}
    robots = [
        {"id": "r1", "model": "car", "pose": [3, 5, 0]},
        {"id": "r2", "model": "car", "pose": [3, 8, 0]},
    ]
    with pytest.raises(SceneError, match="where r2 climbs at most"):
        make_scene(STEEP, obstacles=[others], robots=robots)


def test_heavy_ground_leaves_less_grip_for_slopes() -> None:
    gentle = {"grid": [[0, 1, 2], [0, 1, 2]]}
    make_scene(gentle)
    mud = {"id": "mud", "polygon": [[0, 0], [20, 0], [20, 10], [0, 10]]}
    with pytest.raises(
        SceneError, match=r"climbs at most 9 % \(friction 1, terrain x3"
    ):
        make_scene(gentle, terrain=[{**mud, "multiplier": 3}])


RIDGE = {
    "grid": np.clip(0.3 * (6 - np.abs(np.arange(21) - 10.0)), 0, 1.2)[None]
    .repeat(11, axis=0)
    .tolist()
}
"""A ridge across the map: 30 % from x = 4 to 8 and from 12 to 16, level on its top."""


def test_the_refusal_names_avoiding_as_a_remedy() -> None:
    with pytest.raises(SceneError, match="add 'slope: avoid' to it"):
        make_scene(RIDGE)


@pytest.mark.parametrize("excess", [1e-2, 1e-4, 1e-7])
def test_slopes_in_the_refusal_differ_as_the_slopes_do(excess: float) -> None:
    model = make_scene({"grid": [[0, 0], [0, 0]]}).robots[0].model
    allowed = float(steepest_climb(model, np.ones(1))[0])
    rise_m = 20 * (allowed + excess)
    with pytest.raises(SceneError) as caught:
        make_scene({"grid": [[0, rise_m], [0, rise_m]]})
    (message,) = (fault.message for fault in caught.value.faults)
    figures = re.findall(r"by ([\d.]+) % .* at most ([\d.]+) %", message)
    ((found, most),) = figures
    assert float(found) > float(most)


def test_steep_ground_is_an_obstacle_of_those_it_stops() -> None:
    robots = [
        {"id": "r1", "model": "car", "pose": [1, 5, 0]},
        {"id": "r2", "model": "diffdrive", "pose": [1, 8, 0]},
    ]
    scene = make_scene({**RIDGE, "slope": "avoid"}, robots=robots)
    assert scene.obstacles == ()
    stopped = {name for item in scene.barriers for name in item.blocks or ()}
    assert stopped == {"r1", "r2"}
    x, y = np.random.default_rng(1).uniform([0, 0], [20, 10], (2000, 2)).T
    assert scene.elevation is not None
    grade = np.hypot(*scene.elevation.gradient_at(np.stack([x, y], axis=1)).T)
    for robot in scene.robots:
        walls = [item.shape for item in scene.barriers if item.stops(robot.id)]
        inside = shapely.contains_xy(shapely.union_all(walls), x, y)
        allowed = float(steepest_climb(robot.model, np.ones(1))[0])
        assert inside[grade > allowed].all()
        half_m = 0.5 * min(scene.elevation.cell_m)
        near = shapely.distance(shapely.points(x, y), shapely.union_all(walls)) > 0
        assert near[(x > 8 + half_m) & (x < 12 - half_m)].all()
    easy = make_scene({"grid": [[0, 0], [1, 1]], "slope": "avoid"})
    assert easy.barriers == ()


def test_avoiding_survives_the_scenes_document(tmp_path: Path) -> None:
    np.save(tmp_path / "ridge.npy", np.array(RIDGE["grid"]))
    for entry in (RIDGE, {"file": "ridge.npy"}):
        scene = make_scene({**entry, "slope": "avoid"}, tmp_path, robots=ASIDE)
        again = scene_from_document(yaml.safe_load(dump_scene(scene)), source="again")
        assert again.digest == scene.digest
        assert len(again.barriers) == len(scene.barriers) > 0
        flat = make_scene(
            {"grid": [[0, 0], [0, 0]], "slope": "avoid"}, tmp_path, robots=ASIDE
        )
        moved = replace(flat, elevation=scene.elevation)
        output = scene_from_document(moved.document, source="output")
        assert len(output.barriers) == len(scene.barriers)


def test_nobody_starts_on_ground_too_steep() -> None:
    robots = [{"id": "r1", "model": "car", "pose": [6, 5, 0]}]
    with pytest.raises(SceneError, match="r1 starts on ground too steep for it"):
        make_scene({**RIDGE, "slope": "avoid"}, robots=robots)


def test_other_words_for_slopes_are_refused() -> None:
    with pytest.raises(SceneError, match="elevation.slope"):
        make_scene({**RIDGE, "slope": "forbid"})


ASIDE = [{"id": "r1", "model": "car", "pose": [1, 5, 0]}]
