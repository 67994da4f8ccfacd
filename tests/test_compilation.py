"""Compiled kernels belong to their sources, not to a place or a date."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import mrmg

PACKAGE = Path(mrmg.__file__).parent

CALL = """
import mrmg.compilation
from numba.core import event

compiled = []


class Listener(event.Listener):
    def on_start(self, started):
        compiled.append(started)

    def on_end(self, ended):
        pass


event.register("numba:compile", Listener())

from mrmg.motion import _kernels

value = _kernels.turn_speed(0, 1.0, 0.1, 2.0)
print(_kernels.__file__, value, len(compiled) == 0)
"""


def copy_of_package(folder: Path) -> Path:
    """Copy what the kernels of motion need; dates are those of the copying."""
    target = folder / "mrmg"
    for folder_name in ("motion", "compilation"):
        (target / folder_name).mkdir(parents=True)
    (target / "__init__.py").write_text("")
    (target / "motion" / "__init__.py").write_text("")
    for name in (
        "compilation/__init__.py",
        "compilation/cache.py",
        "compilation/calls.py",
        "compilation/decorators.py",
        "storage.py",
        "errors.py",
        "motion/_kernels.py",
        "motion/_pointer_kernels.py",
        "motion/dynamics.py",
        "energy.py",
    ):
        shutil.copyfile(PACKAGE / name, target / name)
    return folder


def call_kernel(package: Path, cache: Path) -> tuple[str, float, bool]:
    """Return (file, value, whether the kernel was found compiled) in a new process."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(package),
        "XDG_CACHE_HOME": str(cache),
    }
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", CALL],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
        cwd=package,
    )
    file, value, found = done.stdout.split()
    return file, float(value), found == "True"


def test_a_copy_of_the_package_finds_the_kernels_of_another(tmp_path: Path) -> None:
    first = copy_of_package(tmp_path / "first")
    second = copy_of_package(tmp_path / "second")
    cache = tmp_path / "cache"
    file, value, found = call_kernel(first, cache)
    assert file.startswith(str(first))
    assert not found
    file, again, found = call_kernel(second, cache)
    assert file.startswith(str(second))
    assert found
    assert again == value


def test_an_edit_of_any_kernel_source_compiles_anew(tmp_path: Path) -> None:
    package = copy_of_package(tmp_path / "package")
    cache = tmp_path / "cache"
    _, value, _ = call_kernel(package, cache)
    dynamics = package / "mrmg" / "motion" / "dynamics.py"
    source = dynamics.read_text()
    edited = source.replace("abs(v * tan", "2.0 * abs(v * tan")
    assert edited != source
    dynamics.write_text(edited)
    _, doubled, found = call_kernel(package, cache)
    assert not found
    assert doubled == 2.0 * value
