"""Elevation models and land cover keep their heights and places, in metres."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest
import shapely

from mrmg.cli.main import main
from mrmg.errors import SceneError
from mrmg.scene.elevation import Elevation
from mrmg.scene.importing.importing import import_files
from mrmg.scene.importing.layers import ImportOptions
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.types import Scene


def imported(path: Path, **keys: Any) -> Scene:
    cover = keys.pop("land_cover", None)
    found = import_files([path], ImportOptions(**keys), land_cover=cover)
    return scene_from_document(found.document, source="test")


def elevation(scene: Scene) -> Elevation:
    assert scene.elevation is not None
    assert scene.elevation.avoid_steep
    return scene.elevation


def heights(rows: int, columns: int) -> np.ndarray:
    row, column = np.mgrid[0:rows, 0:columns]
    wave = 430.0 + np.sin(column / 9.0) + 0.5 * np.cos(row / 7.0)
    return wave.astype("float32")


@pytest.mark.parametrize("crs", [None, "EPSG:32632"])
def test_metric_model_keeps_its_cells(
    crs: str | None, tmp_path: Path, write_tiff: Any
) -> None:
    """Nodes are the cells' middles, first row in the north, at their heights."""
    values = heights(30, 50)
    corner = (0.0, 60.0) if crs is None else (450_000.0, 5_300_000.0)
    path = write_tiff(tmp_path / "dem.tif", values, corner=corner, cell=2.0, crs=crs)
    scene = imported(path)
    assert scene.bounds == pytest.approx((1.0, 1.0, 99.0, 59.0))
    row, column = np.mgrid[0:30, 0:50]
    points = np.stack([1.0 + 2.0 * column, 59.0 - 2.0 * row], axis=-1).reshape(-1, 2)
    found = elevation(scene).height_at(points)
    assert found == pytest.approx(values.ravel(), abs=1e-4)


def test_geographic_model_in_metres(tmp_path: Path, write_tiff: Any) -> None:
    """Each place has the height that the raster has at its longitude and latitude."""
    cell, west, north = 2e-5, 8.33, 47.85
    values = heights(60, 70)
    path = write_tiff(
        tmp_path / "dem.tif", values, corner=(west, north), cell=cell, crs="EPSG:4326"
    )
    found = import_files([path])
    scene = scene_from_document(found.document, source="test")
    x_min, y_min, x_max, y_max = scene.bounds
    geod = pyproj.Geod(ellps="WGS84")
    wide = geod.line_length([west, west + 70 * cell], [north, north])
    high = geod.line_length([west, west], [north - 60 * cell, north])
    assert x_max - x_min == pytest.approx(wide, rel=0.06)  # edges are cut
    assert y_max - y_min == pytest.approx(high, rel=0.06)
    (note,) = [note for note in found.notes if "less the origin" in note]
    origin = np.array([float(x) for x in note.partition("(")[2].rstrip(")").split(",")])
    rng = np.random.default_rng(0)
    points = rng.uniform((x_min, y_min), (x_max, y_max), (50, 2))
    to_earth = pyproj.Transformer.from_crs("EPSG:32632", "EPSG:4326", always_xy=True)
    longitude, latitude = to_earth.transform(*(points + origin).T)
    column, row = (longitude - west) / cell - 0.5, (north - latitude) / cell - 0.5
    wanted = 430.0 + np.sin(column / 9.0) + 0.5 * np.cos(row / 7.0)
    assert elevation(scene).height_at(points) == pytest.approx(wanted, abs=0.02)


@pytest.mark.parametrize("crs", [None, "EPSG:32632"])
def test_rows_and_columns_of_any_direction(
    crs: str | None, tmp_path: Path, write_tiff: Any
) -> None:
    """The same ground in another order of rows and columns is the same scene."""
    from affine import Affine

    values = heights(20, 30)
    west, north = (100.0, 240.0) if crs is None else (450_000.0, 5_300_000.0)
    east, south = west + 60.0, north - 40.0
    scenes = [
        imported(write_tiff(tmp_path / "dem.tif", part, crs=crs, transform=place))
        for part, place in (
            (values, Affine(2.0, 0.0, west, 0.0, -2.0, north)),
            (values[::-1], Affine(2.0, 0.0, west, 0.0, 2.0, south)),
            (values[::-1, ::-1], Affine(-2.0, 0.0, east, 0.0, 2.0, south)),
        )
    ]
    assert scenes[0].bounds == scenes[1].bounds == scenes[2].bounds
    for scene in scenes:
        assert (elevation(scene).height_m == elevation(scenes[0]).height_m).all()


