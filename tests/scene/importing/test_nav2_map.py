"""Occupancy maps lose no obstacle cell, gain little, and mean what they do in Nav2."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from PIL import Image
from shapely import affinity

from mrmg.errors import SceneError
from mrmg.scene.importing.importing import import_files
from mrmg.scene.importing.layers import ImportOptions
from mrmg.scene.importing.raster_shapes import enclosing_polygons, polygons_of_cells
from mrmg.scene.loading import dump_scene, scene_from_document
from mrmg.scene.loading.yaml_text import parse_yaml
from mrmg.scene.types import Scene

NAV2 = Path(__file__).parents[4] / "shared" / "nav2"
ROUNDING_M = 2e-6


def imported(path: Path, **keys: Any) -> Scene:
    masks = {name: keys.pop(name) for name in ("keepout", "terrain_mask") & keys.keys()}
    document = import_files([path], ImportOptions(**keys), **masks).document
    return scene_from_document(document, source="test")


def solid(scene: Scene) -> shapely.Geometry:
    return shapely.union_all([wall.shape for wall in scene.obstacles])


def cells_of(mask: np.ndarray, path: Path) -> shapely.Geometry:
    """Return the ground of cells, one box after the other."""
    keys = parse_yaml(path.read_text(), source="test")
    x, y, yaw = (*keys["origin"], 0.0)[:3]
    cell, rows = keys["resolution"], mask.shape[0]
    row, column = np.nonzero(mask)
    west, south = column * cell, (rows - 1 - row) * cell
    whole = shapely.union_all(shapely.box(west, south, west + cell, south + cell))
    turned = affinity.rotate(whole, yaw, origin=(0, 0), use_radians=True)
    return affinity.translate(turned, x, y)


def reference(grey: np.ndarray, keys: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return which cells Nav2's map server takes as occupied, and as unknown."""
    occupied, unknown = np.zeros((2, *grey.shape), dtype=bool)
    for at, value in np.ndenumerate(grey):
        shade = value / 255.0
        share = shade if keys["negate"] else 1.0 - shade
        if keys["mode"] == "raw":
            unknown[at] = round(shade * 255) > 100
            occupied[at] = 100 * keys["occupied_thresh"] <= round(shade * 255) <= 100
            continue
        occupied[at] = share > keys["occupied_thresh"]
        between = not occupied[at] and not share < keys["free_thresh"]
        unknown[at] = between and keys["mode"] == "trinary"
    return occupied, unknown


