"""Where a fault is: the line of the file, and the id of the entry."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from mrmg.errors import SceneError
from mrmg.scene.loading.faults import NO_NAME
from mrmg.scene.loading.shape_schema import ID_PATTERN


@contextmanager
def lines_of(path: Path) -> Iterator[None]:
    """Add the lines of a YAML file to the faults of scene errors raised within."""
    try:
        yield
    except SceneError as error:
        root = composed(path)
        faults = [
            fault if fault.line else replace(fault, line=line_at(root, fault.path))
            for fault in error.faults
        ]
        raise type(error)(error.source, faults) from error.__cause__


def composed(path: Path) -> yaml.Node | None:
    """Return the nodes of a YAML file, which know their lines; None if it is none."""
    try:
        return yaml.compose(path.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    except (OSError, UnicodeDecodeError, yaml.YAMLError, RecursionError):
        return None


def line_at(node: yaml.Node | None, path: str) -> int | None:
    """Return the line of the last key or entry of `path` that is in the file."""
    line, rest = None, path
    while rest:
        mark, node, rest = _step(node, rest)
        if mark is None:
            break
        line = mark.line + 1
    return line


def _step(
    node: yaml.Node | None, path: str
) -> tuple[yaml.Mark | None, yaml.Node | None, str]:
    """Return where the first part of a path is, what lies there, and the other parts.

    Keys may have dots in them.
    """
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            name = key.value or NO_NAME
            if f"{path}.".startswith(f"{name}."):
                return key.start_mark, value, path[len(name) + 1 :]
    elif isinstance(node, yaml.SequenceNode):
        index, _, rest = path.partition(".")
        if index.isdecimal() and int(index) < len(node.value):
            entry = node.value[int(index)]
            return entry.start_mark, entry, rest
    return None, None, ""


def entry_at(path: str) -> tuple[str, int]:
    """Return the section of a scene that a path leads into, and the entry's index.

    The index is -1 where the path leads into no entry.
    """
    section, _, rest = path.partition(".")
    index = rest.partition(".")[0]
    return section, int(index) if index.isdecimal() else -1


def id_at(document: dict[str, Any], path: str) -> str | None:
    """Return the id of the entry of a scene that a path leads into, if it has one."""
    section, index = entry_at(path)
    given = value_at(document, section, index, "id")
    is_id = index >= 0 and isinstance(given, str) and re.fullmatch(ID_PATTERN, given)
    return given if is_id else None


def value_at(document: Any, *keys: str | int) -> Any:
    """Return what lies at the end of a path of keys and indices; None if nothing."""
    for key in keys:
        try:
            document = document[key]
        except (IndexError, KeyError, TypeError):
            return None
    return document
