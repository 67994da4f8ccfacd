"""The table of export formats: one module of `mrmg.export.formats` each."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mrmg.errors import require_known

if TYPE_CHECKING:
    from mrmg.export.mission import Mission

_FORMATS = "mrmg.export.formats"

Files = Mapping[str, bytes]
"""Content of the files of an export by their path, relative to its folder."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """A format that a run can be exported to; a module calls its own `FORMAT`.

    Attributes:
        suffix: of its file; "" of a format that is a folder of files.
        versions: of its standard that can be written; all of them are by default.
        files: returns the files of a mission in the versions asked for. A single file
            is called "mission" with its suffix.
        written_before: returns the files in a folder that an export in the versions
            asked for has left there, of any mission; none of a single file.
    """

    suffix: str = ""
    versions: tuple[str, ...] = ()
    files: Callable[[Mission, tuple[str, ...]], Files]
    written_before: Callable[[Path, tuple[str, ...]], Iterable[Path]] = lambda *_: ()


def format_names() -> list[str]:
    """Return the names of all formats; imports none of them."""
    package = importlib.import_module(_FORMATS)
    return sorted(module.name for module in pkgutil.iter_modules(package.__path__))


def load_format(name: str) -> Format:
    """Return a format.

    Raises:
        UsageError: if there is none of that name.
    """
    require_known("format", name, format_names())
    module = importlib.import_module(f"{_FORMATS}.{name}")
    loaded: Format = module.FORMAT
    return loaded
