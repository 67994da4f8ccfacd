"""Robot descriptions as MuJoCo reads them: URDF, xacro and MJCF."""

from __future__ import annotations

import contextlib
import importlib.util
import io
import math
import sys
import types
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from unittest import mock
from urllib.parse import unquote

import numpy as np

from mrmg.errors import Fault, SceneError
from mrmg.extras import import_extra
from mrmg.scene.importing.robots.expressions import ExpressionError, cause_of, guarded
from mrmg.scene.loading.mjcf import no_warning_file
from mrmg.scene.loading.yaml_text import read_text

MESH_SUFFIXES = (".stl", ".obj", ".msh")
"""Meshes that MuJoCo reads."""

_MACROS = ("xacro:", "${", "$(")
_COMPILER = {
    "fusestatic": "false",  # or the masses of fixed links would be lost
    "discardvisual": "false",
    "strippath": "false",
    "balanceinertia": "true",
    "boundmass": "1e-6",
    "boundinertia": "1e-9",
}


@dataclass(frozen=True)
class JointLimit:
    """What a description states of a joint's drive; infinite where it does not."""

    speed_rad_s: float = math.inf
    effort_Nm: float = math.inf


@dataclass(frozen=True)
class Description:
    """A robot that MuJoCo has compiled.

    Attributes:
        model: as compiled, its root fixed to the world unless it states otherwise.
        limits: of joints, by name.
        friction: of tyres on the ground, by body.
        notes: what was dropped or changed.
    """

    model: Any
    limits: Mapping[str, JointLimit]
    friction: Mapping[str, float]
    notes: tuple[str, ...]

    @cached_property
    def data(self) -> Any:
        """The model at rest."""
        from mrmg.mujoco_import import mujoco

        data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, data)
        return data


def read_description(path: Path, arguments: Mapping[str, str]) -> Description:
    """Read a robot description of any kind, found by its content.

    Args:
        path: of the file.
        arguments: of xacro, by name.

    Raises:
        SceneError: if it cannot be used.
        MachineError: if it needs xacro, which is not installed.
    """
    source = str(path)
    text = read_text(path, source=source)
    if any(mark in text for mark in _MACROS) or path.suffix == ".xacro":
        text = _expanded(path, arguments)
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        line, column = error.position
        place = f"line {line}, column {column + 1}"
        message = f"no valid XML: {str(error).partition(':')[0]}"
        raise SceneError(source, [Fault(place, message)]) from error
    if root.tag not in ("robot", "mujoco"):
        message = f"got <{root.tag}>; expected <robot> (URDF, xacro) or <mujoco> (MJCF)"
        raise SceneError(source, [Fault("", message)])
    notes = []
    if root.tag == "robot":
        if faults := list(_mass_faults(root)):
            raise SceneError(source, faults)
        notes = [*_without_lost_meshes(root, path.parent), *_assumed_masses(root)]
    try:
        with no_warning_file():
            return _of_urdf(root, notes) if root.tag == "robot" else _of_mjcf(path)
    except (ValueError, OSError) as error:
        reason = " ".join(str(error).split())
        raise SceneError(
            source, [Fault("", f"MuJoCo cannot use it: {reason}")]
        ) from error


def _expanded(path: Path, arguments: Mapping[str, str]) -> str:
    xacro = import_extra("xacro", extra="ros", purpose="expands macros of descriptions")
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said), _packages_beside(path.parent):
            own = guarded(xacro)
            document = own.process_file(str(path), mappings=dict(arguments))
    except Exception as error:  # xacro raises what the expressions in a file raise
        cause = cause_of(error)
        if isinstance(cause, ExpressionError):
            raise SceneError(str(path), [Fault("", str(cause))]) from error
        # Of a file; xacro's own words repeat it.
        words = str(cause if isinstance(cause, OSError) else error).split()
        reason = " ".join(words) or type(error).__name__
        message = f"xacro cannot expand it: {reason}; --arg NAME=VALUE sets arguments"
        raise SceneError(str(path), [Fault("", message)]) from error
    return str(document.toxml())


def _without_lost_meshes(root: ET.Element, folder: Path) -> list[str]:
    """Resolve the meshes of a URDF; drop those MuJoCo cannot read, and say so."""
    lost: dict[str, list[str]] = {"visual": [], "collision": []}
    for link in root.iter("link"):
        for part in [item for item in link if item.tag in lost]:
            mesh = part.find("geometry/mesh")
            if mesh is None:
                continue
            name = mesh.get("filename", "")
            file = _mesh_file(name, folder)
            if file is not None and file.suffix.lower() in MESH_SUFFIXES:
                mesh.set("filename", str(file))
                continue
            link.remove(part)
            reason = "missing" if file is None else "of a format MuJoCo does not read"
            lost[part.tag].append(f"{Path(name).name} of {link.get('name')} ({reason})")
    return [
        f"{tag} meshes left out, collision shapes stand for them: {', '.join(names)}"
        for tag, names in lost.items()
        if names
    ]