@pytest.mark.parametrize("degrees", [30.0, 45.0, 90.0])
def test_turned_model(degrees: float, tmp_path: Path, write_tiff: Any) -> None:
    """Places keep their heights; what lies beside the raster is no data."""
    from affine import Affine

    values, turn = heights(40, 60), np.deg2rad(degrees)
    a, d = np.cos(turn), np.sin(turn)
    place = Affine(a, d, 450_000.0, d, -a, 5_300_000.0)
    path = write_tiff(tmp_path / "dem.tif", values, crs="EPSG:32632", transform=place)
    found = import_files([path])
    scene = scene_from_document(found.document, source="test")
    (note,) = [note for note in found.notes if "less the origin" in note]
    origin = np.array([float(x) for x in note.partition("(")[2].rstrip(")").split(",")])
    column, row = np.random.default_rng(1).uniform((2, 2), (57, 37), (50, 2)).T
    x, y = a * column + d * row + 450_000.0, d * column - a * row + 5_300_000.0
    points = np.stack([x, y], axis=1) - origin
    wanted = 430.0 + np.sin((column - 0.5) / 9.0) + 0.5 * np.cos((row - 0.5) / 7.0)
    assert elevation(scene).height_at(points) == pytest.approx(wanted, abs=0.02)
    closed = shapely.union_all([wall.shape for wall in scene.obstacles])
    share = 1.0 - closed.area / shapely.box(*scene.bounds).area
    extent = (60 * a + 40 * d) * (60 * d + 40 * a)
    assert share == pytest.approx(40 * 60 / extent, abs=0.08)
    assert not shapely.contains_xy(closed, points).any()


def test_turned_model_on_a_map_in_metres(
    tmp_path: Path, write_map: Any, write_tiff: Any
) -> None:
    """Coordinates of the raster are metres of the map before it."""
    from affine import Affine

    a = np.sqrt(0.5)
    place = Affine(a, a, 400_000.0, a, -a, 5_800_000.0)
    path = write_tiff(
        tmp_path / "dem.tif", heights(40, 60), crs="EPSG:25833", transform=place
    )
    free, origin = np.full((20, 20), 254), [400_000.0, 5_800_000.0, 0.0]
    document = import_files([write_map(tmp_path, free, origin=origin), path]).document
    x_min, y_min, _, _ = scene_from_document(document, source="test").bounds
    assert (x_min, y_min) == pytest.approx((400_000.0, 5_800_000.0 - 40 * a), abs=1.0)


@pytest.mark.parametrize("crs", [None, "EPSG:25832", "EPSG:4326"])
def test_crop_of_a_model_that_is_not_the_first_file(
    crs: str | None, tmp_path: Path, write_tiff: Any
) -> None:
    """The box is in coordinates of the first file, of whatever kind that is."""
    corner = (450_000.0, 5_300_000.0) if crs else (0.0, 30.0)
    metric = None if crs is None else "EPSG:25832"
    dem = write_tiff(tmp_path / "dem.tif", heights(30, 30), crs=metric, corner=corner)
    points = np.array([corner, corner]) + [(5.0, -5.0), (15.0, -20.0)]
    if crs == "EPSG:4326":
        to = pyproj.Transformer.from_crs(metric, crs, always_xy=True)
        points = np.stack(to.transform(*points.T), axis=1)
    (west, north), (east, south) = points.tolist()
    place = {"type": "Point", "coordinates": [(west + east) / 2, (south + north) / 2]}
    goal = {"type": "Feature", "properties": {"kind": "goal"}, "geometry": place}
    path = tmp_path / "goals.geojson"
    path.write_text(
        json.dumps(goal | {"crs": {"properties": {"name": crs or "local"}}})
    )
    options = ImportOptions(crop=(west, south, east, north))
    found = import_files([path, dem], options)
    x_min, y_min, x_max, y_max = scene_from_document(
        found.document, source="test"
    ).bounds
    # Axes of degrees and of metres are not parallel.
    assert (x_max - x_min, y_max - y_min) == pytest.approx((9.0, 14.0), abs=2.1)
    assert found.document["goals"]
    if crs is None:
        again = import_files([dem, path], options)
        assert found.document["bounds"] == again.document["bounds"]


