"""Where compiled kernels are kept, and when they are good.

numba's cache does not notice edits in other files: a cached caller keeps the old
callee. The cache folder is therefore named after a digest of all sources that feed
kernels, and is set before numba is imported anywhere. Whatever has the same sources,
another copy or version of the package, finds the same compiled kernels.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from mrmg import storage

PACKAGE = Path(__file__).resolve().parents[1]
"""Folder of the package."""

_SOURCES = ("compilation/*.py", "energy.py", "motion/dynamics.py", "**/*_kernels.py")


def kernel_sources() -> list[Path]:
    """Return every source file whose code is compiled into a kernel."""
    return sorted({path for name in _SOURCES for path in PACKAGE.glob(name)})


@cache
def sources_digest() -> str:
    """Return a fingerprint of the sources, wherever they lie and whenever written."""
    state = hashlib.sha256()
    for path in kernel_sources():
        state.update(str(path.relative_to(PACKAGE)).encode())
        state.update(path.read_bytes())
    return state.hexdigest()[:16]


def cache_folder() -> Path:
    """Return the folder of compiled kernels that belongs to the present sources."""
    return storage.user_cache_folder() / "kernels" / sources_digest()


os.environ.setdefault("NUMBA_CACHE_DIR", str(cache_folder()))
# Vectorisers and the last optimisation level double the time to compile and gain
# nothing on kernels that branch at every step (measured on the planner's).
os.environ.setdefault("NUMBA_OPT", "2")
os.environ.setdefault("NUMBA_LOOP_VECTORIZE", "0")
os.environ.setdefault("NUMBA_SLP_VECTORIZE", "0")
# After the package's own kernels come numba's ways for users' functions.
os.environ.setdefault(
    "NUMBA_CACHE_LOCATOR_CLASSES",
    f"{__name__}.KernelLocator,UserProvidedCacheLocator,InTreeCacheLocator,"
    "UserWideCacheLocator,IPythonCacheLocator",
)

import numba  # noqa: E402  (must follow the cache setting)
from numba.core import caching  # noqa: E402

numba.core.config.reload_config()  # in case somebody imported numba before


class KernelLocator(caching.UserProvidedCacheLocator):
    """Finds compiled kernels by their place in the package and its sources' digest.

    numba goes by a file's full path and its date, which differ from copy to copy.
    """

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> Any:
        """Return a locator for a function of this package, None for any other."""
        if not Path(py_file).resolve().is_relative_to(PACKAGE):
            return None
        return super().from_function(py_func, py_file)

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """Return the folder of a file's kernels below the cache folder."""
        place = Path(py_file).resolve().relative_to(PACKAGE)
        return ".".join(place.with_suffix("").parts)

    def get_source_stamp(self) -> str:
        """Return what must not have changed for compiled kernels to be good."""
        return sources_digest()


def compiled_kernels() -> int:
    """Return how many kernels of these sources this machine holds compiled."""
    return sum(1 for _ in _folder().rglob("*.nbc"))


def kernels_are_compiled() -> bool:
    """Tell whether this machine holds all the kernels that missions need, if any."""
    return bool(numba.config.DISABLE_JIT) or (_folder() / _COMPLETE).exists()


def note_kernels_are_compiled() -> None:
    """Have the next process know that this machine holds all kernels."""
    if not kernels_are_compiled():
        storage.write_text(_folder() / _COMPLETE, f"{compiled_kernels()} kernels\n")


def _folder() -> Path:
    return Path(os.environ["NUMBA_CACHE_DIR"])


_COMPLETE = "complete"
