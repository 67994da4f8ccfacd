"""Faults name the entry by its id, and the line of the file that is to be changed."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from mrmg import shipped
from mrmg.errors import Fault, SceneError
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.loading.models import load_model
from mrmg.scene.loading.yaml_text import dump_yaml, read_yaml

BAD = "@bad@"


def plain(source: str) -> dict[str, Any]:
    path = shipped.scenes_folder() / f"{source}.yaml"
    return dict(read_yaml(path, source=source))


def numbers(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the paths of all numbers in plain data."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, item in items:
        if isinstance(item, dict | list):
            yield from numbers(item, (*path, key))
        elif not isinstance(item, str):
            yield (*path, key)


def spoilt(document: dict[str, Any], path: tuple[Any, ...]) -> dict[str, Any]:
    """Return the document with text in place of one number."""
    changed: Any = copy.deepcopy(document)
    inner = changed
    for part in path[:-1]:
        inner = inner[part]
    inner[path[-1]] = BAD
    return dict(changed)


SCENE = plain("mixed")


@pytest.mark.parametrize(
    "written",
    [lambda data: yaml.safe_dump(data, sort_keys=False), dump_yaml],
    ids=["block style: a line for each number", "flow style: a line for each list"],
)
@given(path=st.sampled_from(list(numbers(SCENE))))
@settings(max_examples=40, deadline=None)
def test_a_fault_names_the_line_of_the_value(
    written: Any, path: tuple[Any, ...], tmp_path_factory: pytest.TempPathFactory
) -> None:
    document = spoilt(SCENE, path)
    text = "# a comment first\n\n" + written(document)
    file = tmp_path_factory.mktemp("scene") / "spoilt.yaml"
    file.write_text(text)
    (line,) = (n for n, row in enumerate(text.splitlines(), 1) if BAD in row)
    with pytest.raises(SceneError) as caught:
        load_scene(file)
    (fault,) = (fault for fault in caught.value.faults if BAD in fault.message)
    assert fault.line == line
    entry = document[path[0]][path[1]] if len(path) > 2 else None
    assert fault.id == (entry.get("id") if isinstance(entry, dict) else None)

    with pytest.raises(SceneError) as caught:
        scene_from_document(document, source="test")
    found = [(item.path, item.id, item.line) for item in caught.value.faults]
    assert (fault.path, fault.id, None) in found


HEAD = "format: 1\nbounds: [0, 0, 20, 10]\n"


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (  # an entry over several lines: the line of its key, not of the entry
            "goals:\n  - id: g1\n    circle:\n      center: [5, 5]\n      radius: -1\n",
            "goals.0.circle.radius (g1), line 7:",
        ),
        (  # what is missing has no line but that of its entry
            "goals:\n  - {id: g1, circle: {radius: 1, center: [5, 5]}}\n"
            "  - id: g2\n    circle:\n      center: [5, 5]\n",
            "goals.1.circle.radius (g2), line 6:",
        ),
        (  # flow style over several lines
            "goals: [{id: g1, circle: {center: [5, 5], radius: 1}},\n"
            "  {id: g2,\n   circle: {center: [5, 99],\n   radius: 1}}]\n",
            "goals.1 (g2), line 4:",
        ),
        ("battery:\n  a.b: 1\n", "battery.a.b, line 4:"),
        ("goals: {\u00b2: 1}\n", "goals, line 3:"),
        ("goals: [{id: 7, circle: {center: [5, 5], radius: 1}}]\n", "goals.0.id, line"),
        ("obstacles: [{circle: {center: [5, 5], radius: 0}}]\n", "radius, line 3:"),
        ("name: ''\n", "name, line 3:"),
        ("robots: &r\n  - *r\n", "robots.0, line 3:"),
    ],
)
def test_places(text: str, place: str, tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text(HEAD + text)
    with pytest.raises(SceneError) as caught:
        load_scene(file)
    assert place in str(caught.value)


def test_nothing_is_said_of_lines_where_there_is_none(tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text("format: 1\n")
    with pytest.raises(SceneError) as caught:
        load_scene(file)
    assert [fault.line for fault in caught.value.faults] == [None]


def test_faults_of_a_model_name_the_line_of_its_file(tmp_path: Path) -> None:
    text = (shipped.models_folder() / "car" / "robot.yaml").read_text()
    (tmp_path / "robot.yaml").write_text(text.replace("radius: 0.25", "radius: -0.25"))
    with pytest.raises(SceneError) as caught:
        load_model(tmp_path)
    row = text[: text.index("radius: 0.25")].count("\n") + 1
    assert f"wheel.radius, line {row}: got -0.25" in str(caught.value)


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        (Fault("goals.9", "far", id="g10", line=41), "goals.9 (g10), line 41: far"),
        (Fault("goals.9", "far", id="g10"), "goals.9 (g10): far"),
        (Fault("bounds", "far", line=2), "bounds, line 2: far"),
        (Fault("", "far", line=2), "line 2: far"),
        (Fault("", "far"), "far"),
    ],
)
def test_how_faults_read(fault: Fault, text: str) -> None:
    assert str(fault) == text
