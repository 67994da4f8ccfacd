from __future__ import annotations

from math import hypot
from pathlib import Path

import networkx as nx
import pytest

from mrmg.cli import main
from mrmg.errors import ExitCode
from mrmg.scene.loading import load_scene

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


def test_a_map_that_is_none_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "letter.txt"
    path.write_text("Dear all,\nthis is no map.\n")
    assert main(["scene", "import", str(path)]) == ExitCode.INVALID_FILE
    told = capsys.readouterr()
    assert "letter.txt" in told.err
    assert told.out == ""


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
