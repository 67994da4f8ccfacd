"""What the README says is what the project does."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import yaml

from mrmg.cli.parser import make_parser
from mrmg.errors import ExitCode
from mrmg.results.summary import summary_schema
from mrmg.run_folder import OUTPUTS
from mrmg.scene.loading import scene_from_document

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
VERBS = re.findall(r"^\| `mrmg ([a-z ]+)", README, re.MULTILINE)


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found[1]


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_exists(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        make_parser().parse_args([*verb.split(), "--help"])
    assert ended.value.code == 0
    assert "usage: mrmg" in capsys.readouterr().out


def test_every_exit_code_is_told() -> None:
    told = {int(code) for code in re.findall(r"^\| (\d+) \|", README, re.MULTILINE)}
    assert told == {*map(int, ExitCode), 130}


def test_every_file_of_a_run_is_told() -> None:
    for names in OUTPUTS.values():
        assert [name for name in names if f"`{name}`" not in README] == []


def test_the_scene_is_valid() -> None:
    scene = scene_from_document(yaml.safe_load(block("yaml")), source="README")
    assert len(scene.robots) == 2


def test_the_summary_has_the_keys_of_the_schema() -> None:
    known = summary_schema()["properties"]
    shown = json.loads(block("json"))
    assert set(shown) <= set(known)


def test_every_named_path_exists() -> None:
    named = re.findall(r"`((?:mrmg|tools|tests|models|scenes)/[\w./]*)`", README)
    named += re.findall(r"\]\(([\w./]+)\)", README)
    assert [path for path in named if not (ROOT / path).exists()] == []
