"""Where the shipped scenes and robot models lie, in a checkout and in a wheel."""

from __future__ import annotations

from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_MODELINE = "# yaml-language-server: $schema="


@cache
def _root() -> Path:
    # A wheel carries both folders inside the package; a checkout has them beside it.
    inside = _PACKAGE / "_shipped"
    return inside if inside.is_dir() else _PACKAGE.parent


def scenes_folder() -> Path:
    """Return the folder of the shipped scenes."""
    return _root() / "scenes"


def models_folder() -> Path:
    """Return the folder of the shipped robot models."""
    return _root() / "models"


def scene_schema_file() -> Path:
    """Return the JSON Schema of scene files."""
    return scenes_folder() / "scene.schema.json"


def robot_schema_file() -> Path:
    """Return the JSON Schema of `robot.yaml`."""
    return models_folder() / "robot.schema.json"


def with_modeline(text: str, schema: Path) -> str:
    """Return YAML text that names its JSON Schema to editors, and no other one."""
    # Editors read the name up to the first space.
    name = schema.as_uri() if " " in str(schema) else schema
    lines = text.splitlines(keepends=True)
    rest = "".join(line for line in lines if not line.startswith(_MODELINE))
    return f"{_MODELINE}{name}\n{rest}"


def scene_names() -> list[str]:
    """Return the names under which the shipped scenes can be called."""
    return sorted(path.stem for path in scenes_folder().glob("*.yaml"))


def model_names() -> list[str]:
    """Return the names of the shipped robot models."""
    return sorted(path.parent.name for path in models_folder().glob("*/robot.yaml"))
