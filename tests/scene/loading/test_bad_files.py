"""The zoo: every malformed scene file and the exact message it earns."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrmg.errors import ExitCode, SceneError
from mrmg.scene.loading import load_scene

ZOO = Path(__file__).parents[1] / "bad"
FILES = sorted(path.name for path in ZOO.glob("*.yaml"))


def test_the_zoo_is_not_empty() -> None:
    assert len(FILES) > 50
    assert {Path(name).stem for name in FILES} == {p.stem for p in ZOO.glob("*.txt")}


@pytest.mark.parametrize("name", FILES)
def test_message(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ZOO)
    with pytest.raises(SceneError) as caught:
        load_scene(name)
    expected = (ZOO / name).with_suffix(".txt").read_text()
    assert str(caught.value) + "\n" == expected
    assert caught.value.exit_code == ExitCode.INVALID_FILE


def test_missing_file_names_the_nearest_shipped_scene() -> None:
    with pytest.raises(SceneError, match=r"did you mean 'quickstart'\?"):
        load_scene("quickstrat")


@pytest.mark.parametrize("name", ["long" * 99, f"{'long' * 99}/a.yaml", "a\0b"])
def test_what_no_file_can_be_called_is_missing(name: str) -> None:
    with pytest.raises(SceneError, match="no such file, and no shipped scene"):
        load_scene(name)


def test_folder_is_no_scene(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="is a folder"):
        load_scene(tmp_path)


def test_deep_nesting_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "deep.yaml"
    path.write_text("[" * 100_000)
    with pytest.raises(SceneError, match="nested too deeply"):
        load_scene(path)


def test_mjcf_must_exist(tmp_path: Path) -> None:
    text = (ZOO / "models" / "broken" / "robot.yaml").read_text()
    text = text.replace("wheelbas:", "wheelbase:").replace("-180", "180")
    (tmp_path / "robot.yaml").write_text(text)
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        "format: 1\nbounds: [0, 0, 9, 9]\n"
        "robots: [{id: r, model: ./, pose: [3, 3, 0]}]\n"
    )
    with pytest.raises(
        SceneError, match=r"mjcf, line \d+: got 'car.xml'; no such file"
    ):
        load_scene(scene)
