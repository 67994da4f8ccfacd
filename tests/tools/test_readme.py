"""What README files and BENCHMARKS.md state is what the project does."""

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
from mrmg.runs.summary_model import summary_schema
from mrmg.scene.loading import scene_from_document

ROOT = Path(__file__).parents[2]
PAGES = {
    name: (ROOT / name).read_text()
    for name in (
        "README.md",
        "BENCHMARKS.md",
        "CONTRIBUTING.md",
        "mrmg/README.md",
        "models/README.md",
        "scenes/README.md",
        "tools/README.md",
        "mrmg/studies/README.md",
    )
}
README, TEXT = PAGES["README.md"], "\n".join(PAGES.values())
VERBS = re.findall(r"^\| `mrmg ([a-z ]+)([^`]*)`", README, re.MULTILINE)
"""Verbs with their arguments."""
LINES = re.findall(r"^    \$ mrmg (.*)", TEXT, re.MULTILINE)
TOOLS = sorted(
    set(
        re.findall(
            r"(?:^    |`)tools/(\w+)(?![\w./])((?: [^\s`]+)*)", TEXT, re.MULTILINE
        )
    )
)
"""Tools with their arguments."""
OPTION = re.compile(r"(?<![\w-])--[a-z-]+")


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)
    assert found is not None
    return found[1]


@pytest.mark.parametrize(("verb", "arguments"), VERBS)
def test_every_verb_exists_with_its_options(
    verb: str, arguments: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        make_parser().parse_args([*verb.split(), "--help"])
    assert ended.value.code == 0
    shown = capsys.readouterr().out
    assert "usage: mrmg" in shown
    assert set(OPTION.findall(arguments)) <= set(OPTION.findall(shown))


@pytest.mark.parametrize("line", LINES)
def test_every_command_line_is_understood(line: str) -> None:
    assert make_parser().parse_args(shlex.split(line)).command


@pytest.mark.parametrize(("tool", "arguments"), TOOLS)
def test_every_tool_exists_with_its_options(tool: str, arguments: str) -> None:
    assert os.access(ROOT / "tools" / tool, os.X_OK)
    own = "\n".join(map(tool_source, (tool, f"{tool}.py")))
    imported = re.findall(r"^(?:from|import) (\w+)", own, re.MULTILINE)
    texts = [own, *(tool_source(f"{name}.py") for name in imported)]
    assert set(OPTION.findall(arguments)) <= set(OPTION.findall("\n".join(texts)))


def tool_source(name: str) -> str:
    path = ROOT / "tools" / name
    return path.read_text() if path.exists() else ""


def test_the_first_page_is_short() -> None:
    assert len(README.splitlines()) <= 200


def test_every_verb_is_listed() -> None:
    parser = make_parser()
    with pytest.raises(SystemExit):
        parser.parse_args(["--help"])
    listed = {verb.split()[0] for verb, _ in VERBS}
    verbs = next(each.choices for each in parser.arguments() if each.choices)
    assert set(verbs) == listed


def test_every_exit_code_is_listed() -> None:
    codes = re.findall(r"^\| (\d+) \| [a-zA-Z]", README, re.MULTILINE)
    assert {int(code) for code in codes} == {*map(int, ExitCode), 130}


def test_every_file_of_a_run_is_listed() -> None:
    for names in OUTPUTS.values():
        assert [name for name in names if f"`{name}`" not in TEXT] == []


def test_the_scene_is_valid() -> None:
    scene = scene_from_document(yaml.safe_load(block("yaml")), source="README")
    assert len(scene.robots) == 2


def test_the_summary_has_the_keys_of_the_schema() -> None:
    known = summary_schema()["properties"]
    shown = json.loads(block("json"))
    assert set(shown) <= set(known)


@pytest.mark.parametrize("page", PAGES)
def test_every_named_path_exists(page: str) -> None:
    text = PAGES[page]
    named = re.findall(r"`((?:mrmg|tools|tests|models|scenes)/[\w./]*)`", text)
    assert [path for path in named if not (ROOT / path).exists()] == []
    linked = re.findall(r"\]\(([\w./]+)(?:#[\w-]+)?\)", text)
    folder = (ROOT / page).parent
    assert [path for path in linked if not (folder / path).exists()] == []


@pytest.mark.parametrize("page", PAGES)
def test_every_linked_section_exists(page: str) -> None:
    folder = (ROOT / page).parent
    for path, section in re.findall(r"\]\(([\w./]*)#([\w-]+)\)", PAGES[page]):
        target = (folder / path).read_text() if path else PAGES[page]
        titles = re.findall(r"^#+ (.*)", target, re.MULTILINE)
        assert section in [title.lower().replace(" ", "-") for title in titles]


@pytest.mark.parametrize(
    "video", ["without a video", pytest.param("as it is", marks=pytest.mark.ci)]
)
def test_the_python_example_runs(
    video: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    example = block("python")
    assert example.count('out="runs/fast"') == 1
    if video == "without a video":
        example = example.replace('"runs/fast"', '"runs/fast", video=None')
    exec(compile(example, "README.md", "exec"), {})
    ok, planned_J, measured_J = capsys.readouterr().out.splitlines()[0].split()
    assert ok == "True"
    assert float(measured_J) == pytest.approx(float(planned_J), rel=0.02)
    assert (tmp_path / "runs" / "fast" / "report.html").exists()
