"""Changing single values in YAML text, with everything else left as it was written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import yaml

from mrmg.errors import Fault, SceneError
from mrmg.scene.loading.yaml_text import parse_yaml

KeyPath = tuple[str, ...]
"""Keys from the top of a document to a value: ("wheel", "inertia")."""


@dataclass(frozen=True, slots=True)
class NewValue:
    """What a value shall be, and why.

    Attributes:
        text: the value as YAML.
        unit: begins the comment where there is none yet.
        mark, detail: what the comment ends with; they take the place of what an
            earlier comment has after the same mark.
    """

    text: str
    unit: str
    mark: str
    detail: str


def with_values(text: str, changes: Mapping[KeyPath, NewValue], *, source: str) -> str:
    """Return YAML text with some scalars changed and their sources noted.

    Args:
        text: a document.
        changes: by the way to each value.
        source: what error messages call the text.

    Raises:
        SceneError: if the text is no YAML, or lacks a value.
    """
    parse_yaml(text, source=source)
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    found = {path: _scalar(root, path) for path in changes}
    nodes = {path: node for path, node in found.items() if node is not None}
    missing = [
        Fault(".".join(path), "missing; there is nothing to change")
        for path in changes
        if path not in nodes
    ]
    if missing:
        raise SceneError(source, missing)
    # From the end, so that what is still to be changed keeps its place.
    for path, node in sorted(
        nodes.items(), key=lambda item: item[1].start_mark.index, reverse=True
    ):
        new = changes[path]
        start, end = node.start_mark.index, node.end_mark.index
        newline = text.find("\n", end)
        rest = text[end:] if newline < 0 else text[end:newline]
        after = "" if newline < 0 else text[newline:]
        text = text[:start] + new.text + _commented(rest, new) + after
    return text


def _scalar(node: yaml.Node | None, path: KeyPath) -> yaml.ScalarNode | None:
    for key in path:
        if not isinstance(node, yaml.MappingNode):
            return None
        node = next((value for name, value in node.value if name.value == key), None)
    return node if isinstance(node, yaml.ScalarNode) else None


def _commented(rest: str, new: NewValue) -> str:
    """Return what follows the value on its line, with the source in its comment."""
    code, hash_sign, comment = rest.partition("#")
    if not hash_sign:
        code = f"{rest.rstrip()}  "
    kept = comment.partition(new.mark)[0].strip().rstrip(";")
    return f"{code}# {kept or new.unit}; {new.mark}{new.detail}"
