"""Editors find a schema for every scene and model, and it says what the loader says."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrmg import shipped
from mrmg.cli.main import main
from mrmg.errors import SceneError
from mrmg.runs import summary_model
from mrmg.scene.loading import scene_from_document
from mrmg.scene.loading.faults import keys_of
from mrmg.scene.loading.json_schema import robot_schema, scene_schema
from mrmg.scene.loading.models import ModelDocument
from mrmg.scene.loading.schema import SceneDocument
from mrmg.scene.loading.yaml_text import read_yaml
from mrmg.shipped import with_modeline

FILES = [
    *sorted(shipped.scenes_folder().glob("*.yaml")),
    *sorted(shipped.models_folder().glob("*/robot.yaml")),
]


def named_schema(path: Path) -> Path:
    """The schema file that the modeline of a YAML file names."""
    pattern = r"^# yaml-language-server: \$schema=(\S+)$"
    (name,) = re.findall(pattern, path.read_text(), re.MULTILINE)
    return (path.parent / name).resolve()


@pytest.mark.parametrize(
    "path", FILES, ids=lambda path: f"{path.parent.name}/{path.name}"
)
def test_shipped_files_follow_the_schema_that_they_name(path: Path) -> None:
    schema = json.loads(named_schema(path).read_text())
    validator = jsonschema.validators.validator_for(schema)
    validator.check_schema(schema)
    validator(schema).validate(read_yaml(path, source=str(path)))


@pytest.mark.parametrize(
    ("words", "file"),
    [
        ([], shipped.scene_schema_file()),
        (["--robot"], shipped.robot_schema_file()),
        (["--summary"], Path(summary_model.__file__).with_name("summary.schema.json")),
    ],
)
def test_the_shipped_schemas_are_those_that_are_printed(
    words: list[str], file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """After a change of the format: mrmg scene schema [--robot|--summary] > FILE."""
    assert main(["scene", "schema", *words]) == 0
    assert file.read_text() == capsys.readouterr().out


def properties(node: Any, name: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield all properties of a schema, by their names."""
    if isinstance(node, list):
        for item in node:
            yield from properties(item, name)
    elif isinstance(node, dict):
        for key, value in node.items():
            if key == "properties":
                yield from ((f"{name}.{inner}", value[inner]) for inner in value)
                for inner, item in value.items():
                    yield from properties(item, f"{name}.{inner}")
            else:
                yield from properties(value, key if name == "$defs" else name or key)


@pytest.mark.parametrize("schema", [scene_schema(), robot_schema()])
def test_an_editor_can_explain_every_key(schema: dict[str, Any]) -> None:
    found = dict(properties(schema))
    assert len(found) > 25
    unexplained = [name for name, item in found.items() if not item.get("description")]
    assert unexplained == []


def test_an_editor_can_complete_keys_and_words() -> None:
    schema = scene_schema()
    assert set(schema["properties"]) == set(SceneDocument.model_fields)
    assert set(robot_schema()["properties"]) == set(keys_of(ModelDocument))
    robot = schema["$defs"]["RobotEntry"]["properties"]
    assert robot["model"]["anyOf"][0]["examples"] == shipped.model_names()
    assert robot["energy"]["enum"] == ["full", "paper"]
    assert schema["properties"]["objective"]["anyOf"][0]["enum"] == [
        "energy",
        "makespan",
    ]


SCENE = read_yaml(shipped.scenes_folder() / "mixed.yaml", source="mixed")
VALIDATOR = jsonschema.Draft7Validator(scene_schema())


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, item in items:
        yield (*path, key)
        if isinstance(item, dict | list):
            yield from places(item, (*path, key))


@given(
    place=st.sampled_from(list(places(SCENE))),
    value=st.sampled_from(
        ["delete", "x", "", -1, 0, 3, 0.5, True, [], [1], {}, {"x": 1}]
    ),
)
@settings(max_examples=60, deadline=None)
def test_schema_and_loader_refuse_the_same(place: tuple[Any, ...], value: Any) -> None:
    document: Any = copy.deepcopy(SCENE)
    inner = document
    for part in place[:-1]:
        inner = inner[part]
    if value == "delete":
        del inner[place[-1]]
    else:
        inner[place[-1]] = value
    document.setdefault("name", "mixed")
    try:
        scene_from_document(document, source="test")
        faults = []
    except SceneError as error:
        faults = list(error.faults)
    refused = not VALIDATOR.is_valid(document)
    assert not refused or faults, "an editor marks what the loader takes"
    spelling = [
        fault
        for fault in faults
        if re.search("missing|unknown key|expected a|must be [<>]", fault.message)
    ]
    if not refused:
        assert spelling == [], "the loader refuses the spelling of what no editor marks"


@pytest.mark.parametrize("folder", ["plain", "with space"])
def test_a_new_file_names_a_schema_that_is_there(tmp_path: Path, folder: str) -> None:
    schema = tmp_path / folder / "s.json"
    text = with_modeline("# about\nformat: 1\n", schema)
    again = with_modeline(text, schema)
    assert again == text
    first, rest = text.split("\n", 1)
    assert rest == "# about\nformat: 1\n"
    name = first.removeprefix("# yaml-language-server: $schema=")
    assert name == (schema.as_uri() if " " in folder else str(schema))
    other = with_modeline(text, tmp_path / "other.json")
    assert other.count("$schema") == 1
    assert "s.json" not in other
