"""Figures of scenes show all that the scenes hold, at the widths of a paper."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from method_figure import draw_method
from print_style import COLUMN_IN, PAGE_IN
from problem_figure import draw_problem, draw_problems, problem_legend

from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("quickstart")


def words_of(path: Path) -> list[str]:
    tree = ElementTree.parse(path)
    return [
        element.text or "" for element in tree.iter() if element.tag.endswith("text")
    ]


def width_in(path: Path) -> float:
    found = re.search(r'<svg[^>]* width="([\d.]+)pt"', path.read_text())
    assert found is not None
    return float(found[1]) / 72.0


def test_a_problem_names_its_robots_goals_and_stations(
    scene: Scene, tmp_path: Path, drawn: list[Figure]
) -> None:
    path = tmp_path / "problem.svg"
    draw_problem(scene, path)
    named = {text.get_text() for text in drawn[0].axes[0].texts}
    assert named == {"r1", "r2", "g1", "g2", "g3", "g4", "⚡s1", "×2.5"}
    assert {"goal", "obstacle", "robot at its start"} <= {*words_of(path)}
    assert width_in(path) == pytest.approx(COLUMN_IN, abs=0.01)


def test_problems_stand_side_by_side_under_one_legend(tmp_path: Path) -> None:
    path = tmp_path / "problems.svg"
    scenes = [load_scene(name) for name in ("scene1", "scene4", "quickstart", "scene6")]
    draw_problems(scenes, path)
    words = words_of(path)
    titles = [word for word in words if word.startswith("(")]
    assert titles == ["(a) scene1", "(b) scene4", "(c) quickstart", "(d) scene6"]
    assert words.count("goal") == 1
    assert "obstacle for some robots" in words
    assert width_in(path) == pytest.approx(PAGE_IN, abs=0.01)


def test_the_legend_has_one_entry_for_all_terrain() -> None:
    names = [handle.get_label() for handle in problem_legend([load_scene("scene1")])]
    assert names[-1] == "terrain: × energy"
    assert len(names) == len(set(names)) == 6


def test_the_method_is_drawn_from_the_lines_it_is_given(
    scene: Scene, tmp_path: Path
) -> None:
    way = np.array([[4.0, 6.0], [10.0, 6.0], [20.0, 20.0]])
    edges = np.stack([way[:-1], way[1:]], axis=1)
    path = tmp_path / "method.svg"
    draw_method(
        scene,
        roadmap=edges,
        multiplier=np.array([1.0, 2.5]),
        tours={"r1": way, "r2": way},
        tree={"r1": edges, "r2": edges},
        paths={"r1": way, "r2": way},
        path=path,
    )
    words = words_of(path)
    assert "(a) roadmap" in words
    assert "(c) motion tree and plan" in words
    assert words[-2:] == ["r1", "r2"]
    again = tmp_path / "again.svg"
    draw_method(
        scene,
        roadmap=edges,
        multiplier=np.array([1.0, 2.5]),
        tours={"r1": way, "r2": way},
        tree={"r1": edges, "r2": edges},
        paths={"r1": way, "r2": way},
        path=again,
    )
    assert again.read_bytes() == path.read_bytes()
