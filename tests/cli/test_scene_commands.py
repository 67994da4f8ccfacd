from __future__ import annotations

import io
import json
import re
import shlex
import shutil
import sys
import tempfile
from math import hypot
from pathlib import Path

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrmg import shipped
from mrmg.cli import scene_commands
from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.loading.faults import keys_of
from mrmg.scene.loading.hints import heading_hints
from mrmg.scene.loading.schema import SECTIONS, BatteryEntry, SceneDocument
from mrmg.scene.loading.yaml_text import dump_yaml, parse_yaml
from mrmg.scene.new_scene import new_scene

SQUARE_MAP = """\
[SCALE]
1
[BORDER]
0 0
200 0
200 150
0 150
[OBSTACLE]
60 60
90 60
90 90
60 90
[OBSTACLE]
130 30
150 30
150 120
130 120
"""


@pytest.fixture
def map_file(tmp_path: Path) -> Path:
    path = tmp_path / "square.txt"
    path.write_text(SQUARE_MAP)
    return path


def test_check_tells_what_a_scene_holds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scene", "check", "quickstart"]) == ExitCode.OK
    scene = load_scene("quickstart")
    assert f"{len(scene.goals)} goals" in capsys.readouterr().out


@pytest.mark.slow
def test_a_new_scene_is_written_once_and_can_be_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["scene", "new", "my farm"]) == ExitCode.OK
    path, _, *steps = capsys.readouterr().out.splitlines()
    assert path == "my farm.yaml"
    text = (tmp_path / path).read_text()
    assert load_scene(path).name == "my farm"
    for step in steps[:-1]:
        assert main(shlex.split(step)[1:]) == ExitCode.OK
    assert (
        capsys.readouterr().out.splitlines()[0].startswith("my farm: valid; 2 robots")
    )
    assert main([*shlex.split(steps[-1])[1:], "--no-video"]) == ExitCode.OK

    assert main(["scene", "new", "my farm.yaml"]) == ExitCode.USAGE
    assert main(["scene", "new", "other", "-o", path]) == ExitCode.USAGE
    assert "is there already" in capsys.readouterr().err
    assert (tmp_path / path).read_text() == text


@pytest.mark.parametrize("name", ["1e3", "no", "a: b", "x" * 60, "sub/farm", "#1"])
def test_a_new_scene_may_have_any_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["scene", "new", name]) == ExitCode.OK
    assert load_scene(f"{name}.yaml").name == Path(name).name


def test_a_new_scene_shows_every_common_key() -> None:
    """The keys that are not in use are right, one by one and together."""
    lines = new_scene("field").splitlines()
    unused = [n for n, line in enumerate(lines) if re.match(r"#(\w|  )", line)]
    assert len(unused) >= 6
    entries = [n for n in unused if not lines[n].startswith("#    ")]
    last = [n for n in unused if n >= entries[-1]]
    for chosen in [*([n] for n in entries[:-1]), last, unused]:
        text = "\n".join(
            line[1:] if n in chosen else line for n, line in enumerate(lines)
        )
        scene_from_document(parse_yaml(text, source="new"), source="new")
    shown = set(re.findall(r"\w+", "\n".join(lines)))
    for entry in (SceneDocument, *SECTIONS.values(), BatteryEntry):
        assert set(keys_of(entry)) - {"holes", "rolling_factor"} <= shown


