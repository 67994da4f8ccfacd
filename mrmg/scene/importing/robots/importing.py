"""From a robot description to a model's folder, and what is left to find out."""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrmg import shipped, storage
from mrmg.errors import Fault, SceneError
from mrmg.scene.importing.robots.description import Description, read_description
from mrmg.scene.importing.robots.mjcf_text import DrawnGeom, mjcf_text
from mrmg.scene.importing.robots.parameters import Parameter, parameters_of
from mrmg.scene.importing.robots.survey import Survey, survey
from mrmg.scene.loading.mjcf import mesh_of
from mrmg.scene.loading.models import load_model
from mrmg.scene.new_robot import require_new_model
from mrmg.templates import rendered

_DRAWN = ("sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh")
"""Shapes that are taken over, as MJCF calls them."""

_BESIDE_AXLE_M = 1e-3
"""Distance from the driven axle up to which a support is below it."""


@dataclass(frozen=True)
class ImportedRobot:
    """What was made.

    Attributes:
        files: that were written.
        read: names of the parameters that the description states.
        assumed: names and reasons of those it does not.
        notes: what was dropped, changed or assumed of its parts.
    """

    files: tuple[Path, ...]
    read: tuple[str, ...]
    assumed: tuple[str, ...]
    notes: tuple[str, ...]


def import_robot(
    path: Path,
    folder: Path,
    *,
    drive: Sequence[str] = (),
    steer: Sequence[str] = (),
    arguments: Mapping[str, str] | None = None,
) -> ImportedRobot:
    """Write the model of a robot that a URDF, xacro or MJCF file describes.

    Args:
        path: the description.
        folder: to make; the model is called like it.
        drive: joints of the driven wheels, left and right; () to find them.
        steer: joints that steer, left and right; () to find them.
        arguments: of xacro, by name.

    Raises:
        UsageError: if there is something in that place, or it cannot name a model.
        SceneError: if the description cannot be used; nothing is written then.
        MachineError: if a package is missing.
    """
    remedy = "give another -o FOLDER"
    name = require_new_model(folder, remedy)
    description = read_description(path, arguments or {})
    found = survey(description, str(path), drive, steer)
    values = parameters_of(found, description)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".import-") as place:
        work = Path(place) / name
        drawn = _drawn(description, found, work / "meshes")
        text = mjcf_text(name, path.name, found, values, drawn)
        storage.write_text(work / f"{name}.xml", text)
        storage.write_text(work / "robot.yaml", _robot_yaml(name, path, found, values))
        try:
            load_model(work)
        except SceneError as error:
            faults = [Fault(f.path, f.message) for f in error.faults]
            raise SceneError(str(path), faults) from error
        require_new_model(folder, remedy)  # others may have made it meanwhile
        work.rename(folder)
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    return ImportedRobot(
        tuple(files),
        tuple(key for key, value in values.items() if value.source),
        tuple(
            f"{key}: {value.value:g} {value.unit}".rstrip() + f", {value.reason}"
            for key, value in values.items()
            if not value.source
        ),
        (*description.notes, *found.notes, *_doubts(found)),
    )


def _doubts(found: Survey) -> list[str]:
    """Return what of a robot the simulation does not show as it is."""
    reach_m = max(map(abs, found.supports_m), default=0.0)
    if found.steered or abs(found.lead_m) <= 0.5 * reach_m or reach_m < _BESIDE_AXLE_M:
        return []
    share = abs(found.lead_m) / reach_m
    return [
        f"{share:.0%} of the weight is on the casters: the driven wheels may slip, as "
        "half of it on them is counted on"
    ]


def _robot_yaml(
    name: str, path: Path, found: Survey, values: Mapping[str, Parameter]
) -> str:
    text = rendered(
        __package__,
        "robot.yaml.jinja",
        {},
        name=name,
        source=path.name,
        motion="car" if found.steered else "unicycle",
        values={tuple(key.rpartition(".")[::2]): item for key, item in values.items()},
    )
    return shipped.with_modeline(text, shipped.robot_schema_file())


def _drawn(
    description: Description, found: Survey, folder: Path
) -> dict[int, list[DrawnGeom]]:
    """Return the geoms to draw, by wheel (-1: chassis), and write their meshes."""
    from mrmg.mujoco_import import mujoco

    model, data = description.model, description.data
    wheels = (*found.driven, *found.steered)
    of_body = {body: index for index, w in enumerate(wheels) for body in w.bodies}
    seen = model.geom_contype | model.geom_conaffinity
    looks = {int(model.geom_bodyid[at]) for at in np.flatnonzero(seen == 0)}
    drawn: dict[int, list[DrawnGeom]] = defaultdict(list)
    meshes: dict[str, int] = {}
    for geom in np.flatnonzero(np.isin(model.geom_bodyid, found.bodies)).tolist():
        body = int(model.geom_bodyid[geom])
        name = mujoco.mjtGeom(model.geom_type[geom]).name
        kind = name.removeprefix("mjGEOM_").lower()
        if kind not in _DRAWN or (seen[geom] and body in looks):
            continue
        wheel = of_body.get(body, -1)
        center = found.origin_m + (wheels[wheel].place_m if wheel >= 0 else 0.0)
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, data.geom_xmat[geom])
        mesh = None
        if kind == "mesh":
            mesh = f"mesh_{model.geom_dataid[geom]}"
            meshes[mesh] = int(model.geom_dataid[geom])
        pos, size = data.geom_xpos[geom] - center, model.geom_size[geom]
        drawn[wheel].append(DrawnGeom(kind, size, pos, quat, mesh))
    for name, number in meshes.items():
        folder.mkdir(parents=True, exist_ok=True)
        mesh_of(model, number).export(str(folder / f"{name}.stl"))
    return drawn
