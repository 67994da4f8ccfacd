"""What is given in place of something else is recognised, and the remedy named."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrmg.cli.main import main
from mrmg.errors import ExitCode

SCENE = "format: 1\nbounds: [0, 0, 20, 10]\n"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with a scene, a picture of it, and a finished run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "farm.yaml").write_text(SCENE)
    for run in ("farm-s0", "farm-s1"):
        (tmp_path / "runs" / run).mkdir(parents=True)
        for name in ("run.json", "plan.json"):
            (tmp_path / "runs" / run / name).write_text("{}")
        (tmp_path / "runs" / run / "scene.yaml").write_text(SCENE)
    (tmp_path / "empty").mkdir()
    return tmp_path


def files(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): path.read_text()
        for path in folder.rglob("*")
        if path.is_file()
    }


INVALID, USAGE = ExitCode.INVALID_FILE, ExitCode.USAGE


@pytest.mark.parametrize(
    ("line", "code", "answer"),
    [
        ("run farm", INVALID, "did you mean 'farm.yaml'?"),
        ("plan frm.yaml", INVALID, "did you mean 'farm.yaml'?"),
        ("plan quikstart", INVALID, "did you mean 'quickstart'?"),
        ("plan nothing/like/it", INVALID, "'mrmg scene list' lists the shipped ones"),
        ("run runs/farm-s0", INVALID, "is a run folder; its scene is runs/farm-s0/sce"),
        ("scene check empty", INVALID, "is a folder; expected a scene file"),
        ("verify farm.yaml", INVALID, "if it is a scene, 'mrmg run farm.yaml' makes"),
        ("execute quickstart", INVALID, "if it is a scene, 'mrmg run quickstart' ma"),
        ("audit runs", INVALID, "it holds some; give one: farm-s0, farm-s1"),
        ("render runs/farm-s0/plan.json", INVALID, "a file in one; give runs/farm-s0"),
        ("report runs/farm-s7", INVALID, "did you mean 'runs/farm-s"),
        ("report empty", INVALID, "make one with 'mrmg run'"),
        ("compare farm.yaml runs/farm-s0", INVALID, "if it is a scene, 'mrmg run fa"),
        ("figure runs/frm-s0", INVALID, "did you mean 'runs/farm-s0'?"),
        ("scene draw farm.yaml -o farm.xyz", USAGE, "must end in one of .pdf, .svg"),
        ("scene draw farm.yaml -o farm.yaml", USAGE, "must end in one of .pdf, .svg"),
        ("scene draw farm.yaml -o farm.yaml/a.png", USAGE, "farm.yaml is a file"),
        ("scene import farm.yaml -o empty", INVALID, "farm.yaml: 1 fault"),
        ("scene new .", USAGE, "expected a name such as farm"),
        ("scene new x\udcff", USAGE, r"got 'x\udcff'; expected a name such as farm"),
        (
            "scene import farm.yaml --crop 0 0 inf inf",
            USAGE,
            "--crop: got '0 0 inf",
        ),
        ("scene new farm", USAGE, "farm.yaml is there already"),
    ],
)
def test_what_may_be_meant_is_named(
    line: str,
    code: ExitCode,
    answer: str,
    place: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    before = files(place)
    assert main(line.split()) == code
    output = capsys.readouterr()
    assert answer in output.err
    assert len(output.err) < 300
    assert output.out == ""
    assert files(place) == before


def test_errors_of_writing_name_the_file_that_is_wanted(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = files(place)
    square = "[SCALE]\n1\n[BORDER]\n0 0\n9 0\n9 9\n0 9\n"
    (place / "square.txt").write_text(square)
    assert main(["scene", "import", "square.txt", "-o", "empty"]) == USAGE
    output = capsys.readouterr().err
    assert output.endswith("mrmg: empty is a folder; name a file instead\n")
    assert main(["scene", "import", "square.txt", "-o", "square.txt/a.yaml"]) == USAGE
    output = capsys.readouterr().err
    wanted = "square.txt is a file, and a folder is needed there; name another place\n"
    assert output.endswith(wanted)
    assert files(place) == {**before, "square.txt": square}


@pytest.mark.parametrize("port", ["0", "65536", "http", "-1"])
def test_a_port_is_a_port(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["view", "quickstart", "--in", "browser", "--port", port])
    assert ended.value.code == USAGE
    assert "--port" in capsys.readouterr().err
