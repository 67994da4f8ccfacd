"""Examining the machine: what mrmg needs, what is there, and how to get the rest."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mrmg import __version__, shipped, storage
from mrmg.counted import counted
from mrmg.errors import MachineError
from mrmg.licences import dependencies


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        name: of the thing.
        found: what is there.
        remedy: what to do where something that is needed is missing, else "".
    """

    name: str
    found: str
    remedy: str = ""

    @property
    def ok(self) -> bool:
        """Whether nothing that is needed is missing."""
        return not self.remedy


def examine() -> list[Finding]:
    """Look at everything mrmg needs on this machine."""
    packages = list(_packages())
    findings = [_python(), _cpu(), *packages, _shipped_files()]
    if all(finding.ok for finding in packages):
        findings += [_kernel_cache(), _offscreen_drawing()]
    return findings


def _python() -> Finding:
    found = f"mrmg {__version__} on Python {platform.python_version()}"
    return Finding(name="python", found=found)


def _cpu() -> Finding:
    model = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    for line in lines:
        if line.startswith("model name"):
            model = line.partition(":")[2].strip()
            break
    return Finding(name="cpu", found=f"{os.cpu_count()} x {model}")


def _packages() -> Iterator[Finding]:
    for each in dependencies():
        if not each.extra and "mrmg" in each.required_by:
            found = each.version or "not installed"
            remedy = "" if each.version else f"pip install {each.package}"
            yield Finding(name=each.package, found=found, remedy=remedy)


def _shipped_files() -> Finding:
    scenes, models = shipped.scene_names(), shipped.model_names()
    remedy = "install mrmg again: its scenes or models are gone"
    return Finding(
        name="shipped files",
        found=", ".join(
            (counted(len(scenes), "scene"), counted(len(models), "robot model"))
        ),
        remedy="" if scenes and models else remedy,
    )


def _kernel_cache() -> Finding:
    from mrmg.compilation import cache_folder, kernels_are_compiled
    from mrmg.planning.parameters import PATH_FOLLOWING

    folder = cache_folder()
    nearest = next(path for path in (folder, *folder.parents) if path.exists())
    if not storage.is_writable(nearest):
        return Finding(
            name="kernel cache",
            found=f"{nearest} cannot be written",
            remedy="set NUMBA_CACHE_DIR to a folder that can be written",
        )
    state = (
        "filled"
        if kernels_are_compiled(PATH_FOLLOWING)
        else "incomplete; the next planning compiles"
    )
    return Finding(name="kernel cache", found=f"{folder} ({state})")


def _offscreen_drawing() -> Finding:
    from mrmg.viz.gl_backend import choose_backend

    try:
        return Finding(name="offscreen GL", found=choose_backend())
    except MachineError as error:
        found, _, remedy = str(error).partition("\n")
        remedy = remedy.replace("\n", "; ")
        return Finding(name="offscreen GL", found=found, remedy=remedy)
