"""The formats that can be imported: one module of `formats` each.

A new one is a new module there with a `FORMAT`; nothing else needs to know of it.
"""

from __future__ import annotations

import importlib
import json
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from mrmg.errors import Fault, SceneError, require_known
from mrmg.scene.importing.layers import ImportOptions, Layer
from mrmg.scene.loading.yaml_text import parse_yaml, read_text, read_yaml

Reader = Callable[[Path, ImportOptions], Layer]
"""Turns a file into a layer of a scene."""

_SNIFFED_BYTES = 1 << 16


class Head:
    """A file as far as its kind is to be seen.

    Attributes:
        path: of the file.
        start: its first bytes.
    """

    def __init__(self, path: Path) -> None:
        """Open a file.

        Raises:
            SceneError: if it cannot be read.
        """
        self.path = path
        try:
            with path.open("rb") as file:
                self.start = file.read(_SNIFFED_BYTES)
        except OSError as error:
            message = f"cannot be read ({error.strerror})"
            raise SceneError(str(path), [Fault("", message)]) from error

    @cached_property
    def kind(self) -> str:
        """What the file is made of: json, xml, yaml, text or binary."""
        text = self.start.lstrip(b"\xef\xbb\xbf \t\r\n")
        if b"\0" in self.start or text.startswith((b"P5", b"\x89PNG")):
            return "binary"
        if text.startswith((b"{", b"[{")):
            return "json"
        if text.startswith(b"<"):
            return "xml"
        return "yaml" if isinstance(self._yaml, dict) else "text"

    @cached_property
    def mapping(self) -> dict[str, Any]:
        """The keys of a JSON or YAML file; none if it is something else."""
        found = read_json(self.path) if self.kind == "json" else self._yaml
        return found if isinstance(found, dict) else {}

    @cached_property
    def _yaml(self) -> Any:
        try:
            return parse_yaml(self.start.decode("utf-8"), source=str(self.path))
        except (UnicodeDecodeError, SceneError):
            return None


@dataclass(frozen=True)
class Format:
    """One kind of file.

    Attributes:
        kind: what `--kind` calls it.
        title: what it is.
        recognises: whether a file is of this kind, by its content.
        read: what turns the file into a layer of a scene.
    """

    kind: str
    title: str
    recognises: Callable[[Head], bool]
    read: Reader


def formats() -> dict[str, Format]:
    """Return all formats by kind."""
    package = importlib.import_module("mrmg.scene.importing.formats")
    modules = [
        importlib.import_module(f"{package.__name__}.{module.name}")
        for module in pkgutil.iter_modules(package.__path__)
    ]
    found: list[Format] = [module.FORMAT for module in modules]
    return {entry.kind: entry for entry in found}


def format_of(path: Path, kind: str | None = None) -> Format:
    """Return the format of a file: the one named, or the one its content shows.

    Raises:
        UsageError: if no format is called `kind`.
        SceneError: if the file is of no known kind.
    """
    known = formats()
    if kind is not None:
        require_known("kind", kind, known)
        return known[kind]
    head = Head(path)
    for entry in known.values():
        if entry.recognises(head):
            return entry
    raise SceneError(str(path), [Fault("", _not_known(head, known))])


def _not_known(head: Head, known: dict[str, Format]) -> str:
    if not head.start.strip():
        return "empty; expected a map"
    if head.kind == "xml":
        return "XML, no map; a robot is read by 'mrmg robot import'"
    if head.kind == "binary":
        return "a picture or other binary file; a map's picture is named by its YAML"
    content: Any = head.mapping if head.kind == "yaml" else {}
    if head.path.suffix in (".yaml", ".yml"):
        # Of the whole file, which may be long; names the line that is wrong.
        content = read_yaml(head.path, source=str(head.path))
    if isinstance(content, dict) and "format" in content:
        return "a scene of mrmg already; 'mrmg scene check' looks at it"
    titles = "; ".join(f"{entry.kind}: {entry.title}" for entry in known.values())
    return f"no map of a known kind; --kind forces one of: {titles}"


def read_json(path: Path) -> Any:
    """Read a JSON file; members that are null are left out, as if they were missing.

    Raises:
        SceneError: if it cannot be read or is no JSON; names the line.
    """
    text = read_text(path, source=str(path)).removeprefix("\ufeff")
    try:
        return json.loads(text, object_hook=_stated)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        message = f"no valid JSON: {error.msg}"
        raise SceneError(str(path), [Fault(place, message)]) from error
    except (ValueError, RecursionError) as error:
        reason = str(error).partition(";")[0]
        message = f"no JSON that can be read: {reason}"
        raise SceneError(str(path), [Fault("", message)]) from error


def _stated(members: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in members.items() if value is not None}