def test_raster_without_a_place(tmp_path: Path, write_tiff: Any) -> None:
    from affine import Affine

    path, values = tmp_path / "dem.tif", heights(6, 9)
    nowhere = imported(write_tiff(path, values, transform=Affine.identity()))
    assert nowhere == imported(write_tiff(path, values))


def test_cells_without_data(tmp_path: Path, write_tiff: Any) -> None:
    values = heights(20, 20)
    values[5:8, 10:14] = -9999.0
    values[0, 0] = np.nan
    path = write_tiff(tmp_path / "dem.tif", values, nodata=-9999.0)
    scene = imported(path)
    solid = shapely.union_all([wall.shape for wall in scene.obstacles])
    for row, column in [(5, 10), (7, 13), (0, 0)]:
        assert solid.buffer(1e-6).covers(shapely.Point(column + 0.5, 19.5 - row))
    assert solid.area == pytest.approx(3 * 4 + 0.25)  # bounds cut the corner cell
    assert elevation(scene).height_m.min() > 428.0
    assert not imported(path, unknown="free").obstacles


@pytest.mark.parametrize("crs", ["EPSG:32632", "EPSG:4326"])
def test_crop(crs: str, tmp_path: Path, write_tiff: Any) -> None:
    """The part asked for, in the file's own coordinates."""
    metric = crs == "EPSG:32632"
    cell, corner = (2.0, (450_000.0, 5.3e6)) if metric else (2e-5, (8.33, 47.85))
    keys = {"cell": cell, "corner": corner, "crs": crs}
    path = write_tiff(tmp_path / "dem.tif", heights(60, 60), **keys)
    west, north = corner
    box = (west + 10 * cell, north - 30 * cell, west + 30 * cell, north - 10 * cell)
    part = elevation(imported(path, crop=box))
    assert np.prod(part.height_m.shape) == pytest.approx(20 * 20, rel=0.2)
    rows = slice(10, 30)
    values = heights(60, 60)[rows, rows]
    assert part.height_m.max() == pytest.approx(values.max(), abs=0.1)
    with pytest.raises(SceneError, match="lies beside the raster, which covers"):
        imported(path, crop=(0.0, 0.0, 1.0, 1.0))


def test_feet_and_bands(tmp_path: Path, write_tiff: Any) -> None:
    import rasterio

    path = write_tiff(tmp_path / "dem.tif", heights(5, 6), count=2)
    with rasterio.open(path, "r+") as file:
        file.units = ("ft", "ft")
    found = import_files([path])
    assert sum("bands" in note or "in ft" in note for note in found.notes) == 2
    scene = scene_from_document(found.document, source="test")
    assert elevation(scene).height_m.max() == pytest.approx(
        0.3048 * heights(5, 6).max(), abs=1e-3
    )


def test_saved_heights_are_those_of_the_file(tmp_path: Path, write_tiff: Any) -> None:
    values = heights(4, 5)
    out = tmp_path / "scene.yaml"
    path = write_tiff(tmp_path / "dem.tif", values)
    assert main(["scene", "import", str(path), "-o", str(out)]) == 0
    packed = load_scene(out).document["elevation"]["packed"]
    steps = np.frombuffer(zlib.decompress(base64.b64decode(packed["heights"])), "<i4")
    assert 1e-4 * steps == pytest.approx(values.ravel(), abs=1e-4)


TABLE = "10: {multiplier: 1.5}\n20: {multiplier: 2, turning: 3}\n80: obstacle\n"


def test_land_cover_raster(tmp_path: Path, write_tiff: Any) -> None:
    classes = np.full((20, 30), 10, dtype="uint8")
    classes[:, 10:20], classes[5:8, 3:6], classes[15:, 25:] = 20, 80, 99
    table = tmp_path / "classes.yaml"
    table.write_text(TABLE)
    cover = write_tiff(tmp_path / "cover.tif", classes)
    dem = write_tiff(tmp_path / "dem.tif", heights(20, 30))
    for scene in (
        imported(dem, land_cover=cover, classes=table),
        scene_from_document(
            import_files(
                [cover], ImportOptions(classes=table), kind="land-cover"
            ).document,
            source="test",
        ),
    ):
        spots = {(15.0, 10.0): 2.0, (2.0, 2.0): 1.5, (8.0, 18.0): 1.5}
        for spot, multiplier in spots.items():
            (area,) = [a for a in scene.terrain if a.shape.covers(shapely.Point(spot))]
            assert area.multiplier == multiplier
            assert area.turning_multiplier == (3.0 if multiplier == 2.0 else 1.0)
        assert not any(a.shape.covers(shapely.Point(27, 2)) for a in scene.terrain)
        (pond,) = scene.obstacles
        assert pond.shape.equals(shapely.box(3, 12, 6, 15))


