"""Robot models: `robot.yaml` to `RobotModel`.

A model is a folder with `robot.yaml`, whose keys are those of `ModelDocument`, and the
MJCF file it names, which must describe the same robot (`consistency`). Without an MJCF
file, or with a motion of the user's own (`motion_model: FILE.py`), it can be planned
for and verified, but not driven in MuJoCo.
Units: m, kg, s, rad, J.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import shapely
from pydantic import Field

from mrmg import shipped, storage
from mrmg.energy.model import EnergyPreset
from mrmg.errors import Fault, SceneError, UsageError, nearest
from mrmg.scene.loading.faults import validated
from mrmg.scene.loading.margins_schema import MarginsEntry, TrackingErrorEntry
from mrmg.scene.loading.places import lines_of
from mrmg.scene.loading.shape_schema import (
    NamedWithUnits,
    NotNegative,
    Point,
    Positive,
    Strict,
    values_of,
)
from mrmg.scene.loading.trust import file_within, refusal_of_code
from mrmg.scene.loading.yaml_text import parse_yaml, read_text
from mrmg.scene.motor import Motor
from mrmg.scene.robot_model import MAX_CORNERS, Limits, ModelOrigin, RobotModel

SHIPPED_MOTIONS = ("car", "unicycle")
"""Motion models that need no file of their own."""

Share = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]


class WheelEntry(NamedWithUnits):
    """One wheel."""

    wheel_radius_m: Positive
    """rolling radius in m"""
    wheel_inertia_kg_m2: NotNegative
    """spin inertia of one wheel and its share of the drive in kg m^2"""
    wheel_count: Annotated[int, Field(ge=1)]
    """number of wheels"""
    wheel_mass_kg: Positive
    """mass of one wheel in kg"""


class LimitsEntry(NamedWithUnits):
    """Bounds of state and control."""

    v_min_m_s: Annotated[float, Field(le=0, allow_inf_nan=False)]
    """fastest reverse speed in m/s, negative or 0"""
    v_max_m_s: Positive
    """fastest forward speed in m/s"""
    w_max: Positive
    """steering angle in rad (car), or yaw rate in rad/s (unicycle)"""
    u1_max_m_s2: Positive
    """acceleration in m/s^2"""
    u2_max: Positive
    """steering rate in rad/s (car), or yaw acceleration in rad/s^2"""


class MotorEntry(NamedWithUnits):
    """The motors of a side as one, and their gear."""

    torque_constant_Nm_A: Positive
    """torque per current in N m/A"""
    back_emf_constant_V_s: Positive
    """voltage per speed in V s/rad"""
    resistance_Ohm: Positive
    """of the winding in Ohm"""
    gear_ratio: Positive
    """turns of the motor per turn of the wheel"""
    gear_efficiency: Share
    """from motor to wheel, in (0, 1]"""
    no_load_current_A: NotNegative = 0.0
    """current in A that turns motor and gear alone"""


class ModelDocument(NamedWithUnits):
    """The content of `robot.yaml`."""

    format: Literal[1]
    """format: 1"""
    motion_model: Annotated[str, Field(min_length=1)]
    """'car', 'unicycle', or a Python file of the model's folder"""
    footprint: Annotated[list[Point], Field(min_length=3)]
    """convex outline, at least 3 corners [x, y] in m; x forward, y left, from the
    middle of the rear axle"""
    height_m: Positive
    """height of the body in m"""
    wheelbase_m: Positive
    """distance of the axles in m"""
    track_m: Positive
    """distance of the wheels of an axle in m"""
    skid_track_m: Positive | None = None
    """effective track in m where wheels skid in turns; for logs"""
    mass_kg: Positive
    """mass of the whole robot in kg"""
    center_of_mass_m: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    """centre of mass ahead of the rear axle in m"""
    wheel: WheelEntry
    """its wheels"""
    limits: LimitsEntry
    """bounds of speed, turning and control"""
    planning_share: Share
    """share of the limits that plans use, in (0, 1]; the rest is for control"""
    rolling_coefficient: Positive
    """rolling resistance on plain ground as a share of the weight"""
    turning_coefficient: NotNegative
    """tyre scrub as a share of the weight, over wheelbase times turn"""
    friction_coefficient: Positive
    """friction of tyre on ground"""
    drive_efficiency: Share
    """from battery to wheel, in (0, 1]"""
    regeneration_efficiency: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
    """from wheel to battery when braking, in [0, 1]"""
    idle_power_W: NotNegative
    """power of the electronics in W"""
    device_power_W: NotNegative = 0.0
    """power of what it carries in W"""
    energy_preset: EnergyPreset = Field(alias="energy", default="full")
    """which parts of the energy model count"""
    battery_capacity_J: Positive
    """capacity of the standard battery in J"""
    margins: MarginsEntry | None = None
    """distances that plans keep; default: by tracking_error"""
    tracking_error: TrackingErrorEntry | None = None
    """largest tracking errors shown in MuJoCo"""
    motor: MotorEntry | None = None
    """motors of each side, for logs of currents"""
    mjcf: Annotated[str, Field(min_length=1)] | None = None
    """MJCF file in the folder; without it, not driven"""


