"""Bad files of every format: one message with place and remedy, nothing written."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrmg.cli.main import main

BAD = Path(__file__).parent / "bad"
FILES = sorted(
    path.relative_to(BAD)
    for path in BAD.rglob("*.*")
    if path.is_file() and path.suffix != ".txt"
)


@pytest.mark.parametrize("file", FILES, ids=str)
def test_message(
    file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(BAD)
    verb = "robot" if file.parent.name == "robots" else "scene"
    out = tmp_path / "made"
    assert main([verb, "import", str(file), "-o", str(out)]) == 3
    found = capsys.readouterr()
    assert found.out == ""
    # Some messages end in the words of a library.
    assert found.err.startswith((BAD / f"{file}.txt").read_text().rstrip("\n"))
    assert not list(tmp_path.iterdir())


def test_a_missing_extra_is_named_with_its_install_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for module in ("rasterio", "xacro"):
        monkeypatch.setitem(__import__("sys").modules, module, None)
    for verb, name, extra in (
        ("scene", "broken.tif", "geo"),
        ("robot", "a.xacro", "ros"),
    ):
        file = BAD / name if verb == "scene" else BAD / "robots" / "macro.xacro"
        assert main([verb, "import", str(file), "-o", str(tmp_path / "made")]) == 7
        assert f"pip install 'mrmg[{extra}]'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_long_scene_of_mrmg(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is told as what it is, however much of a file tells the others."""
    path = tmp_path / "scene.yaml"
    path.write_text(f"format: 1\nname: '{70_000 * 'x'}'\n")
    assert main(["scene", "import", str(path), "-o", str(tmp_path / "made")]) == 3
    assert "a scene of mrmg already" in capsys.readouterr().err


def test_unknown_kind(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scene", "import", str(BAD / "empty.yaml"), "--kind", "geojsn"]) == 2
    assert "did you mean 'geojson'?" in capsys.readouterr().err


@pytest.mark.parametrize("crop", [["1", "2", "3"], ["5,0,1,1"], ["a", "b", "c", "d"]])
def test_crop(crop: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scene", "import", str(BAD / "empty.yaml"), "--crop", *crop]) == 2
    assert "expected X_MIN Y_MIN X_MAX Y_MAX" in capsys.readouterr().err
