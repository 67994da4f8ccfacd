"""Foreign maps keep their geometry; malformed ones are explained line by line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shapely
from places import import_map

from mrmg.cli.main import main
from mrmg.errors import SceneError
from mrmg.scene.loading import dump_scene, scene_from_document
from mrmg.scene.types import Scene

MAPS = Path(__file__).parents[4] / "shared" / "maps"
NAMES = [
    "T.txt",
    "complex2.txt",
    "complex3-big.txt",
    "dense.tri",
    "gaps.txt",
    "geometry-reduced.txt",
    "jf-pb2.txt",
    "potholes.txt",
    "triangles.tri",
    "warehouse.txt",
    "warehouse2.txt",
]


def shared_map(name: str) -> Path:
    path = MAPS / name
    if not path.exists():
        pytest.skip(f"{name} is not here")
    return path


def written(tmp_path: Path, text: str, name: str = "map.txt") -> Path:
    path = tmp_path / name
    path.write_bytes(text.encode())
    return path


def imported(path: Path, longest_side_m: float = 100.0) -> Scene:
    document = import_map(path, longest_side_m)
    return scene_from_document(document, source=path.name)


def blocked_m2(scene: Scene) -> float:
    return float(shapely.union_all([wall.shape for wall in scene.obstacles]).area)


@pytest.mark.parametrize("name", NAMES)
def test_shared_map(name: str) -> None:
    """Scaled to the side, valid, apart from each other, and of the area drawn."""
    path = shared_map(name)
    scene = imported(path)
    x_min, y_min, x_max, y_max = scene.bounds
    assert (x_min, y_min) == (0.0, 0.0)
    assert max(x_max, y_max) == pytest.approx(100.0)
    shapes = [wall.shape for wall in scene.obstacles]
    assert all(shape.is_valid for shape in shapes)
    assert sum(s.area for s in shapes) == pytest.approx(blocked_m2(scene), rel=1e-6)
    assert shapely.box(*scene.bounds).buffer(1e-6).covers(shapely.union_all(shapes))
    assert blocked_m2(scene) == pytest.approx(drawn_m2(path), rel=2e-3)


@pytest.mark.parametrize("name", NAMES)
def test_shared_map_survives_saving(name: str) -> None:
    scene = imported(shared_map(name))
    again = scene_from_document(scene.document, source=name)
    assert dump_scene(again) == dump_scene(scene)


def drawn_m2(path: Path) -> float:
    """Blocked area inside the border at a longest side of 100 m, read another way."""
    if path.suffix == ".tri":
        rows = [line.split() for line in path.read_text().splitlines() if line.strip()]
        triangles = [np.array(row, dtype=float).reshape(3, 2) for row in rows]
        solid = shapely.union_all([shapely.Polygon(t) for t in triangles])
        holes = [
            shapely.Polygon(r) for p in shapely.get_parts(solid) for r in p.interiors
        ]
        extent = shapely.box(*solid.bounds)
        frame = max(holes, key=lambda hole: hole.area, default=extent)
        frame = frame if frame.area > 0.5 * extent.area else extent
        inside = solid.intersection(shapely.box(*frame.bounds)).area
        return inside * (100.0 / max(_sides(frame))) ** 2
    points: dict[str, list[float]] = {}
    polygons: dict[str, list[list[list[float]]]] = {}
    tag = ""
    for line in path.read_text().splitlines():
        words = line.split()
        if line.startswith("["):
            tag = line.strip().strip("[]").removeprefix("MAP_")
            polygons.setdefault(tag, []).append([])
        elif words and tag == "POINTS":
            points[words[0]] = [float(word) for word in words[1:]]
        elif words and tag in ("BORDER", "OBSTACLE"):
            corners = [points[w] for w in words] if points else [[*map(float, words)]]
            polygons[tag][-1].extend(corners)
    border = shapely.Polygon(polygons["BORDER"][0])
    holes = [shapely.Polygon(ring).buffer(0) for ring in polygons["OBSTACLE"]]
    free = border.difference(shapely.union_all(holes)).area
    box = shapely.box(*border.bounds)
    return (box.area - free) * (100.0 / max(_sides(box))) ** 2


def _sides(shape: shapely.Geometry) -> tuple[float, float]:
    x_min, y_min, x_max, y_max = shape.bounds
    return x_max - x_min, y_max - y_min


SQUARE = "[BORDER]\n0 0\n10 0\n10 10\n0 10\n"


def test_scale(tmp_path: Path) -> None:
    """That of the file is read over: the longest side decides."""
    path = written(tmp_path, f"[SCALE]\n0.5\n{SQUARE}[OBSTACLE]\n2 2\n4 2\n4 4\n2 4\n")
    assert imported(path, 20.0).bounds == (0.0, 0.0, 20.0, 20.0)
    assert blocked_m2(imported(path, 20.0)) == pytest.approx(16.0)


def test_carriage_returns_blanks_and_derived_tags(tmp_path: Path) -> None:
    text = (
        " [ BORDER ] \r\n0 0 \r\n\r\n10 0\r\n10 10\r\n0 10\r\n"
        "[OBSTACLE]  \r\n2 2\r\n2 4\r\n4 4\r\n4 2\r\n"
        "[CONVEX_REGION]\r\nanything goes here\r\n"
    )
    scene = imported(written(tmp_path, text), 10.0)
    assert blocked_m2(scene) == pytest.approx(4.0)


def test_point_ids(tmp_path: Path) -> None:
    """Polygons as ids, several in a line."""
    text = (
        "[INFO]\nNAME=x\n[MAP_POINTS]\n0 0 0\n1 1000 0\n2 1000 500\n3 0 500\n"
        "10 200 200\n11 400 200\n12 400 400\n[MAP_BORDER]\n0 1\n2 3\n"
        "[MAP_OBSTACLE]\n10 11 12\n"
    )
    scene = imported(written(tmp_path, text), 10.0)
    assert scene.bounds == (0.0, 0.0, 10.0, 5.0)
    assert blocked_m2(scene) == pytest.approx(2.0)


def test_touching_and_overlapping_obstacles_become_one(tmp_path: Path) -> None:
    text = (
        f"{SQUARE}[OBSTACLE]\n2 2\n4 2\n4 4\n2 4\n[OBSTACLE]\n4 2\n6 2\n6 4\n4 4\n"
        "[OBSTACLE]\n5 3\n7 3\n7 5\n5 5\n"
    )
    scene = imported(written(tmp_path, text), 10.0)
    assert len(scene.obstacles) == 1
    assert scene.obstacles[0].shape.area == pytest.approx(11.0)


def test_ground_beyond_a_slanted_border_is_blocked(tmp_path: Path) -> None:
    text = "[BORDER]\n0 0\n10 0\n10 10\n[OBSTACLE]\n6 2\n8 2\n8 4\n"
    assert blocked_m2(imported(written(tmp_path, text), 10.0)) == pytest.approx(52.0)


def test_crossing_polygon_is_repaired(tmp_path: Path) -> None:
    text = f"{SQUARE}[OBSTACLE]\n2 2\n6 6\n6 2\n2 6\n"
    assert blocked_m2(imported(written(tmp_path, text), 10.0)) == pytest.approx(8.0)


def test_mixed_rows(tmp_path: Path) -> None:
    """A triangle, a wall of no width and a post: all become obstacles with area."""
    text = "0 0 10 0 0 1 \n\n5 5 8 5\n9 9\n0 9 0 10 1 10\n10 9 10 10 9.9 10\n"
    scene = imported(written(tmp_path, text, "map.tri"), 10.0)
    solid = shapely.union_all([wall.shape for wall in scene.obstacles])
    assert solid.covers(shapely.LineString([(5, 5), (8, 5)]))
    assert solid.contains(shapely.Point(9, 9))
    assert len(scene.obstacles) == 5


def test_comments_say_nothing(tmp_path: Path) -> None:
    text = (
        f"# drawn by hand, in metres\n\n{SQUARE}[OBSTACLE] # a pillar\n2 2\n4 2 #x\n4 4"
    )
    assert blocked_m2(imported(written(tmp_path, text), 10.0)) == pytest.approx(2.0)
    rows = "#Map 2D\n0 0 10 0 10 10\n0 0 0 4 4 4\n"
    assert blocked_m2(imported(written(tmp_path, rows), 10.0)) == pytest.approx(58.0)


def test_frame_of_triangles_becomes_the_bounds(tmp_path: Path) -> None:
    sides = [(0, 0, 10, 1), (0, 9, 10, 10), (0, 0, 1, 10), (9, 0, 10, 10)]
    rows = [
        f"{a} {b} {c} {b} {c} {d}\n{a} {b} {c} {d} {a} {d}\n" for a, b, c, d in sides
    ]
    text = "".join(rows) + "4 4 6 4 5 6\n"
    scene = imported(written(tmp_path, text, "map.tri"), 8.0)
    assert scene.bounds == (0.0, 0.0, 8.0, 8.0)
    assert blocked_m2(scene) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "map.txt: 1 fault\n  empty; expected a map"),
        ("1 2\n1 2 3\n", "line 2: has 3 numbers; expected 6, 4 or 2"),
        ("# A text\n\nof words\n", "1 fault\n  no map of a known kind; --kind forces"),
        ("1 2\nx y\n", "line 2: got 'x y'; expected numbers"),
        ("1 2\n1 nan\n", "line 2: got '1 nan'; expected finite numbers"),
        ("1 2\n1 3\n", "the map has no area"),
        ("[OBSTACLE]\n1 1\n2 2\n1 2\n", "has no [BORDER] section"),
        ("5\n[BORDER]\n0 0\n1 0\n1 1\n", "line 1: '5' stands before the first [TAG]"),
        ("[BORDER]\n0 0\n1 1\n", "line 1: [BORDER] has 2 corners; expected 3 or more"),
        (f"{SQUARE}{SQUARE}", "line 6: a second [BORDER]; expected one border"),
        (f"{SQUARE}[OBSTACLE]\n1 1 1\n", "line 7: has 3 numbers; expected x y"),
        (
            "[MAP_POINTS]\n1 0 0\n2 1 0\n3 1 1\n[MAP_BORDER]\n1 2 3 4\n",
            "line 6: names the unknown point 4",
        ),
        ("[MAP_POINTS]\n1 0\n", "line 2: has 2 numbers; expected id x y"),
    ],
)
def test_bad_maps(
    text: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path, text)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneError) as caught:
        import_map("map.txt")
    assert message in str(caught.value)


def test_every_bad_line_is_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError) as caught:
        import_map(written(tmp_path, "1\n1 2\n3 x\n1 2 3\n"))
    assert [f.path for f in caught.value.faults] == ["line 1", "line 3", "line 4"]


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="No such file"):
        import_map(tmp_path / "nowhere.txt")


@pytest.mark.parametrize("side", ["0", "-1", "inf", "nan"])
def test_side_must_be_positive(
    side: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(written(tmp_path, SQUARE))
    with pytest.raises(SystemExit) as stopped:
        main(["scene", "import", path, f"--longest-side={side}"])
    assert stopped.value.code == 2
    assert "a positive number" in capsys.readouterr().err
