"""The formats of scene files and of `robot.yaml` as JSON Schemas, for editors."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from mrmg.scene.loading.models import ModelDocument
from mrmg.scene.loading.schema import SceneDocument

DIALECT = "http://json-schema.org/draft-07/schema#"
"""The newest dialect that all editors with a YAML language server know."""


def scene_schema() -> dict[str, Any]:
    """Return the format of scene files."""
    schema = schema_of(SceneDocument)
    # A file may leave its name out: it is then called after the file.
    schema["required"] = [key for key in schema["required"] if key != "name"]
    return schema


def robot_schema() -> dict[str, Any]:
    """Return the format of `robot.yaml`."""
    return schema_of(ModelDocument)


def schema_of(model: type[BaseModel]) -> dict[str, Any]:
    """Return the format of files that a model reads."""
    schema: dict[str, Any] = _without_noise(model.model_json_schema())
    return {"$schema": DIALECT, **schema}


def _without_noise(node: Any) -> Any:
    """Return a schema without titles, line ends, and null for what may be left out."""
    if isinstance(node, list):
        return [_without_noise(item) for item in node]
    if not isinstance(node, dict):
        return node.replace("\n", " ") if isinstance(node, str) else node
    kept = {
        key: _without_noise(value)
        for key, value in node.items()
        if key != "title" and not (key == "default" and isinstance(value, dict | None))
    }
    options = [item for item in kept.pop("anyOf", []) if item != {"type": "null"}]
    if len(options) == 1:
        return {**options[0], **kept}
    return {**kept, "anyOf": options} if options else kept
