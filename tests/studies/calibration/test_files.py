"""A calibration leaves a model that can be driven at once; the old one stays."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from mrmg import shipped
from mrmg.cli.calibrate_command import writing_to
from mrmg.errors import RunFolderError, SceneError, UsageError
from mrmg.scene.loading import scene_from_document
from mrmg.scene.loading.models import load_model
from mrmg.studies.calibration.calibrate import Calibration, fit_legs
from mrmg.studies.calibration.files import write_calibration


@pytest.fixture
def model_folder(tmp_path: Path) -> Path:
    folder = tmp_path / "buggy"
    shutil.copytree(shipped.models_folder() / "car", folder)
    (folder / "meshes").mkdir()
    (folder / "meshes" / "hull.obj").write_text("v 0 0 0\n")
    return folder


@pytest.fixture
def calibration(model_folder: Path, synthetic: Callable) -> Calibration:
    model, _ = load_model(model_folder)
    return fit_legs(model, synthetic([0.05, 0.02, 190.0, 70.0], noise_W=0.01))


def test_the_copy_is_a_model_with_the_new_values(
    model_folder: Path, calibration: Calibration, tmp_path: Path
) -> None:
    before = (model_folder / "robot.yaml").read_text()
    out = tmp_path / "out"
    write_calibration(calibration, model_folder, out, in_place=False)
    found, _ = load_model(out)
    assert found.rolling_coefficient == pytest.approx(0.05, rel=1e-3)
    assert found.turning_coefficient == pytest.approx(0.02, rel=1e-3)
    assert found.effective_mass_kg == pytest.approx(190.0, rel=1e-3)
    assert found.mjcf.read_text() == calibration.model.mjcf.read_text()
    assert (out / "meshes" / "hull.obj").exists()
    assert json.loads((out / "calibration.json").read_text())["model"] == "buggy"
    assert (model_folder / "robot.yaml").read_text() == before
    robot = {"id": "r1", "model": str(out), "pose": [5, 5, 0]}
    document = {"format": 1, "name": "x", "bounds": [0, 0, 9, 9], "robots": [robot]}
    assert scene_from_document(document, source="test").robots[0].model.name == "out"


def test_every_line_keeps_its_comment_and_tells_its_source(
    model_folder: Path, calibration: Calibration, tmp_path: Path
) -> None:
    before = (model_folder / "robot.yaml").read_text().splitlines()
    write_calibration(calibration, model_folder, tmp_path / "out", in_place=False)
    after = (tmp_path / "out" / "robot.yaml").read_text().splitlines()
    changed = [pair for pair in zip(before, after, strict=True) if pair[0] != pair[1]]
    assert len(changed) == 3
    for old, new in changed:
        assert old.partition("#")[2].partition(";")[0] in new
        assert "; calibrated in MuJoCo " in new
        assert "+-" in new


def test_in_place_changes_the_model_itself_too(
    model_folder: Path, calibration: Calibration, tmp_path: Path
) -> None:
    write_calibration(calibration, model_folder, tmp_path / "out", in_place=True)
    text = (tmp_path / "out" / "robot.yaml").read_text()
    assert (model_folder / "robot.yaml").read_text() == text
    assert not (model_folder / "calibration.json").exists()


def test_a_model_file_that_lacks_a_value_is_refused_and_nothing_written(
    model_folder: Path, calibration: Calibration, tmp_path: Path
) -> None:
    text = (model_folder / "robot.yaml").read_text()
    (model_folder / "robot.yaml").write_text(text.replace("turning_c", "# turning_c"))
    with pytest.raises(SceneError, match="turning_coefficient: missing"):
        write_calibration(calibration, model_folder, tmp_path / "out", in_place=False)
    assert not (tmp_path / "out").exists()


def test_two_calibrations_do_not_write_to_one_folder_at_once(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    with writing_to(folder, overwrite=False):
        (folder / ".part-growing").write_bytes(b"half")
        second = writing_to(folder, overwrite=True)
        with pytest.raises(RunFolderError, match="another mrmg process"), second:
            pass
        assert (folder / ".part-growing").exists()
        (folder / "robot.yaml").write_text("of the first one\n")
    third = writing_to(folder, overwrite=False)
    with pytest.raises(UsageError, match="--overwrite"), third:
        pass
    with writing_to(folder, overwrite=True):
        assert not list(folder.glob(".part-*"))