def test_the_list_shows_every_shipped_scene(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scene", "list"]) == ExitCode.OK
    _, *rows = capsys.readouterr().out.splitlines()
    assert [row.split()[0] for row in rows] == shipped.scene_names()
    for row in rows:
        name, *figures = row.split()[:7]
        scene = load_scene(name)
        x_min, y_min, x_max, y_max = scene.bounds
        size = [f"{x_max - x_min:g}", "x", f"{y_max - y_min:g}"]
        counts = [len(scene.robots), len(scene.goals), len(scene.stations)]
        assert figures == [*map(str, counts), *size]
        assert row.endswith(".")
        assert len(row) < 150


DEGREES = """\
format: 1
bounds: [0, 0, 60, 40]
obstacles:
  - {id: shed, box: {center: [30, 30], size: [6, 4], yaw: -45}}
terrain:
  - {box: {center: [10, 30], size: [6, 4], yaw: 6.2}, multiplier: 2}
goals:
  - {id: g1, circle: {center: [50, 20], radius: 1.5}}
battery: {capacity_m: 20}
robots:
  - {id: r1, model: car, pose: [5, 5, -3.1416]}
  - id: r2
    model: diffdrive
    pose:
      - 5
      - 15
      - 90
    finish:
      circle: {center: [9, 9], radius: 1}
      heading: 180
"""


def test_check_warns_of_degrees_and_of_batteries(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "turned.yaml"
    path.write_text(DEGREES)
    assert main(["scene", "check", str(path)]) == ExitCode.OK
    first, *lines = capsys.readouterr().out.splitlines()
    warnings = [line for line in lines if not line.startswith("  margins: ")]
    assert [line for line in lines if "m from obstacles" in line] == lines[-2:]
    assert first.startswith("turned: valid; 2 robots, 1 goal, 0 stations")
    looks = "rad looks like degrees;"
    assert warnings[:3] == [
        f"  warning: robots.1 (r2), line 17: heading 90 {looks} 90 deg is 1.5708 rad",
        "  warning: robots.1 (r2), line 20: "
        f"finish heading 180 {looks} 180 deg is 3.1416 rad",
        "  warning: obstacles.0 (shed), line 4: "
        f"yaw -45 {looks} -45 deg is -0.7854 rad",
    ]
    assert any("g1" in line and "above its reserve" in line for line in warnings[3:])

    assert main(["scene", "check", "--json", str(path)]) == ExitCode.OK
    found = json.loads(capsys.readouterr().out)
    assert found["faults"] == []
    assert len(found["warnings"]) == len(warnings)
    assert (found["warnings"][0]["id"], found["warnings"][0]["line"]) == ("r2", 17)

    main(["plan", str(path), "--out", str(tmp_path / "run")])
    err = capsys.readouterr().err
    assert err.count("looks like degrees") == 1
    assert "(and 2 more: mrmg scene check " in err


def test_check_gives_faults_as_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "turned.yaml"
    path.write_text(DEGREES.replace("radius: 1.5", "radius: -1"))
    assert main(["scene", "check", "--json", str(path)]) == ExitCode.INVALID_FILE
    output = capsys.readouterr()
    found = json.loads(output.out)
    (fault,) = found["faults"]
    assert (fault["path"], fault["id"], fault["line"]) == (
        "goals.0.circle.radius",
        "g1",
        8,
    )
    assert fault["message"] in output.err
    assert len(found["warnings"]) == 3


DOCK = """\
format: 1
name: dock
bounds: [0, 0, 20, 12]
obstacles:
  - {id: wall, box: {center: [16, 6], size: [2, 6]}, height: 1}
battery: {capacity_m: 100}
goals:
  - {id: dock, circle: {center: [CENTER, 6], radius: 0.1}, heading: 0.0}
robots:
  - {id: r1, model: car, pose: [3, 3, 0]}
"""
"""A car's front is 1.5 m ahead of its reference point, and the wall at x = 15 m."""


@pytest.mark.parametrize(
    ("center", "words"),
    [
        ("13.3", ()),
        ("13.53", ("goal dock has too little room", "0.05 m deep", "at most 0.02 m")),
        ("13.7", ("goal dock is unreachable", "with the heading wanted there")),
    ],
)
def test_check_warns_of_places_without_room(
    center: str,
    words: tuple[str, ...],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "dock.yaml"
    path.write_text(DOCK.replace("CENTER", center))
    assert main(["scene", "check", str(path)]) == ExitCode.OK
    warnings = [line for line in capsys.readouterr().out.splitlines() if "warn" in line]
    assert len(warnings) == bool(words)
    assert all(word in warnings[0] for word in words)


@pytest.mark.parametrize("name", shipped.scene_names())
def test_nothing_is_amiss_with_shipped_scenes(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["scene", "check", name]) == ExitCode.OK
    assert "warning" not in capsys.readouterr().out


@given(
    st.recursive(
        st.none() | st.floats() | st.integers() | st.text(max_size=3),
        lambda inner: (
            st.lists(inner, max_size=4)
            | st.dictionaries(
                st.sampled_from(["pose", "box", "yaw", "finish", "heading"]), inner
            )
        ),
        max_leaves=8,
    ),
    st.sampled_from(["robots", "obstacles", "terrain"]),
)
@settings(max_examples=50, deadline=None)
def test_hints_of_any_content_are_faults_only(value: object, section: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "any.yaml"
        path.write_text(dump_yaml({section: value}), encoding="utf-8")
        for hint in heading_hints(path):
            assert "looks like degrees" in hint.message


def test_a_heading_beyond_all_numbers_is_a_fault(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "turned.yaml"
    path.write_text(DEGREES.replace("      - 90", "      - 9" + 350 * "0"))
    assert main(["scene", "check", str(path)]) == ExitCode.INVALID_FILE
    assert "robots.1.pose.2 (r2), line 17: got 9" in capsys.readouterr().err


def test_a_model_with_a_motion_of_its_own_is_placed_where_it_is_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(shipped.models_folder() / "car", "own")
    robot = Path("own/robot.yaml")
    robot.write_text(robot.read_text().replace("model: car", "model: own.py"))
    Path("own/own.py").write_text("# only loaded here")
    words = "scene populate quickstart --model ./own --goals 3 --stations 2 -o o.yaml"
    assert main(words.split()) == ExitCode.INVALID_FILE
    assert main([*words.split(), "--trust-code"]) == ExitCode.OK
    scene = load_scene("o.yaml", trust_code=True)
    assert {robot.model.name for robot in scene.robots} == {"own"}


def test_draw_leaves_a_picture(tmp_path: Path) -> None:
    picture = tmp_path / "q.png"
    assert main(["scene", "draw", "quickstart", "-o", str(picture)]) == ExitCode.OK
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_an_imported_map_is_scaled_and_can_be_populated(
    map_file: Path, tmp_path: Path
) -> None:
    bare, full = tmp_path / "bare.yaml", tmp_path / "full.yaml"
    assert main(["scene", "import", str(map_file), "-o", str(bare)]) == ExitCode.OK
    bounds = load_scene(bare).bounds
    assert max(bounds[2] - bounds[0], bounds[3] - bounds[1]) == pytest.approx(100.0)

    counts = ["--robots", "2", "--goals", "5", "--stations", "3", "--seed", "7"]
    arguments = ["scene", "populate", str(bare), *counts]
    assert main([*arguments, "-o", str(full)]) == ExitCode.OK
    scene = load_scene(full)
    assert (len(scene.robots), len(scene.goals), len(scene.stations)) == (2, 5, 3)


def test_without_a_file_to_write_the_scene_goes_to_stdout(
    map_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["scene", "import", str(map_file)]) == ExitCode.OK
    copy = tmp_path / "copy.yaml"
    copy.write_text(capsys.readouterr().out)
    assert len(load_scene(copy).obstacles) == 2


def test_a_scene_on_stdout_is_as_in_a_file_whatever_the_encoding(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    written = io.BytesIO()
    stdout = io.TextIOWrapper(written, encoding="ascii", errors="backslashreplace")
    monkeypatch.setattr(sys, "stdout", stdout)
    scene_commands._write(load_scene("quickstart").with_(name="köy"), None)
    stdout.flush()
    assert "name: köy\n" in written.getvalue().decode()


def test_a_map_that_is_none_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "letter.txt"
    path.write_text("Dear all,\nthis is no map.\n")
    assert main(["scene", "import", str(path)]) == ExitCode.INVALID_FILE
    output = capsys.readouterr()
    assert "letter.txt" in output.err
    assert output.out == ""


def test_the_roadmap_is_a_graph_other_tools_read(tmp_path: Path) -> None:
    scene = load_scene("quickstart")
    out = tmp_path / "roadmap.graphml"
    assert main(["scene", "roadmap", "quickstart", "-o", str(out)]) == ExitCode.OK
    graph = nx.read_graphml(out)
    found = {data["target"] for _, data in graph.nodes(data=True) if "target" in data}
    assert found == {target.id for target in scene.targets()}
    for one, other, weight in graph.edges(data="weight"):
        a, b = graph.nodes[one], graph.nodes[other]
        assert weight >= 0.999 * hypot(a["x_m"] - b["x_m"], a["y_m"] - b["y_m"])


def test_the_roadmap_is_the_one_that_is_planned_on(tmp_path: Path) -> None:
    """It leads through gaps that only a smaller margin opens, where they lie."""
    document = {
        "format": 1,
        "name": "gap",
        "bounds": [100, 50, 124, 64],
        "obstacles": [
            {"id": "south", "box": {"center": [112, 53.175], "size": [0.3, 6.35]}},
            {"id": "north", "box": {"center": [112, 60.825], "size": [0.3, 6.35]}},
        ],
        "goals": [{"id": "g", "circle": {"center": [104, 59], "radius": 1}}],
        "battery": {"capacity_m": 200},
        "robots": [{"id": "r1", "model": "car", "pose": [120, 60, 3.0]}],
    }
    scene, out = tmp_path / "gap.yaml", tmp_path / "roadmap.graphml"
    scene.write_text(dump_yaml(document))
    assert main(["scene", "roadmap", str(scene), "-o", str(out)]) == ExitCode.OK
    graph = nx.read_graphml(out)
    assert nx.has_path(graph, "0", "1")
    goal, start = ((graph.nodes[i]["x_m"], graph.nodes[i]["y_m"]) for i in "01")
    assert goal == pytest.approx((104.0, 59.0))
    assert start == pytest.approx((120.0, 60.0))
