"""The files that a robot model consists of besides its `robot.yaml`.

They are the MJCF with everything it names (included files, meshes, textures, height
fields), or the Python file of a custom motion model.
"""

from __future__ import annotations

import hashlib
import html
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath

MODELS_FOLDER = "models"
"""Folder beside a scene file that carries models of the user's own."""

_FILE = re.compile(r"""\bfile\w*\s*=\s*(?:"([^"]+)"|'([^']+)')""")
_DIR = re.compile(r"""\b(?:mesh|texture|asset)dir\s*=\s*(?:"([^"]+)"|'([^']+)')""")
_MJCF = (".xml", ".mjcf", ".urdf")


@dataclass(frozen=True, slots=True)
class ModelFile:
    """One file as it was when it was read.

    Attributes:
        name: path from the folder of the first file, or absolute where the MJCF names
            it so.
        path: where it lies.
        digest: of its bytes.
    """

    name: str
    path: Path
    digest: str


@dataclass(frozen=True, slots=True)
class ModelFiles:
    """The files of one model.

    Attributes:
        roots: the files that the model itself names: MJCF and custom motion.
        files: all of them that exist, by name.
    """

    roots: tuple[Path, ...]
    files: tuple[ModelFile, ...]

    @staticmethod
    def of(*roots: Path) -> ModelFiles:
        """Return the files as they are now; those that are missing are left out."""
        known = [root for root in roots if os.path.isfile(root)]
        files = [file for root in known for file in _files(root)]
        return ModelFiles(roots=roots, files=tuple(files))

    def content(self) -> list[list[str]]:
        """Return what counts for a digest: names as the MJCF has them, and bytes."""
        own = {root.name for root in self.roots}
        return [
            ["" if file.name in own else file.name, file.digest] for file in self.files
        ]

    def changed(self) -> list[Path]:
        """Return the files that are not any more as they were when they were read."""
        now = {file.path: file.digest for file in ModelFiles.of(*self.roots).files}
        then = {file.path: file.digest for file in self.files}
        return sorted(path for path in {*now, *then} if now.get(path) != then.get(path))


def _files(root: Path) -> Iterator[ModelFile]:
    """Yield a file and all files it depends on, each once, in order of their names.

    MuJoCo looks for files in folders that depend on the kind of asset and the version;
    whatever lies where one of its rules leads counts.
    """
    found: dict[str, bytes] = {}
    new = {root.name}
    while new:
        found |= {name: (root.parent / name).read_bytes() for name in new}
        new = {
            name
            for name in _named_files(found)
            if name not in found and os.path.isfile(root.parent / name)
        }
    for name in sorted(found):
        digest = hashlib.sha256(found[name]).hexdigest()
        yield ModelFile(name=name, path=root.parent / name, digest=digest)


def _named_files(files: Mapping[str, bytes]) -> set[str]:
    """Return the paths at which files may lie that some MJCF files name."""
    texts = {
        name: data.decode("utf-8", errors="replace")
        for name, data in files.items()
        if PurePath(name).suffix.lower() in _MJCF
    }
    folders = {"", *(name for text in texts.values() for name in _values(_DIR, text))}
    return {
        os.path.normpath(os.path.join(base, folder, value))
        for name, text in texts.items()
        for full in _values(_FILE, text)
        for value in (full, os.path.basename(full))
        for folder in folders
        for base in ("", os.path.dirname(name))
    }


def _values(pattern: re.Pattern[str], text: str) -> Iterator[str]:
    for double, single in pattern.findall(text):
        yield html.unescape(double or single)
