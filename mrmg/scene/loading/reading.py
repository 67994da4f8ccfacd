"""From a file or document to a `Scene`, or to the list of everything wrong with it."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from mrmg import shipped
from mrmg.errors import Fault, SceneError, nearest, require_types
from mrmg.scene.loading.assembly import Assembly
from mrmg.scene.loading.faults import faults_of, shown
from mrmg.scene.loading.places import entry_at, id_at, lines_of
from mrmg.scene.loading.schema import SCENE_FORMAT, SceneDocument
from mrmg.scene.loading.yaml_text import dump_yaml, read_yaml
from mrmg.scene.types import Scene

FILE_SIMILARITY = 0.75
"""Least similarity of a suggested file: all of a folder's end in ".yaml"."""


def load_scene(source: str | Path, *, trust_code: bool = False) -> Scene:
    """Load a scene from a file, or a shipped scene by its name.

    Args:
        source: path of a scene file, or one of `shipped.scene_names()`.
        trust_code: whether robot models may bring Python code (`loading.trust`).

    Raises:
        SceneError: naming every fault of the file.
    """
    path = scene_path(source)
    document = read_yaml(path, source=str(source))
    if isinstance(document, dict):
        document.setdefault("name", path.stem)
    with lines_of(path):
        return scene_from_document(
            document, source=str(source), base=path.parent, trust_code=trust_code
        )


def scene_from_document(
    document: dict[str, Any],
    *,
    source: str,
    base: Path | None = None,
    trust_code: bool = False,
) -> Scene:
    """Build a scene from the content of a scene file.

    Args:
        document: plain data in scene format 1.
        source: what error messages call it.
        base: folder that relative paths of robot models start from; default the
            working directory.
        trust_code: whether robot models may bring Python code (`loading.trust`).

    Raises:
        SceneError: naming every fault of the document.
    """
    _require_format(document, source)
    faults: list[Fault] = []
    try:
        checked = SceneDocument.model_validate(document)
    except ValidationError as error:
        faults = faults_of(error, SceneDocument)
    assembly = Assembly(document, base, trust_code=trust_code)
    faults += assembly.faults
    if faults:
        named = [replace(fault, id=id_at(document, fault.path)) for fault in faults]
        raise SceneError(source, sorted(named, key=_place_in(document)))
    return assembly.scene(checked)


def dump_scene(scene: Scene) -> str:
    """Return a scene as YAML text that loads as an equal scene from any folder.

    Raises:
        SceneError: if a scene file cannot say what was changed in memory.
    """
    document = scene.document
    require_faithful(scene, document)
    return dump_yaml(document)


def require_faithful(scene: Scene, document: dict[str, Any]) -> None:
    """Refuse a document that does not load as `scene`.

    Raises:
        SceneError: naming what differs, or what is wrong with it as it is.
    """
    if scene.is_as_loaded:
        return
    trust_code = scene.has_custom_motion  # or it would not have been loaded
    again = scene_from_document(document, source=scene.name, trust_code=trust_code)
    if again == scene:
        return
    found, wanted = again.content(), scene.content()
    message = "was changed in memory into what no scene file can say"
    raise SceneError(
        scene.name,
        [
            Fault(key, message)
            for key in sorted({*wanted, *found})
            if found.get(key) != wanted.get(key)
        ],
    )


def scene_path(source: str | Path) -> Path:
    """Return the file of a scene that is given by its path or shipped name.

    Raises:
        SceneError: if there is none.
    """
    require_types((source, (str, Path)))
    names = shipped.scene_names()
    if str(source) in names:
        return shipped.scenes_folder() / f"{source}.yaml"
    path = Path(source)
    if os.path.isdir(path):
        message = "is a folder; expected a scene file"
        if (path / "run.json").exists():
            message = f"is a run folder; its scene is {path / 'scene.yaml'}"
        raise SceneError(str(source), [Fault("", message)])
    if not os.path.exists(path):  # also where no file can have such a name
        message = (
            f"no such file, and no shipped scene of that name{_meant(path)}; "
            "'mrmg scene list' lists the shipped ones"
        )
        raise SceneError(str(source), [Fault("", message)])
    return path


def _meant(path: Path) -> str:
    """Return the question for the scene that is meant by a path where there is none."""
    near = path.parent.glob("*.yaml") if os.path.isdir(path.parent) else ()
    files = [str(item) for item in near]
    if f"{path}.yaml" in files:
        return f" (did you mean '{path}.yaml'?)"
    meant = nearest(str(path), files, cutoff=FILE_SIMILARITY)
    return meant or nearest(path.stem, shipped.scene_names())


def _require_format(document: Any, source: str) -> None:
    """Refuse what is no scene at all, before looking for faults of a scene."""
    if not isinstance(document, dict):
        message = f"got {shown(document)}; expected a scene: a mapping of keys"
        raise SceneError(source, [Fault("", message)])
    found = document.get("format")
    if "format" in document and (isinstance(found, bool) or found != SCENE_FORMAT):
        message = f"got {shown(found)}; this version reads format {SCENE_FORMAT}"
        raise SceneError(source, [Fault("format", message)])


def _place_in(document: dict[str, Any]) -> Callable[[Fault], tuple[int, int]]:
    """Return a key that sorts faults as the sections and entries of the file."""
    order = {key: place for place, key in enumerate(document)}

    def place(fault: Fault) -> tuple[int, int]:
        section, index = entry_at(fault.path)
        return order.get(section, -1), index

    return place