def model_folder(reference: str, base: Path | None) -> Path:
    """Return the folder a scene's `model` names.

    Raises:
        UsageError: if there is none.
    """
    if "/" in reference:
        folder = (base or Path.cwd()) / reference  # as it is where it is absolute
        if os.path.isfile(folder / "robot.yaml"):  # no name that is too long
            return folder.resolve()
        raise UsageError(f"got '{reference}'; no such folder with a robot.yaml")
    names = shipped.model_names()
    if reference in names:
        return shipped.models_folder() / reference
    raise UsageError(
        f"unknown model '{reference}'{nearest(reference, names)}; shipped models: "
        f"{', '.join(names)}; or give the path of a folder, with a '/' in it"
    )


def with_reference(wanted: Any, reference: str) -> Any:
    """Return a robot's `model` with another name or folder of the model."""
    return {**wanted, "like": reference} if isinstance(wanted, dict) else reference


def load_model(
    folder: Path,
    *,
    source: str | None = None,
    changes: Mapping[str, Any] | None = None,
    trust_code: bool = False,
) -> tuple[RobotModel, dict[str, Any]]:
    """Read the model in `folder`.

    Args:
        folder: holds `robot.yaml`.
        source: what error messages call the file; default its path.
        changes: values that replace some of the file's, by its keys.
        trust_code: whether a motion that is a Python file of the folder may run.

    Returns:
        The model, and its parameters as plain data, for `WrittenScene.legacy_digest`.

    Raises:
        SceneError: naming every fault of its `robot.yaml`.
    """
    path = folder / "robot.yaml"
    source = source or str(path)
    is_shipped = folder.parent == shipped.models_folder()
    with lines_of(path):
        text = read_text(path, source=source)
        document = parse_yaml(text, source=source)
        model, parameters = _checked_model(folder, document, source, trust_code)
        reference = folder.name if is_shipped else str(folder)
        origin = ModelOrigin(reference, text, model)
        if changes:
            changed = _merged(document, changes)
            source = f"{source} with another {', '.join(map(str, changes))}"
            model, parameters = _checked_model(folder, changed, source, trust_code)
    return replace(model, origin=origin), parameters


