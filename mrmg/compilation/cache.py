"""Where compiled kernels are kept, and when they are good.

numba's cache does not notice edits in other files: a cached caller keeps the old
callee. Kernels are therefore kept in a folder named after a digest of everything that
compiled code depends on. numba is told of that folder only while it looks for the place
of a kernel's cache, so that nobody else's functions are kept there.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numba
from llvmlite import binding

from mrmg import storage

PACKAGE = Path(__file__).resolve().parents[1]
"""Folder of the package."""

_SOURCES = (
    "compilation/*.py",
    "energy/model.py",
    "motion/dynamics.py",
    "**/*_kernels.py",
)

_LOCK = threading.Lock()
"""Held while numba's setting is another."""


def kernel_sources() -> list[Path]:
    """Return every source file whose code is compiled into a kernel."""
    return sorted({path for name in _SOURCES for path in PACKAGE.glob(name)})


def processor() -> tuple[str, str]:
    """Return the name and features of the processor that numba compiles for."""
    name, features = numba.config.CPU_NAME, numba.config.CPU_FEATURES
    if name is None:
        name = binding.get_host_cpu_name()
    if features is None:
        features = binding.get_host_cpu_features().flatten()
    return str(name), str(features)


@cache
def compilation_digest() -> str:
    """Return a fingerprint of all that compiled kernels depend on.

    It covers the sources, their place (numba's cache goes by it), the versions of numba
    and Python, and the processor.
    """
    state = hashlib.sha256()
    for part in (
        str(PACKAGE),
        numba.__version__,
        platform.python_implementation(),
        platform.python_version(),
        *processor(),
    ):
        state.update(f"{part}\0".encode())
    for path in kernel_sources():
        state.update(f"{path.relative_to(PACKAGE)}\0".encode())
        state.update(path.read_bytes())
    return state.hexdigest()[:16]


@cache
def cache_folder() -> Path:
    """Return the folder of this machine's compiled kernels: numba's, if one is set.

    Where a crash or a full disk cut off kernels, all are given up, as numba cannot read
    what is left of them.
    """
    own = storage.user_cache_folder() / "kernels"
    folder = Path(numba.config.CACHE_DIR or own) / compilation_digest()
    if any(map(_is_cut_off, folder.glob("complete-*"))):
        shutil.rmtree(folder, ignore_errors=True)
    return folder


def _is_cut_off(complete: Path) -> bool:
    """Return whether a file that was there with all kernels of a part is cut off."""
    try:
        sizes = json.loads(complete.read_text())
        return any(
            (complete.parent / name).stat().st_size < size
            for name, size in sizes.items()
        )
    except (OSError, ValueError):
        return True


@contextmanager
def cache_setting() -> Iterator[bool]:
    """Have numba keep what is decorated meanwhile in the folder of kernels.

    Yields:
        whether that folder can be written to; kernels are not kept elsewhere.
    """
    folder = cache_folder()
    with _LOCK:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(folder)
        try:
            yield _is_writable(folder)
        finally:
            numba.config.CACHE_DIR = before


@cache
def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def compiled_kernels() -> int:
    """Return how many kernels this machine holds compiled."""
    return sum(1 for _ in cache_folder().rglob("*.nbc"))


def kernels_are_compiled(part: str) -> bool:
    """Return whether this machine holds all kernels of a part of them, if any."""
    return bool(numba.config.DISABLE_JIT) or _complete(part).exists()


def note_kernels_are_compiled(part: str) -> None:
    """Have the next process know that this machine holds all kernels of a part."""
    if not kernels_are_compiled(part):
        folder = cache_folder()
        sizes = {
            str(path.relative_to(folder)): path.stat().st_size
            for path in folder.rglob("*.nb?")
        }
        storage.write_text(_complete(part), json.dumps(sizes))


def _complete(part: str) -> Path:
    return cache_folder() / f"complete-{part}"
