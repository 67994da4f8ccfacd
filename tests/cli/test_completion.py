"""The completion scripts do in each shell what they are for."""

from __future__ import annotations

import argparse
import os
import pty
import re
import select
import shlex
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from mrmg import shipped
from mrmg.cli.completion import SHELLS
from mrmg.cli.main import main
from mrmg.cli.parser import make_parser
from mrmg.cli.usage import Parser


@pytest.fixture
def script(
    request: pytest.FixtureRequest,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> Path:
    """The script of a shell, in a folder with files that may be completed."""
    shell = request.param
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    monkeypatch.chdir(tmp_path)
    for name in ("farm.yaml", "field of peas.yaml", "figure.png"):
        (tmp_path / name).write_text("")
    (tmp_path / "runs" / "farm").mkdir(parents=True)
    assert main(["completion", shell]) == 0
    path = tmp_path / f"completion.{shell}"
    path.write_text(capsys.readouterr().out)
    subprocess.run([shell, "-n", str(path)], check=True)
    return path


def in_bash(script: Path, line: str) -> list[str]:
    """What bash offers for the last word of a line (an empty one after a space)."""
    words = [*shlex.split(line), *([""] if line.endswith(" ") else [])]
    asked = f"""
        source {script}
        COMP_WORDS=({shlex.join(words)})
        COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
        [[ $(complete -p mrmg) == "complete -F _mrmg mrmg" ]] && _mrmg
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    ended = subprocess.run(
        ["bash", "--norc", "-c", asked], capture_output=True, text=True, check=True
    )
    assert ended.stderr == ""
    return [word for word in ended.stdout.splitlines() if word]


def in_fish(script: Path, line: str) -> list[str]:
    asked = f"source {script}; complete -C {shlex.quote(line)}"
    ended = subprocess.run(
        ["fish", "--no-config", "-c", asked], capture_output=True, text=True, check=True
    )
    assert ended.stderr == ""
    return [row.partition("\t")[0] for row in ended.stdout.splitlines()]


OFFERED = {"bash": in_bash, "fish": in_fish}


def verbs(parser: Parser, words: str = "mrmg") -> Iterator[tuple[str, Parser]]:
    yield words, parser
    for name, inner in parser.verbs().items():
        yield from verbs(inner, f"{words} {name}")


@pytest.mark.parametrize("shell", SHELLS)
def test_retired_spellings_are_not_offered(
    shell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert "soc-margin" in script
    assert "spare" not in script
    assert argparse.SUPPRESS not in script


@pytest.mark.parametrize("script", ["bash", "fish"], indirect=True)
def test_all_verbs_and_options_are_offered(script: Path) -> None:
    offered = OFFERED[script.suffix[1:]]
    for words, parser in verbs(make_parser()):
        shown = [name for each in parser.arguments() for name in each.option_strings]
        long = [name for name in shown if name.startswith("--")]
        assert sorted(offered(script, f"{words} --")) == sorted(long)
        if parser.verbs():
            assert sorted(offered(script, f"{words} ")) == sorted(parser.verbs())


@pytest.mark.parametrize("script", ["bash", "fish"], indirect=True)
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("mrmg pl", {"plan"}),
        ("mrmg scene ch", {"check"}),
        ("mrmg run quick", {"quickstart"}),
        ("mrmg run --seed 3 quick", {"quickstart"}),
        ("mrmg run far", {"farm.yaml"}),
        ("mrmg scene check fie", {"field of peas.yaml"}),
        ("mrmg run --profile ", {"default", "paper"}),
        ("mrmg run --profile=p", {"paper"}),
        ("mrmg plan --objective m", {"makespan"}),
        ("mrmg verify r", {"runs"}),
        ("mrmg compare runs/farm r", {"runs"}),
        ("mrmg run quickstart --out r", {"runs"}),
        ("mrmg calibrate c", {"car"}),
        ("mrmg figure runs/farm -o fig", {"figure.png"}),
        ("mrmg run x --seed ", set()),
        ("mrmg completion ", set(SHELLS)),
    ],
)
def test_what_is_offered(script: Path, line: str, expected: set[str]) -> None:
    shell = script.suffix[1:]
    typed = line.replace("--profile=p", "--profile = p") if shell == "bash" else line
    found = OFFERED[shell](script, typed)
    assert {word.rstrip("/").removeprefix("--profile=") for word in found} == expected


@pytest.mark.parametrize("script", ["bash", "fish"], indirect=True)
def test_all_shipped_scenes_are_offered(script: Path) -> None:
    found = OFFERED[script.suffix[1:]](script, "mrmg scene draw ")
    assert set(shipped.scene_names()) <= set(found)
    assert "farm.yaml" in found


def typed_in_zsh(script: Path, lines: list[str]) -> list[str]:
    """What stands on the command line of zsh after each line and a tab."""
    process, terminal = pty.fork()
    if not process:
        os.execvp("zsh", ["zsh", "-f", "-i"])

    def read_until(mark: str) -> str:
        text, end = "", time.monotonic() + 60.0
        while mark not in text:
            assert time.monotonic() < end, text
            if select.select([terminal], [], [], 0.1)[0]:
                text += os.read(terminal, 65536).decode(errors="replace")
        return text

    def write(text: str) -> None:
        os.write(terminal, text.encode())

    shown = 'shown() { print -r -- "<$BUFFER>"; BUFFER= }'
    write("autoload -U compinit; compinit -D -u; zle -N shown; bindkey '^T' shown\n")
    write(f"{shown}; source {script}; print re''ady\n")
    read_until("ready")
    found = []
    for line in lines:
        write(f"{line}\t\x14")
        found += re.findall(r"<(.*)>", read_until(">\r\n"))
    write("exit\n")
    os.waitpid(process, 0)
    os.close(terminal)
    return found


@pytest.mark.parametrize("script", ["zsh"], indirect=True)
def test_zsh_completes_what_is_typed(script: Path) -> None:
    expected = {
        "mrmg pl": "mrmg plan ",
        "mrmg scene ch": "mrmg scene check ",
        "mrmg scene check --tr": "mrmg scene check --trust-code ",
        "mrmg run quick": "mrmg run quickstart ",
        "mrmg run --seed 3 quick": "mrmg run --seed 3 quickstart ",
        "mrmg run --prof": "mrmg run --profile ",
        "mrmg run --profile p": "mrmg run --profile paper ",
        "mrmg run far": "mrmg run farm.yaml ",
        "mrmg scene check fie": r"mrmg scene check field\ of\ peas.yaml ",
        "mrmg verify r": "mrmg verify runs/",
        "mrmg compare runs/farm r": "mrmg compare runs/farm runs/",
        "mrmg calibrate hau": "mrmg calibrate hauler ",
        "mrmg figure runs/farm --kind m": "mrmg figure runs/farm --kind map ",
        "mrmg completion fi": "mrmg completion fish ",
    }
    assert typed_in_zsh(script, list(expected)) == list(expected.values())
