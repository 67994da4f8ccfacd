"""What code results are made by, so that those of other code are not taken for them."""

from __future__ import annotations

from functools import cache
from importlib.metadata import version
from pathlib import Path

import mrmg
from mrmg import storage


@cache
def code_digest() -> str:
    """Return a fingerprint of all code that decides results."""
    # The version alone would keep results of code that has been edited since.
    package = Path(mrmg.__file__).parent
    sources = sorted(package.rglob("*.py"))
    code = [storage.bytes_digest(path.read_bytes()) for path in sources]
    return storage.digest("".join([mrmg.__version__, version("mujoco"), *code]))
