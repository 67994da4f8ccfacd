"""On what, with what and with which seeds figures were measured."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import version
from pathlib import Path

import mrmg
from mrmg import shipped

_PACKAGES = ("mrmg", "mujoco", "casadi", "numpy", "scipy", "shapely", "numba")


def seed_range(text: str) -> range:
    """Return the seeds `first-last`, or the single one."""
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def versions() -> str:
    """Return the versions of everything that decides a figure."""
    packages = ", ".join(f"{name} {version(name)}" for name in _PACKAGES)
    return f"{packages}, Python {platform.python_version()}, {cpu()}"


@cache
def state() -> str:
    """Return a fingerprint of sources, models, scenes, versions and processor.

    What was measured in one state is not measured again in the same, and says nothing
    of another.
    """
    package = Path(mrmg.__file__).parent
    files = [
        *package.rglob("*.py"),
        *(path for path in shipped.models_folder().rglob("*") if path.is_file()),
        *(path for path in shipped.scenes_folder().rglob("*") if path.is_file()),
    ]
    digest = hashlib.sha256(versions().encode())
    for path in sorted(files):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cpu() -> str:
    """Return the processor's name."""
    info = Path("/proc/cpuinfo")
    if not info.exists():
        return platform.processor()
    lines = info.read_text().splitlines()
    names = [line.partition(":")[2].strip() for line in lines if "model name" in line]
    return f"{names[0]} x {len(names)}" if names else platform.machine()
