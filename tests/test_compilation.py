"""Compiled kernels belong to their sources, not to a place or a date."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import mrmg
from mrmg.compilation import compile_in_processes
from mrmg.planning import preparation
from mrmg.planning.parameters import PATH_FOLLOWING

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
print(_kernels.__file__, value, len(compiled))
"""

TRACES = """
import os
from pathlib import Path


def first():
    Path(__file__).with_name("first.trace").write_text(str(os.getpid()))


def fail():
    raise RuntimeError


def second():
    Path(__file__).with_name("second.trace").write_text(str(os.getpid()))
"""


def copy_of_package(folder: Path) -> Path:
    """Copy the package; dates are those of the copying."""
    shutil.copytree(
        PACKAGE,
        folder / "mrmg",
        copy_function=shutil.copyfile,
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    return folder


def environment_of(package: Path, cache: Path) -> dict[str, str]:
    """Return the environment of a process that has a package and a cache of its own."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(package),
        "XDG_CACHE_HOME": str(cache),
    }
    environment.pop("NUMBA_CACHE_DIR", None)
    return environment


def start_call(package: Path, cache: Path) -> subprocess.Popen[str]:
    """Call a kernel in a new process."""
    return subprocess.Popen(
        [sys.executable, "-c", CALL],
        stdout=subprocess.PIPE,
        text=True,
        env=environment_of(package, cache),
        cwd=package,
    )


def answer(process: subprocess.Popen[str]) -> tuple[str, float, int]:
    """Return (file, value, number of functions compiled for it)."""
    printed, _ = process.communicate()
    assert process.returncode == 0
    file, value, compiled = printed.split()
    return file, float(value), int(compiled)


def call_kernel(package: Path, cache: Path) -> tuple[str, float, int]:
    """Call a kernel in a new process, and wait."""
    return answer(start_call(package, cache))


def test_kernels_are_compiled_once_for_a_copy_of_the_package(tmp_path: Path) -> None:
    package = copy_of_package(tmp_path / "package")
    file, value, compiled = call_kernel(package, tmp_path / "cache")
    assert file.startswith(str(package))
    assert compiled > 0
    assert call_kernel(package, tmp_path / "cache") == (file, value, 0)


def test_an_edit_of_any_kernel_source_compiles_anew(tmp_path: Path) -> None:
    package = copy_of_package(tmp_path / "package")
    cache = tmp_path / "cache"
    _, value, _ = call_kernel(package, cache)
    dynamics = package / "mrmg" / "motion" / "dynamics.py"
    source = dynamics.read_text()
    edited = source.replace("abs(v * tan", "2.0 * abs(v * tan")
    assert edited != source
    dynamics.write_text(edited)
    _, doubled, compiled = call_kernel(package, cache)
    assert compiled > 0
    assert doubled == 2.0 * value


@pytest.mark.slow
def test_processes_that_compile_at_once_leave_a_good_cache(tmp_path: Path) -> None:
    package = copy_of_package(tmp_path / "package")
    cache = tmp_path / "cache"
    together = [start_call(package, cache) for _ in range(3)]
    values = {answer(process)[1] for process in together}
    assert len(values) == 1
    assert call_kernel(package, cache)[1:] == (values.pop(), 0)


@pytest.mark.slow
def test_a_compilation_that_is_killed_leaves_a_cache_that_can_be_used(
    tmp_path: Path,
) -> None:
    package = copy_of_package(tmp_path / "package")
    expected = call_kernel(package, tmp_path / "another cache")[1]
    cache = tmp_path / "cache"
    killed = start_call(package, cache)
    while not list(cache.rglob("*.nbi")):
        assert killed.poll() is None
        time.sleep(0.001)
    killed.kill()
    killed.communicate()
    assert call_kernel(package, cache)[1] == expected
    assert call_kernel(package, cache)[1:] == (expected, 0)


def test_calls_run_in_processes_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "leaving_traces.py").write_text(TRACES)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    import leaving_traces

    told: list[int] = []
    calls = (leaving_traces.first, leaving_traces.fail, leaving_traces.second)
    compile_in_processes(calls, told.append)
    traces = {path.read_text() for path in tmp_path.glob("*.trace")}
    assert len(traces) == 2
    assert str(os.getpid()) not in traces
    assert told


def test_of_processes_with_one_cache_one_compiles(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    complete: list[str] = []
    calls: list[int] = []

    def compile_slowly(*_: object) -> None:
        calls.append(threading.get_ident())
        time.sleep(0.1)

    for name, stand_in in {
        "kernels_are_compiled": complete.__contains__,
        "note_kernels_are_compiled": complete.append,
        "compile_in_processes": compile_slowly,
        "load_kernels": lambda part: None,
        "bound_smallest": lambda: None,
    }.items():
        monkeypatch.setattr(preparation, name, stand_in)
    threads = [
        threading.Thread(target=preparation.compile_kernels, args=(PATH_FOLLOWING,))
        for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert complete == [PATH_FOLLOWING]
    assert len(calls) == 1