def _mass_faults(root: ET.Element) -> Iterator[Fault]:
    """Yield a fault for each link whose mass none can be."""
    for link in root.iter("link"):
        mass = link.find("inertial/mass")
        try:
            mass_kg = math.inf if mass is None else float(mass.get("value", ""))
        except ValueError:
            continue  # MuJoCo names its line
        # Frames without a shape are often given a mass of zero.
        has_shape = link.find("collision") is not None
        if mass is None or (mass_kg == 0.0 and not has_shape):
            continue
        if not 0.0 < mass_kg < math.inf:
            yield Fault(
                f"link '{link.get('name')}'",
                f"has a mass of {mass_kg:g} kg; expected more than 0 kg, or no "
                "<inertial>, for that of its shape as of water",
            )


def _assumed_masses(root: ET.Element) -> list[str]:
    lacking = [
        str(link.get("name"))
        for link in root.iter("link")
        if link.find("inertial") is None and link.find("collision") is not None
    ]
    if not lacking:
        return []
    return [f"no <inertial>, shapes taken as of water: {', '.join(lacking)}"]


@contextlib.contextmanager
def _packages_beside(folder: Path) -> Iterator[None]:
    """Let xacro find packages beside or above a folder where ROS is not installed."""
    if importlib.util.find_spec("ament_index_python") is not None:
        yield
        return

    def get_package_share_directory(name: str) -> str:
        found = next(_package_folders(name, folder), None)
        if found is None:
            raise FileNotFoundError(
                f"no folder of package '{name}' beside or above the file"
            )
        return str(found)

    index = types.ModuleType("ament_index_python.packages")
    index.__dict__["get_package_share_directory"] = get_package_share_directory
    package = types.ModuleType("ament_index_python")
    with mock.patch.dict(
        sys.modules, {package.__name__: package, index.__name__: index}
    ):
        yield


def _package_folders(name: str, folder: Path) -> Iterator[Path]:
    for place in (folder.resolve(), *folder.resolve().parents):
        for found in (place / name, place if place.name == name else None):
            if found is not None and found.is_dir():
                yield found


def _mesh_file(name: str, folder: Path) -> Path | None:
    """Return the file of a mesh, in a package beside or above a folder, if there."""
    if name.startswith(("package://", "model://")):
        package, _, rest = name.partition("://")[2].partition("/")
        files = [place / rest for place in _package_folders(package, folder)]
    else:
        files = [folder / unquote(name.removeprefix("file://"))]
    return next((file.resolve() for file in files if name and file.is_file()), None)


def _of_urdf(root: ET.Element, notes: Sequence[str]) -> Description:
    from mrmg.mujoco_import import mujoco

    for extension in root.findall("mujoco"):
        root.remove(extension)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", _COMPILER)
    spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
    model = spec.compile()
    return Description(model, _limits(root), _gazebo_friction(root), tuple(notes))


def _of_mjcf(path: Path) -> Description:
    from mrmg.mujoco_import import mujoco

    spec = mujoco.MjSpec.from_file(str(path))
    folder = path.parent / spec.meshdir
    lost = {
        mesh.name or Path(mesh.file).stem: mesh
        for mesh in spec.meshes
        if mesh.file and not (folder / mesh.file).is_file()
    }
    for geom in [geom for geom in spec.geoms if geom.meshname in lost]:
        spec.delete(geom)
    for mesh in lost.values():
        spec.delete(mesh)
    left_out = f"meshes left out, as their files are missing: {', '.join(lost)}"
    # Neither surfaces nor grounds are taken over.
    unused = [geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_HFIELD]
    unused += [item for item in spec.textures if item.file]
    for item in (*unused, *spec.hfields, *spec.skins):
        spec.delete(item)
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    model = spec.compile()
    for joint in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE):
        first = model.jnt_qposadr[joint]  # where it stands is no part of a robot
        model.qpos0[first : first + 7] = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    notes = (left_out,) if lost else ()
    return Description(model, {}, _geom_friction(model), notes)


def _limits(root: ET.Element) -> dict[str, JointLimit]:
    found = {}
    for joint in root.iter("joint"):
        limit = joint.find("limit")
        if limit is not None:
            found[str(joint.get("name"))] = JointLimit(
                _positive(limit.get("velocity")), _positive(limit.get("effort"))
            )
    return found


def _gazebo_friction(root: ET.Element) -> dict[str, float]:
    stated = {
        str(part.get("reference")): _positive(
            part.findtext("mu1") or part.findtext("mu")
        )
        for part in root.iter("gazebo")
    }
    return {name: value for name, value in stated.items() if value < math.inf}


def _geom_friction(model: Any) -> dict[str, float]:
    found: dict[str, float] = {}
    for geom in range(model.ngeom):
        if model.geom_contype[geom] or model.geom_conaffinity[geom]:
            name = model.body(model.geom_bodyid[geom]).name
            own = float(model.geom_friction[geom, 0])
            found[name] = max(own, found.get(name, 0.0))
    return found


def _positive(text: str | None) -> float:
    try:
        value = float(text or "inf")
    except ValueError:
        return math.inf
    return value if value > 0.0 else math.inf