def _merged(document: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(document)
    for key, value in changes.items():
        both = isinstance(value, Mapping) and isinstance(merged.get(key), Mapping)
        merged[key] = _merged(merged[key], value) if both else value
    return merged


def _checked_model(
    folder: Path, document: Any, source: str, trust_code: bool
) -> tuple[RobotModel, dict[str, Any]]:
    """Return the model that the content of a `robot.yaml` states."""
    entry = validated(ModelDocument, document, source)
    faults = _motion_faults(entry, folder, trust_code) + _geometry_faults(entry)
    mjcf = None if entry.mjcf is None else file_within(folder, entry.mjcf)
    if isinstance(mjcf, str):
        faults.append(Fault("mjcf", mjcf))
    if faults and entry.motion_model not in SHIPPED_MOTIONS:
        raise SceneError(source, faults)  # what it names may be no file at all
    model = _model(folder, entry)
    if isinstance(mjcf, Path) and entry.motion_model in SHIPPED_MOTIONS:
        known = {fault.path for fault in faults}
        found = _differences(model, mjcf, entry)
        faults += [fault for fault in found if fault.path not in known]
    if faults:
        raise SceneError(source, faults)
    parameters = _parameters(entry)
    if entry.motion_model not in SHIPPED_MOTIONS:
        # The content of the file counts for a digest, not its name.
        file = folder / entry.motion_model
        parameters["motion_model"] = storage.digest(read_text(file, source=str(file)))
    return model, parameters


def _parameters(entry: ModelDocument) -> dict[str, Any]:
    # Keys left at their defaults stay out: files without them keep their digests. How
    # well a model was tracked is no part of what it is.
    return entry.model_dump(
        mode="json", by_alias=True, exclude_defaults=True, exclude={"tracking_error"}
    )


def _differences(model: RobotModel, mjcf: Path, entry: ModelDocument) -> list[Fault]:
    """Return where the MJCF describes another robot, but for unchanged shipped ones.

    Those are held by a test: MuJoCo takes as long to import as a plan takes to make.
    """
    if shipped.is_unchanged_model(_parameters(entry), mjcf):
        return []
    from mrmg.scene.loading.consistency import mjcf_faults

    stated = "center_of_mass_m" in entry.model_fields_set
    return mjcf_faults(model, mjcf, entry.wheel.wheel_mass_kg, center_stated=stated)


def _motion_faults(entry: ModelDocument, folder: Path, trust_code: bool) -> list[Fault]:
    name = entry.motion_model
    if name in SHIPPED_MOTIONS:
        return []
    if not name.endswith(".py"):
        message = (
            f"got '{name}'; must be 'car' or 'unicycle', or the name of a Python file "
            "in the model's folder"
        )
        return [Fault("motion_model", message)]
    file = file_within(folder, name)
    if isinstance(file, Path):
        refusal = None if trust_code else refusal_of_code(file)
    else:
        refusal = file
    return [] if refusal is None else [Fault("motion_model", refusal)]


def _geometry_faults(entry: ModelDocument) -> list[Fault]:
    outline = shapely.Polygon(entry.footprint)
    if not outline.is_valid:
        return [Fault("footprint", "crosses itself; expected a convex outline")]
    faults = []
    if outline.area < (1.0 - 1e-9) * outline.convex_hull.area or not outline.area:
        faults.append(Fault("footprint", "not convex; expected a convex outline"))
    if len(outline.exterior.coords) - 1 > MAX_CORNERS:
        corners = len(outline.exterior.coords) - 1
        message = f"has {corners} corners, at most {MAX_CORNERS} are allowed"
        faults.append(Fault("footprint", message))
    if not outline.contains(shapely.Point(0.0, 0.0)):
        message = "must hold (0, 0), the middle of the rear axle, inside"
        faults.append(Fault("footprint", message))
    if entry.motion_model == "car" and entry.limits.w_max >= np.pi / 2:
        message = f"got {entry.limits.w_max}; a car's steering angle must be < pi/2"
        faults.append(Fault("limits.w_max", message))
    return faults


def _model(folder: Path, entry: ModelDocument) -> RobotModel:
    outline = shapely.orient_polygons(shapely.Polygon(entry.footprint))
    footprint = np.array(outline.exterior.coords[:-1])
    footprint.setflags(write=False)
    motion = entry.motion_model
    if motion not in SHIPPED_MOTIONS:
        motion = str((folder / motion).resolve())
    stated = {
        **values_of(RobotModel, entry),
        **values_of(RobotModel, entry.wheel),
        "limits": Limits(**values_of(Limits, entry.limits)),
        "motor": entry.motor and Motor(**values_of(Motor, entry.motor)),
        "margins": (entry.margins or MarginsEntry()).margins,
        "tracking_error": entry.tracking_error and entry.tracking_error.value,
        "motion_model": motion,
        "mjcf": entry.mjcf and folder / entry.mjcf,
    }
    return RobotModel(name=folder.name, footprint_m=footprint, **stated)


def model_parameters(model: RobotModel) -> dict[str, Any]:
    """Return a model's values under the keys of `robot.yaml`, without its files."""
    own = _keys_of(ModelDocument, model)
    return {
        **{key: own[key] for key in own if key not in ("motion_model", "mjcf")},
        "footprint": model.footprint_m.tolist(),
        "wheel": _keys_of(WheelEntry, model),
        "limits": _keys_of(LimitsEntry, model.limits),
        "motor": model.motor and _keys_of(MotorEntry, model.motor),
        "tracking_error": model.tracking_error and model.tracking_error.entry,
        "margins": model.margins.entry,
    }


def _keys_of(kind: type[Strict], value: object) -> dict[str, Any]:
    """Return what a file would state of a value, by the keys of an entry."""
    return {
        field.alias or name: item.item() if isinstance(item, np.generic) else item
        for name, field in kind.model_fields.items()
        for item in [getattr(value, name, None)]
        if hasattr(value, name)
    }