def test_a_part_of_land_cover_far_from_the_origin(
    tmp_path: Path, write_tiff: Any
) -> None:
    table = tmp_path / "classes.yaml"
    table.write_text("1: {multiplier: 2}\n")
    keys = {"corner": (450_000.0, 5.3e6), "cell": 2.0, "crs": "EPSG:32632"}
    cover = write_tiff(tmp_path / "cover.tif", np.ones((30, 40), "uint8"), **keys)
    box = (450_010.0, 5_299_960.0, 450_050.0, 5_299_980.0)
    options = ImportOptions(classes=table, crop=box)
    found = import_files([cover], options, kind="land-cover")
    scene = scene_from_document(found.document, source="test")
    x_min, y_min, x_max, y_max = scene.bounds
    assert (x_max - x_min, y_max - y_min) == pytest.approx((40.0, 20.0))
    (area,) = scene.terrain
    assert area.shape.area == pytest.approx(40.0 * 20.0)


def test_land_cover_polygons(tmp_path: Path, write_tiff: Any) -> None:
    table = tmp_path / "classes.yaml"
    table.write_text("forest: {multiplier: 3}\nlake: obstacle\n")
    ring = {
        "forest": [[0, 0], [10, 0], [10, 10], [0, 10]],
        "lake": [[12, 2], [18, 2], [18, 8]],
        "road": [[0, 12], [18, 12], [18, 13]],
    }
    features = ", ".join(
        f'{{"type": "Feature", "properties": {{"class": "{name}"}}, "geometry": '
        f'{{"type": "Polygon", "coordinates": [{corners}]}}}}'
        for name, corners in ring.items()
    )
    cover = tmp_path / "cover.geojson"
    cover.write_text(f'{{"type": "FeatureCollection", "features": [{features}]}}')
    dem = write_tiff(tmp_path / "dem.tif", heights(20, 30))
    scene = imported(dem, land_cover=cover, classes=table)
    assert [area.multiplier for area in scene.terrain] == [3.0]
    assert scene.obstacles[0].shape.area == pytest.approx(18.0)


def test_classes_table_faults(
    tmp_path: Path, write_tiff: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    cover = write_tiff(tmp_path / "cover.tif", np.full((4, 4), 1, dtype="uint8"))
    dem = write_tiff(tmp_path / "dem.tif", heights(4, 4))
    command = ["scene", "import", str(dem), "--land-cover", str(cover)]
    out = tmp_path / "scene.yaml"
    assert main([*command, "-o", str(out)]) == 2
    table = tmp_path / "classes.yaml"
    for text, message in (
        ("", "expected lines 'class: {multiplier: 1.5}' or 'class: obstacle'"),
        ("- 1\n", "expected lines"),
        ("1: {multiplier: -2}\n", "1.multiplier, line 1: got -2; must be > 0"),
        (
            "1: water\n",
            "must be 'obstacle', or a mapping with keys multiplier, turning",
        ),
        ("1: {speed: 2}\n", "unknown key; known keys: multiplier, turning"),
        ("1: {multipliers: 2}\n", "did you mean 'multiplier'?"),
    ):
        table.write_text(text)
        assert main([*command, "--classes", str(table), "-o", str(out)]) == 3
        assert message in " ".join(capsys.readouterr().err.split())
    assert not out.exists()


def test_a_second_elevation_model_is_refused(tmp_path: Path, write_tiff: Any) -> None:
    files = [write_tiff(tmp_path / f"{n}.tif", heights(20, 30)) for n in range(2)]
    with pytest.raises(SceneError, match=r"1.tif.*\n.*second elevation model.*merge"):
        import_files(files)


def test_large_model_is_thinned_in_place(
    tmp_path: Path, write_tiff: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mrmg.scene.importing.formats.geotiff.MOST_NODES", 500)
    values = heights(60, 60)
    scene = imported(write_tiff(tmp_path / "dem.tif", values))
    found = elevation(scene)
    assert found.height_m.size <= 500
    at = np.array([[0.5, 59.5], [0.5 + 27, 59.5 - 18]])
    assert found.height_at(at) == pytest.approx(
        [values[0, 0], values[18, 27]], abs=1e-4
    )
