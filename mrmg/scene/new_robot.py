"""The robot model that a user begins with: a copy of a shipped one, renamed."""

from __future__ import annotations

import os
import re
from pathlib import Path

from mrmg import shipped, storage
from mrmg.errors import UsageError, require_known

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")


def new_robot(folder: Path, *, like: str = "car") -> list[Path]:
    """Write a robot model that is like a shipped one; return its files.

    Args:
        folder: to make; the model is called like it.
        like: name of the shipped model.

    Raises:
        UsageError: if there is something in that place, or a name cannot be used.
    """
    require_known("shipped model", like, shipped.model_names())
    name = require_new_model(folder, "give another name")
    source = shipped.models_folder() / like
    text = (source / "robot.yaml").read_text(encoding="utf-8")
    text = text.replace(f"mjcf: {like}.xml", f"mjcf: {name}.xml")
    begun = (
        f"# {name}: begun as a copy of the shipped model '{like}'. The planner goes by "
        f"this file,\n# the simulation by {name}.xml: change both, and let 'mrmg robot "
        "check' compare them.\n"
    )
    text = shipped.with_modeline(begun + text, shipped.robot_schema_file())
    xml = (source / f"{like}.xml").read_text(encoding="utf-8")
    xml = xml.replace(f'<mujoco model="{like}">', f'<mujoco model="{name}">')
    files = {folder / f"{name}.xml": xml, folder / "robot.yaml": text}
    for path, content in files.items():
        storage.write_text(path, content)
    return list(files)


def require_new_model(folder: Path, remedy: str) -> str:
    """Return the name of the model that a new folder shall hold, which is its own.

    Raises:
        UsageError: if there is something in that place, or it cannot name a model.
    """
    name, names = folder.name, shipped.model_names()
    if not _NAME.fullmatch(name) or name in names:
        raise UsageError(
            f"'{name}' cannot name a robot model; use letters, digits, '_', '.' and "
            f"'-', and none of the shipped models' names ({', '.join(names)})"
        )
    if os.path.lexists(folder):
        raise UsageError(f"{folder} is there already; {remedy}")
    return name
