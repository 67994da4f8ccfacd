"""Scenes with all that they need, so that they load in another place.

Shipped models are named; models of the user's own are carried in `models/` beside the
scene file, with every file that their MJCF names. Files that an MJCF names by absolute
paths stay where they are.
"""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath

from mrmg.scene.loading.models import with_reference
from mrmg.scene.loading.reading import require_faithful
from mrmg.scene.loading.yaml_text import dump_yaml
from mrmg.scene.model_files import MODELS_FOLDER
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene

SCENE_FILE = "scene.yaml"


def carried_files(scene: Scene) -> dict[str, bytes]:
    """Return the files that a scene is loaded from anywhere, by their paths.

    Raises:
        SceneError: if a scene file cannot say what was changed in memory, or a model's
            file has changed since the scene was loaded.
    """
    document = scene.document
    require_faithful(scene, document)
    files: dict[str, bytes] = {}
    places: dict[str, str] = {}
    for robot, entry in zip(scene.robots, document["robots"], strict=True):
        origin = robot.model.origin
        if origin is None or "/" not in origin.reference:
            continue
        if origin.reference not in places:
            name = _free_name(Path(origin.reference).name, files)
            place, own = _files_of(robot.model)
            places[origin.reference] = f"{name}/{place}".removesuffix("/.")
            files |= {f"{name}/{path}": data for path, data in own.items()}
        place = places[origin.reference]
        entry["model"] = with_reference(entry["model"], place)
    files[SCENE_FILE] = dump_yaml(document).encode()
    return files


def safe_path(name: str) -> bool:
    """Return whether a path of a carried file stays in the folder it is put into."""
    path = PurePosixPath(name)
    return (
        path.parts[:1] == (MODELS_FOLDER,)
        and len(path.parts) > 1
        and str(path) == name
        and ".." not in path.parts
        and not any(sign in name for sign in "\\:\0")
    )


def _free_name(wanted: str, files: dict[str, bytes]) -> str:
    """Return a folder for a model's files that no other model has."""
    taken = {PurePosixPath(path).parts[1] for path in files}
    names = [wanted, *(f"{wanted}-{number}" for number in range(2, len(taken) + 3))]
    return f"{MODELS_FOLDER}/{next(name for name in names if name not in taken)}"


def _files_of(model: RobotModel) -> tuple[str, dict[str, bytes]]:
    """Return where in a tree of a model's files its folder is, and the files by path.

    The tree has the files as they lie to each other: an MJCF may name meshes beside the
    model's folder.
    """
    assert model.origin is not None
    folder = model.origin.reference
    model.require_unchanged_files()
    found = {
        os.path.abspath(file.path): file.path.read_bytes()
        for file in model.files.files
        if not os.path.isabs(file.name)
    }
    top = os.path.commonpath([folder, *(os.path.dirname(path) for path in found)])
    found[os.path.join(folder, "robot.yaml")] = model.origin.text.encode()
    place = Path(os.path.relpath(folder, top)).as_posix()
    return place, {
        Path(os.path.relpath(path, top)).as_posix(): data
        for path, data in sorted(found.items())
    }
