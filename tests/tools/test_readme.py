"""What the README says is what the project does."""

from __future__ import annotations

import json
import os
import re
import shlex
from pathlib import Path

import pytest
import yaml

from mrmg.cli.parser import make_parser
from mrmg.errors import ExitCode
from mrmg.runs.folder import OUTPUTS
from mrmg.runs.summary import summary_schema
from mrmg.scene.loading import scene_from_document

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
VERBS = re.findall(r"^\| `mrmg ([a-z ]+)([^`]*)`", README, re.MULTILINE)
"""Verbs with their arguments."""
LINES = re.findall(r"^    \$ mrmg (.*)", README, re.MULTILINE)
TOOLS = re.findall(
    r"(?:^    |`)tools/(\w+)(?![\w./])((?: [^\s`]+)*)", README, re.MULTILINE
)
"""Tools with their arguments."""
OPTION = re.compile(r"(?<![\w-])--[a-z-]+")


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found[1]


@pytest.mark.parametrize(("verb", "arguments"), VERBS)
def test_every_verb_exists_with_its_options(
    verb: str, arguments: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        make_parser().parse_args([*verb.split(), "--help"])
    assert ended.value.code == 0
    told = capsys.readouterr().out
    assert "usage: mrmg" in told
    assert set(OPTION.findall(arguments)) <= set(OPTION.findall(told))


@pytest.mark.parametrize("line", LINES)
def test_every_command_line_is_understood(line: str) -> None:
    assert make_parser().parse_args(shlex.split(line)).command


@pytest.mark.parametrize(("tool", "arguments"), TOOLS)
def test_every_tool_exists_with_its_options(tool: str, arguments: str) -> None:
    assert os.access(ROOT / "tools" / tool, os.X_OK)
    script = ROOT / "tools" / f"{tool}.py"
    known = OPTION.findall(script.read_text() if script.exists() else "")
    assert set(OPTION.findall(arguments)) <= set(known)


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
