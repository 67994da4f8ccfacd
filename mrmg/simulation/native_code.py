"""CasADi functions as machine code, where a C compiler is at hand.

The C code of a function is compiled once and its library kept in the user's cache,
named by a digest of the code, beside a digest of itself: to load one that was cut off
would end the process. The library is used only if it answers a probe bit by bit as the
interpreted function does, so that logs do not depend on there being a compiler;
whatever fails on the way, the interpreted function drives.
"""

from __future__ import annotations

import platform
import shutil
import subprocess
import tempfile
from pathlib import Path

import casadi as ca
import numpy as np

from mrmg import storage

# Contracted products and sums would be rounded once instead of twice.
_FLAGS = ("-O1", "-ffp-contract=off", "-fPIC", "-shared")
_LONGEST_S = 60.0
_PROBES = 8


def compiled(function: ca.Function) -> ca.Function:
    """Return `function` as machine code, or itself where that is not to be had."""
    generator = ca.CodeGenerator(f"{function.name()}.c")
    generator.add(function)
    source = generator.dump()
    try:
        library = _library(source)
        if library is None:
            return function
        native = ca.external(function.name(), str(library))
    except (OSError, RuntimeError, subprocess.SubprocessError):
        return function
    return native if _agree(function, native) else function


def _library(source: str) -> Path | None:
    """Return the library of some C code, compiled if need be; None without compiler."""
    key = storage.digest("\n".join((platform.machine(), *_FLAGS, source)))
    library = storage.user_cache_folder() / "controllers" / f"{key}.so"
    whole = library.with_suffix(".digest")
    noted = whole.read_text(errors="replace") if whole.is_file() else ""
    if library.is_file() and noted == _digest_of(library):
        return library
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as folder, storage.atomic_path(library) as made:
        code = Path(folder) / "code.c"
        code.write_text(source)
        subprocess.run(
            [compiler, *_FLAGS, str(code), "-o", str(made), "-lm"],
            check=True,
            capture_output=True,
            timeout=_LONGEST_S,
        )
        digest = _digest_of(made)
    storage.write_text(whole, digest)
    return library


def _digest_of(library: Path) -> str:
    return storage.bytes_digest(library.read_bytes())


def _agree(function: ca.Function, native: ca.Function) -> bool:
    """Return whether both give the same bits."""
    rng = np.random.default_rng(0)
    for _ in range(_PROBES):
        probe = [
            rng.uniform(-1.5, 1.5, function.numel_in(index))
            for index in range(function.n_in())
        ]
        answers = zip(function.call(probe), native.call(probe), strict=True)
        if any(
            one.full().tobytes() != other.full().tobytes() for one, other in answers
        ):
            return False
    return True
