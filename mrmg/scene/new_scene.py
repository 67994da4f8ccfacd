"""The scene that a user begins with: small, and with a comment for every key."""

from __future__ import annotations

from pathlib import Path

from mrmg import shipped
from mrmg.scene.loading.yaml_text import dump_yaml

_TEMPLATE = Path(__file__).with_suffix(".yaml")


def new_scene(name: str) -> str:
    """Return the text of a valid scene of that name."""
    text = _TEMPLATE.read_text(encoding="utf-8")
    named = text.replace("name: NAME\n", dump_yaml({"name": name}))
    return shipped.with_modeline(named, shipped.scene_schema_file())
