"""Where compiled kernels are kept, and when they are good.

numba's cache does not notice edits in other files: a cached caller keeps the old
callee. Kernels are therefore kept in a folder named after a digest of everything that
compiled code depends on. Copies of the sources lie in it, and kernels are compiled as
if they had been read from there: numba keeps what it compiles beside the source or,
where `NUMBA_CACHE_DIR` is set, in a folder there that is named after the source's. So
no setting of numba is changed.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
from llvmlite import binding

from mrmg import storage
from mrmg.locking import locked

PACKAGE = Path(__file__).resolve().parents[1]
"""Folder of the package."""

_SOURCES = (
    "compilation/*.py",
    "energy/model.py",
    "motion/dynamics.py",
    "**/*_kernels.py",
)


@cache
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
    """Return the folder of this machine's kernels: below numba's, if one is set.

    Kernels that a crash or a full disk cut off are given up, as numba cannot read what
    is left of them.
    """
    own = storage.user_cache_folder() / "kernels"
    folder = Path(numba.config.CACHE_DIR or own) / compilation_digest()
    for complete in folder.glob("complete-*"):
        cut_off = _cut_off(complete)
        with suppress(OSError):
            for file in cut_off:
                kernel = re.sub(r"\.(\d+\.nbc|nbi)$", "", file.name)
                for kept in file.parent.glob(f"{kernel}.*nb?"):
                    kept.unlink(missing_ok=True)
            if cut_off:
                complete.unlink(missing_ok=True)
    return folder


def _cut_off(complete: Path) -> list[Path]:
    """Return the files that are smaller than when all kernels of a part were there.

    They need not be cut off: two processes that compile a kernel may have written it,
    and its size differs by some bytes. To compile it again does no harm.
    """
    root = complete.parents[1]
    try:
        sizes = json.loads(complete.read_text())
    except (OSError, ValueError):
        return [complete, *_kernels(complete.parent)]
    files = {root / name: size for name, size in sizes.items()}
    return [
        file
        for file, size in files.items()
        if not file.exists() or file.stat().st_size < size
    ]


@contextmanager
def compiling_alone() -> Iterator[None]:
    """Wait until no other process compiles kernels into this folder, if it has locks.

    Two that compile one kernel at once take twice as long, and each overwrites the
    other's.
    """
    with ExitStack() as stack:
        with suppress(OSError):
            cache_folder().mkdir(parents=True, exist_ok=True)
            stack.enter_context(locked(cache_folder(), wait=True))
        yield


def to_be_kept(function: Callable[..., Any]) -> Callable[..., Any] | None:
    """Return a kernel whose source lies in the folder of kernels, if that can be.

    Args:
        function: a kernel; those that are no part of this package are not kept.
    """
    source = Path(function.__code__.co_filename).resolve()
    if source not in kernel_sources():
        return None
    copy = cache_folder() / ".".join(source.relative_to(PACKAGE).parts)
    try:
        if not copy.exists():
            copy.parent.mkdir(parents=True, exist_ok=True)
            written = copy.with_suffix(f".{os.getpid()}")
            shutil.copy2(source, written)  # with its date: some numba go by that
            written.replace(copy)
    except OSError:
        return None
    code = function.__code__.replace(co_filename=str(copy))
    return FunctionType(
        code,
        function.__globals__,
        function.__name__,
        function.__defaults__,
        function.__closure__,
    )


def _kernels(folder: Path) -> Iterator[Path]:
    """Return the files of compiled kernels and of their indices.

    numba keeps them in the folder or, if one is set for it, in some named after it.
    """
    for kept in folder.parent.glob(f"{folder.name}*"):
        yield from kept.rglob("*.nb?")


def compiled_kernels() -> int:
    """Return how many kernels this machine holds compiled."""
    return sum(path.suffix == ".nbc" for path in _kernels(cache_folder()))


def kernels_are_compiled(part: str) -> bool:
    """Return whether this machine holds all kernels of a part of them, if any."""
    return bool(numba.config.DISABLE_JIT) or _complete(part).exists()


def note_kernels_are_compiled(part: str) -> None:
    """Have the next process know that this machine holds all kernels of a part."""
    if not kernels_are_compiled(part):
        root = cache_folder().parent
        sizes = {
            str(path.relative_to(root)): path.stat().st_size
            for path in _kernels(cache_folder())
        }
        storage.write_text(_complete(part), json.dumps(sizes))


def _complete(part: str) -> Path:
    return cache_folder() / f"complete-{part}"
