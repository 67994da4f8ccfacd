"""What a calibration leaves: a calibrated copy of the model, and the figures."""

from __future__ import annotations

from pathlib import Path

from mrmg import shipped, storage
from mrmg.errors import UsageError
from mrmg.scene.loading.editing import with_values
from mrmg.scene.loading.yaml_text import dump_yaml
from mrmg.studies.calibration.calibrate import Calibration
from mrmg.studies.calibration.log_calibration import LogCalibration

MODEL_FILE = "robot.yaml"
RESULT_FILE = "calibration.json"
TERRAIN_FILE = "terrain.yaml"
PAGE_FILE = "calibration.html"

_TERRAIN_HEAD = """\
# Terrain entries for scenes with the robot '{name}' calibrated from logs.
# Copy them to the scene's `terrain`, and give each its polygon, box or circle.
# multiplier and turning_multiplier are relative to '{plain}', the plain ground of
# robot.yaml; energy_spread is from run to run.
"""


def write_calibration(
    calibration: Calibration | LogCalibration,
    model_folder: Path,
    folder: Path,
    *,
    in_place: bool,
) -> None:
    """Write the calibrated model and the result of the fit.

    Args:
        calibration: what was found, in MuJoCo or in logs.
        model_folder: the model as it was; changed only if `in_place`.
        folder: receives a copy of the model folder with the calibrated `robot.yaml`,
            and `calibration.json`.
        in_place: write the calibrated `robot.yaml` into `model_folder`, too.

    Raises:
        SceneError: if `robot.yaml` cannot be changed.
    """
    source = model_folder / MODEL_FILE
    text = with_values(
        source.read_text(encoding="utf-8"), calibration.changes(), source=str(source)
    )
    for path in sorted(model_folder.rglob("*")):
        if path.is_file() and path != source:
            copy = folder / path.relative_to(model_folder)
            storage.write_bytes(copy, path.read_bytes())
    storage.write_text(folder / MODEL_FILE, text)
    storage.write_json(folder / RESULT_FILE, calibration.to_json())
    if in_place:
        storage.write_text(source, text)


def write_terrain(calibration: LogCalibration, folder: Path) -> None:
    """Write the terrain entries that scenes may take over."""
    plain = calibration.terrains[0].name
    head = _TERRAIN_HEAD.format(name=calibration.model.name, plain=plain)
    entries = [item.entry() for item in calibration.terrains]
    storage.write_text(folder / TERRAIN_FILE, head + dump_yaml({"terrain": entries}))


def require_changeable(model_folder: Path, folder: Path, *, in_place: bool) -> None:
    """Refuse to write the calibrated copy over the model, or over a shipped one.

    Args:
        model_folder: the model.
        folder: where the copy is to lie.
        in_place: whether the model itself is to be changed, too.

    Raises:
        UsageError: if both folders are the same, or a shipped model was to be changed.
    """
    if in_place and model_folder.resolve().parent == shipped.models_folder().resolve():
        name = model_folder.name
        raise UsageError(
            f"--in-place does not change the shipped model '{name}'; make a copy with "
            f"'mrmg robot new NAME --like {name}', and calibrate that"
        )
    if folder.resolve() == model_folder.resolve():
        raise UsageError(
            f"{folder} is the model itself; name another folder, and use --in-place "
            "to change the model"
        )