@pytest.mark.parametrize(
    ("mode", "negate", "yaw", "unknown"),
    [
        ("trinary", 0, 0.0, "obstacle"),
        ("trinary", 1, 0.7, "obstacle"),
        ("trinary", 0, -math.pi / 2, "free"),
        ("scale", 0, 0.7, "free"),
        ("scale", 1, 0.0, "obstacle"),
        ("raw", 0, 0.0, "obstacle"),
        ("raw", 1, 0.7, "free"),
    ],
)
def test_no_cell_is_lost_and_little_added(
    mode: str, negate: int, yaw: float, unknown: str, tmp_path: Path, write_map: Any
) -> None:
    seed = [len(mode), negate, int(10 * yaw) + 20, len(unknown)]
    rng = np.random.default_rng(seed)
    blocks = rng.choice([0, 30, 66, 90, 205, 240, 254], size=(6, 9))
    grey = np.kron(blocks, np.ones((4, 4), dtype=int))
    noise = rng.random(grey.shape) < 0.08
    grey[noise] = rng.choice([0, 254, 205], size=int(noise.sum()))
    keys = {
        "mode": mode,
        "negate": negate,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    path = write_map(tmp_path, grey, origin=[-3.0, 2.5, yaw], **keys)
    occupied, unseen = reference(grey, keys)
    mask = occupied | unseen if unknown == "obstacle" else occupied
    wanted = cells_of(mask, path)
    for tolerance in (0.0, 0.5, 2.0):
        scene = imported(path, unknown=unknown, tolerance=tolerance)
        found = solid(scene)
        assert wanted.difference(found.buffer(ROUNDING_M)).area < 1e-9
        outside = shapely.box(*scene.bounds) - cells_of(np.ones_like(mask), path)
        allowed = shapely.union(wanted, outside.buffer(ROUNDING_M))
        grown = allowed.buffer(tolerance * 0.1 + ROUNDING_M, quad_segs=32)
        assert found.difference(grown).area < 1e-6


@pytest.mark.parametrize("share", [0.03, 0.4, 0.6, 0.9])
def test_cells_of_any_kind(share: float) -> None:
    """Outlines are exact at no tolerance; at others all cells lie inside, near."""
    rng = np.random.default_rng(int(100 * share))
    for _ in range(15):
        mask = rng.random(rng.integers(1, 18, 2)) < share
        row, column = np.nonzero(mask)
        cells = shapely.union_all(shapely.box(column, row, column + 1, row + 1))
        exact = polygons_of_cells(mask)
        assert shapely.is_valid(exact).all()
        assert shapely.area(exact).sum() == pytest.approx(mask.sum())
        assert shapely.symmetric_difference(cells, shapely.union_all(exact)).area < 1e-9
        for tolerance in (0.3, 0.5, 1.0, 2.4):
            found = enclosing_polygons(mask, tolerance)
            assert shapely.is_valid(found).all()
            whole = shapely.union_all(found)
            assert cells.difference(whole).area < 1e-9
            near = cells.buffer(tolerance + 1e-9, quad_segs=64)
            assert whole.difference(near).area < 1e-6


def test_nothing_free_is_refused(tmp_path: Path, write_map: Any) -> None:
    path = write_map(tmp_path, np.full((8, 9), 205))
    with pytest.raises(SceneError, match="no free ground.*--unknown free"):
        imported(path)
    assert not imported(path, unknown="free").obstacles
    black = write_map(tmp_path, np.zeros((8, 9)), name="black")
    with pytest.raises(SceneError, match="cover all of the ground, 0.9 x 0.8 m") as it:
        imported(black)
    assert "--unknown" not in str(it.value)
    with pytest.raises(SceneError, match="lies beside the map, which covers 0, 0, 0.9"):
        imported(path, crop=(5.0, 5.0, 6.0, 6.0))


def test_bounds_are_the_picture(tmp_path: Path, write_map: Any) -> None:
    path = write_map(tmp_path, np.full((20, 30), 254), origin=[-1.0, 2.0, 0.0])
    assert imported(path).bounds == pytest.approx((-1.0, 2.0, 2.0, 4.0))


def test_corners_are_few(tmp_path: Path, write_map: Any) -> None:
    """A slanted wall has steps of a cell; its polygon follows it."""
    row, column = np.mgrid[0:200, 0:200]
    grey = np.where(abs(row - column) < 4, 0, 254)
    scene = imported(write_map(tmp_path, grey))
    assert len(scene.obstacles) == 1
    assert shapely.get_num_coordinates(scene.obstacles[0].shape) < 20


def test_pictures_of_other_kinds(tmp_path: Path, write_map: Any) -> None:
    grey = np.full((10, 10), 254, dtype=np.uint8)
    grey[3:5, 3:6] = 0
    path = write_map(tmp_path, grey, suffix="png")
    plain = imported(path)
    picture = Image.fromarray(grey)
    wide = Image.fromarray(grey.astype(np.uint16) * 257)
    for other in (picture.convert("RGB"), picture.convert("P"), wide):
        other.save(tmp_path / "map.png")
        assert imported(path) == plain
    for alpha in (255, 0):  # trinary: its mean is that of all channels, as in RGBA
        channel = np.full_like(grey, 255)
        channel[6:9, 6:9] = alpha
        Image.fromarray(np.dstack([grey] * 3 + [channel])).save(tmp_path / "map.png")
        colours = imported(path, unknown="free")
        Image.fromarray(np.dstack([grey, channel]), "LA").save(tmp_path / "map.png")
        assert imported(path, unknown="free") == colours
    clear = np.dstack([grey] * 3 + [np.full_like(grey, 255)])
    clear[8, 8, 3] = 0  # never seen, in a map of scale
    Image.fromarray(clear).save(tmp_path / "map.png")
    path.write_text(path.read_text() + "mode: scale\n")
    assert solid(imported(path)).area == pytest.approx(solid(plain).area + 0.01)
    assert imported(path, unknown="free") == plain


def test_masks(tmp_path: Path, write_map: Any) -> None:
    """A mask closes ground and makes terrain where the map is free, and only there."""
    grey = np.full((40, 40), 254)
    grey[:2], grey[20:24, 20:24] = 0, 0
    path = write_map(tmp_path, grey)
    closed = grey.copy()
    closed[10:14, 5:30] = 0
    keepout = write_map(tmp_path, closed, "keepout")
    speed = np.full((40, 40), 255)
    speed[16:30, 16:30] = 127  # half the speed
    mask = write_map(
        tmp_path, speed, "speed", mode="scale", occupied_thresh=1.0, free_thresh=0.0
    )
    scene = imported(path, keepout=keepout, terrain_mask=mask)
    names = [wall.id for wall in scene.obstacles]
    assert [name for name in names if name.startswith("keepout")] == ["keepout"]
    assert solid(scene).equals_exact(cells_of(closed == 0, path), 1e-9) or (
        solid(scene).symmetric_difference(cells_of(closed == 0, path)).area < 1e-6
    )
    (area,) = scene.terrain
    assert area.multiplier == pytest.approx(2.0, rel=0.01)
    assert area.shape.area == pytest.approx((14 * 14 - 4 * 4) * 0.01)


def test_mask_of_many_values_is_rounded(tmp_path: Path, write_map: Any) -> None:
    path = write_map(tmp_path, np.full((8, 101), 254))
    ramp = np.tile(np.round(255 - 2.55 * np.arange(101)), (8, 1))
    keys = {"mode": "scale", "occupied_thresh": 1.0, "free_thresh": 0.0}
    scene = imported(path, terrain_mask=write_map(tmp_path, ramp, "ramp", **keys))
    multipliers = [area.multiplier for area in scene.terrain]
    assert len(set(multipliers)) == 12
    for area in scene.terrain:
        value = 10 * shapely.get_x(area.shape.centroid)  # one value a cell of 0.1 m
        assert 100 / area.multiplier == pytest.approx(100 - value, abs=3)


def test_raw_mask_takes_values_as_they_are(tmp_path: Path, write_map: Any) -> None:
    """Thresholds say nothing of them: all of 1 to 99 are multipliers."""
    path = write_map(tmp_path, np.full((20, 20), 254))
    raw = np.zeros((20, 20))
    raw[2:6], raw[8:12], raw[14:16] = 50, 80, 100
    mask = write_map(tmp_path, raw, "raw", mode="raw", occupied_thresh=0.65)
    scene = imported(path, terrain_mask=mask)
    assert {area.multiplier for area in scene.terrain} == {2.0, 5.0}
    assert solid(scene).area == pytest.approx(2 * 20 * 0.01)


def test_name_of_a_picture_too_long(tmp_path: Path, write_map: Any) -> None:
    path = write_map(tmp_path, np.full((4, 4), 254))
    path.write_text(path.read_text().replace("map.pgm", 300 * "x"))
    with pytest.raises(SceneError, match="image, line 1: .*expected a PGM or PNG"):
        imported(path)


@pytest.mark.parametrize("stated", ["/home/me/maps/map.pgm", "C:\\\\maps\\\\map.pgm"])
def test_a_picture_that_was_moved_with_its_map(
    stated: str, tmp_path: Path, write_map: Any
) -> None:
    """Maps that others share often name a place on the machine they come from."""
    path = write_map(tmp_path, np.full((20, 30), 254))
    here = imported(path)
    path.write_text(path.read_text().replace("map.pgm", f'"{stated}"'))
    assert imported(path) == here
    (note,) = (note for note in import_files([path]).notes if "not there" in note)
    assert "map.pgm' is not there; took the file beside the YAML" in note


def test_depot() -> None:
    """The map of a real depot with its masks, and its graph on it."""
    if not NAV2.exists():
        pytest.skip("no shared maps")
    path = NAV2 / "depot.yaml"
    grey = np.asarray(Image.open(NAV2 / "depot.pgm"))
    found = import_files(
        [path, NAV2 / "depot_graph.geojson"],
        keepout=NAV2 / "depot_keepout.yaml",
        terrain_mask=NAV2 / "depot_speed.yaml",
    )
    scene = scene_from_document(found.document, source="depot")
    assert scene.bounds == pytest.approx((0.0, 0.0, 604 * 0.05, 307 * 0.05))
    closed = np.asarray(Image.open(NAV2 / "depot_keepout.pgm")) == 0
    wanted = cells_of((grey == 0) | closed, path)
    assert wanted.difference(solid(scene).buffer(ROUNDING_M)).area < 1e-9
    grown = wanted.buffer(0.026, quad_segs=8)
    assert solid(scene).difference(grown).area < 1e-6
    assert len(scene.goals) == 33
    assert any("node_24" in note for note in found.notes)  # on closed ground
    assert {round(area.multiplier, 2) for area in scene.terrain} == {1.25, 1.33, 2.0}
    again = scene_from_document(
        parse_yaml(dump_scene(scene), source=""), source="again"
    )
    assert again == scene


def test_every_fault_has_its_line(tmp_path: Path, write_map: Any) -> None:
    path = write_map(tmp_path, np.full((4, 4), 254), resolution=0.0, mode="grey")
    with pytest.raises(SceneError) as caught:
        imported(path)
    assert {fault.line for fault in caught.value.faults} == {2, 7}
