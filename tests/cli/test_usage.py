"""Mistakes of a user end with the documented code and one message on stderr."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from argparse import Namespace
from pathlib import Path

import pytest

from mrmg.cli.main import main
from mrmg.cli.parser import make_parser
from mrmg.cli.usage import Parser
from mrmg.errors import ExitCode

BAD_SCENE = """\
format: 1
name: bad
bounds: [0, 0, 30, 20]
robots:
  - {id: r1, model: car, pose: [5, 5]}
  - {id: r2, model: kar, pose: [15, 5, 0]}
goals:
  - {id: g1, cirle: {center: [1, 2], radius: 1}}
"""


def run(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "mrmg", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        check=False,
    )


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ([], "COMMAND"),
        (["fly"], "fly"),
        (["run"], "SCENE"),
        (["run", "quickstart", "--seed", "-1"], "--seed"),
        (["run", "quickstart", "--seed", "x"], "--seed"),
        (["run", "quickstart", "--budget", "0"], "--budget"),
        (["run", "quickstart", "--budget", "nan"], "--budget"),
        (["run", "quickstart", "--trees", "0"], "--trees"),
        (["run", "quickstart", "--trees", "3", "--budget", "2"], "not allowed with"),
        (["plan", "quickstart", "--workers", "0"], "--workers"),
        (["plan", "quickstart", "--objective", "fast"], "two weights such as 1:50"),
        (["plan", "quickstart", "--objective", "0:0"], "two weights such as 1:50"),
        (["plan", "quickstart", "--objective", "1:-2"], "two weights such as 1:50"),
        (["plan", "quickstart", "--time-limit", "0"], "--time-limit"),
        (["plan", "quickstart", "--soc-margin", "1"], "--soc-margin"),
        (["run", "quickstart", "--profile", "fast"], "paper"),
        (["render", "runs/x", "--size", "huge"], "1280x720"),
        (["render", "runs/x", "--size", "0x10"], "1280x720"),
        (["render", "runs/x", "--fps", "0"], "--fps"),
        (["render", "runs/x", "--view", "side"], "chase"),
        (["scene"], "COMMAND"),
        (["scene", "populate", "s.yaml", "--goals", "0"], "--goals"),
        (["scene", "import", "m.txt", "--longest-side", "-3"], "--longest-side"),
    ],
)
def test_wrong_usage_names_the_argument(
    arguments: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    output = capsys.readouterr()
    assert ended.value.code == ExitCode.USAGE
    assert named in output.err
    assert output.out == ""


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("pln", "mrmg: unknown command 'pln' (did you mean 'plan'?)"),
        ("fly", "mrmg: unknown command 'fly'"),
        ("scene chek", "mrmg scene: unknown command 'chek' (did you mean 'check'?)"),
        ("chek x.yaml --json", "mrmg: unknown command 'chek'"),
        ("check x.yaml", "mrmg: unknown command 'check' (did you mean 'scene check'?)"),
        ("scene1", "mrmg: unknown command 'scene1' (did you mean 'run scene1'?)"),
        ("farm.yaml", "mrmg: unknown command 'farm.yaml' (did you mean 'run farm"),
        ("run x --sed 3", "mrmg run: unknown option '--sed' (did you mean '--seed'?)"),
        ("run x --sed=3", "mrmg run: unknown option '--sed' (did you mean '--seed'?)"),
        ("run --sed 3 x", "mrmg run: unknown option '--sed' (did you mean '--seed'?)"),
        ("run x -seed 3", "mrmg run: unknown option '-seed' (did you mean '--seed'?)"),
        ("scene draw x -out y", "unknown option '-out' (did you mean '--out'?)"),
        ("verify x --seed 3", "mrmg verify: unknown option '--seed'\n"),
        ("--seed 3 run x", "mrmg: unknown option '--seed'\n"),
        ("run x y", "mrmg run: unexpected argument 'y'\nusage: mrmg run SCENE"),
        ("run x --seed -1", "mrmg run: argument --seed: '-1' is not a whole number"),
    ],
)
def test_a_mistyped_word_is_answered_with_the_nearest(
    line: str, answer: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(line.split())
    output = capsys.readouterr().err
    assert ended.value.code == ExitCode.USAGE
    assert answer in output
    message, usage = output.splitlines()
    assert usage.startswith("usage: mrmg")
    assert len(message) < 100, "no wall of choices"


@pytest.mark.parametrize(
    "line",
    [
        "run x --se 3",  # the beginning of one option only
        "run x --seed=3",
        "run -- --strange",
        "scene draw x -oy.png",
        "view x --in browser",
    ],
)
def test_words_that_argparse_knows_are_not_refused(line: str) -> None:
    assert make_parser().read(line.split()).command


@pytest.mark.parametrize("verb", ["run", "plan"])
def test_an_invalid_scene_tells_every_fault_and_writes_nothing(
    verb: str, tmp_path: Path
) -> None:
    (tmp_path / "bad.yaml").write_text(BAD_SCENE)
    ended = run(verb, "bad.yaml", cwd=tmp_path)
    assert ended.returncode == ExitCode.INVALID_FILE
    assert ended.stdout == ""
    assert "Traceback" not in ended.stderr
    for path in ("robots.0.pose", "robots.1.model", "goals.0"):
        assert path in ended.stderr
    assert [item.name for item in tmp_path.iterdir()] == ["bad.yaml"]


def test_an_unknown_scene_is_answered_with_the_known_ones(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["scene", "check", "quikstart"]) == ExitCode.INVALID_FILE
    assert "quickstart" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["verify", "execute", "audit", "render", "report"])
def test_steps_ask_for_a_run_folder(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([verb, str(tmp_path / "none")]) == ExitCode.INVALID_FILE
    output = capsys.readouterr()
    assert "not a run folder" in output.err
    assert output.out == ""
    assert list(tmp_path.iterdir()) == []


def test_a_folder_of_something_else_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    code = main(["run", "quickstart", "--no-video", "--out", str(tmp_path)])
    assert code == ExitCode.USAGE
    assert "thesis.tex" in capsys.readouterr().err
    assert [item.name for item in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_file_in_place_of_the_folder_is_told_without_traceback(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out").write_text("a file")
    out = str(tmp_path / "out")
    assert main(["run", "quickstart", "--no-video", "--out", out]) == ExitCode.USAGE
    assert "out" in capsys.readouterr().err


def test_help_tells_the_exit_codes() -> None:
    ended = run("--help")
    assert ended.returncode == ExitCode.OK
    for code in ("0 ", "2 ", "3 ", "4 ", "5 ", "6 ", "7 ", "130 "):
        assert f" {code}" in ended.stdout
    for verb in ("run", "plan", "verify", "execute", "audit", "render", "doctor"):
        assert verb in ended.stdout


def test_a_closed_pipe_is_no_error() -> None:
    ended = subprocess.run(
        f"{sys.executable} -m mrmg scene import missing.txt | true; "
        f"{sys.executable} -m mrmg doctor --json | head -c 1",
        shell=True,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "Traceback" not in ended.stderr
    assert "Exception" not in ended.stderr


@pytest.mark.parametrize(
    ("closed", "words", "code"),
    [
        (">&-", "completion bash", ExitCode.OK),
        ("<&- 2>&-", "scene check none", ExitCode.INVALID_FILE),
        ("2>/dev/full", "scene check none", ExitCode.INVALID_FILE),
    ],
)
def test_the_exit_code_does_not_depend_on_who_listens(
    closed: str, words: str, code: ExitCode
) -> None:
    command = f"{shlex.quote(sys.executable)} -m mrmg {words} {closed}"
    ended = subprocess.run(command, shell=True, capture_output=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (code, b"", b"")


def test_a_failure_is_one_where_the_reader_of_its_message_has_gone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    failed = Namespace(command=lambda options: ExitCode.MISSION_FAILED)
    monkeypatch.setattr(Parser, "read", lambda parser, words: failed)
    reader, writer = os.pipe()
    os.close(reader)
    with open(writer, "w") as stdout:
        monkeypatch.setattr(sys, "stdout", stdout)
        print("mission failed")
        assert main([]) == ExitCode.MISSION_FAILED


def test_a_warning_that_nobody_reads_ends_no_command(tmp_path: Path) -> None:
    (tmp_path / "map.txt").write_text("[SCALE]\n1\n[BORDER]\n0 0\n9 0\n9 9\n0 9\n")
    reader, writer = os.pipe()
    os.close(reader)
    ended = subprocess.run(
        [sys.executable, "-m", "mrmg", "scene", "import", "map.txt", "-o", "map.yaml"],
        stderr=writer,
        cwd=tmp_path,
        check=False,
    )
    os.close(writer)
    assert ended.returncode == ExitCode.OK
    assert (tmp_path / "map.yaml").exists()


def test_too_little_memory_is_told_with_remedies(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    too_long = Namespace(command=lambda options: bytearray(2**62))
    monkeypatch.setattr(Parser, "read", lambda parser, words: too_long)
    assert main([]) == ExitCode.MACHINE
    assert "not enough memory; end other programs" in capsys.readouterr().err


def test_what_an_encoding_lacks_is_escaped(tmp_path: Path) -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "mrmg", "scene", "new", "farm", "-o", "köy.yaml"],
        capture_output=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        check=False,
    )
    assert ended.returncode == ExitCode.OK, ended.stderr
    assert ended.stdout.startswith(rb"k\xf6y.yaml")
