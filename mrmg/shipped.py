"""Where the shipped scenes and robot models lie, in a checkout and in a wheel."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from mrmg import storage

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


_MODEL_DIGESTS = (
    "c2048aae4bf6fcee",
    "0590ee15471381dd",
    "f1fa31d9af8b02f1",
    "3ac3ef8737f58b26",
)
"""`model_digest` of each shipped model; a test holds that its two files agree."""


def model_digest(parameters: Mapping[str, Any], mjcf: Path) -> str:
    """Return a digest of what `robot.yaml` states and of the MJCF file."""
    text = mjcf.read_text("latin-1")
    return storage.digest(storage.canonical_json(parameters) + text)


def is_unchanged_model(parameters: Mapping[str, Any], mjcf: Path) -> bool:
    """Return whether both files of a model are those of a shipped one, or copies."""
    return model_digest(parameters, mjcf) in _MODEL_DIGESTS


def model_names() -> list[str]:
    """Return the names of the shipped robot models."""
    return sorted(path.parent.name for path in models_folder().glob("*/robot.yaml"))
