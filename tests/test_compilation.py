"""Compiled kernels belong to their sources, not to a place or a date."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

import mrmg
from mrmg.compilation import compile_in_processes

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


CHAIN = """
from mrmg.compilation import kernel


@kernel
def far(x):
{steps}
    return x


@kernel
def near(x):
    return far(x) + 1.0


@kernel
def caller(x):
{steps}
    return near(x)


@kernel
def other_caller(x):
{steps}
    return near(x) - 1.0
""".format(steps="\n".join(["    x = (x * 3.0 + 1.0) / 3.0 - 1.0 / 3.0"] * 60))
"""`far` is called by symbol, `near` is linked into what calls it."""


def copy_of_package(folder: Path) -> Path:
    """Copy what the kernels of motion need; dates are those of the copying."""
    target = folder / "mrmg"
    for folder_name in ("motion", "compilation"):
        (target / folder_name).mkdir(parents=True)
    (target / "__init__.py").write_text("")
    (target / "motion" / "__init__.py").write_text("")
    for name in (
        "compilation/__init__.py",
        "compilation/arrays.py",
        "compilation/cache.py",
        "compilation/calls.py",
        "compilation/clock.py",
        "compilation/decorators.py",
        "compilation/libraries.py",
        "compilation/parallel.py",
        "compilation/pointers.py",
        "compilation/sharing.py",
        "compilation/shortcuts.py",
        "interruption.py",
        "storage.py",
        "errors.py",
        "motion/_kernels.py",
        "motion/_pointer_kernels.py",
        "motion/dynamics.py",
        "energy.py",
    ):
        shutil.copyfile(PACKAGE / name, target / name)
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


def test_a_copy_of_the_package_finds_the_kernels_of_another(tmp_path: Path) -> None:
    first = copy_of_package(tmp_path / "first")
    second = copy_of_package(tmp_path / "second")
    cache = tmp_path / "cache"
    file, value, compiled = call_kernel(first, cache)
    assert file.startswith(str(first))
    assert compiled > 0
    file, again, compiled = call_kernel(second, cache)
    assert file.startswith(str(second))
    assert compiled == 0
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
    _, doubled, compiled = call_kernel(package, cache)
    assert compiled > 0
    assert doubled == 2.0 * value


@pytest.mark.slow
def test_processes_that_compile_at_once_share_the_work(tmp_path: Path) -> None:
    package = copy_of_package(tmp_path / "package")
    alone = call_kernel(package, tmp_path / "cache of one")
    together = [start_call(package, tmp_path / "cache of two") for _ in range(2)]
    answers = [answer(process) for process in together]
    assert [value for _, value, _ in answers] == [alone[1]] * 2
    ours = len(list((tmp_path / "cache of one").rglob("*.nbc")))
    assert len(list((tmp_path / "cache of two").rglob("*.nbc"))) == ours
    compiled = sum(number for _, _, number in answers)
    assert compiled < 2 * alone[2]


@pytest.mark.slow
def test_a_compilation_that_is_killed_leaves_a_cache_that_can_be_used(
    tmp_path: Path,
) -> None:
    package = copy_of_package(tmp_path / "package")
    expected = call_kernel(package, tmp_path / "another cache")[1]
    cache = tmp_path / "cache"
    killed = start_call(package, cache)
    while not list(cache.rglob("*.lock")):
        assert killed.poll() is None
        time.sleep(0.001)
    killed.kill()
    killed.communicate()
    _, value, compiled = call_kernel(package, cache)
    assert value == expected
    assert compiled > 0
    assert call_kernel(package, cache)[1:] == (expected, 0)


@pytest.mark.slow
def test_what_linked_functions_call_by_symbol_is_loaded_before_their_callers(
    tmp_path: Path,
) -> None:
    package = copy_of_package(tmp_path / "package")
    (package / "mrmg" / "motion" / "chain.py").write_text(CHAIN)
    cache = tmp_path / "cache"
    call = "from mrmg.motion import chain; print(chain.{}(1.0))"
    # The second process compiles what links a function that the first has compiled;
    # the third finds all compiled.
    for name, expected in (
        ("other_caller", 1.0),
        ("caller", 2.0),
        ("caller", 2.0),
    ):
        done = subprocess.run(
            [sys.executable, "-c", call.format(name)],
            capture_output=True,
            text=True,
            env=environment_of(package, cache),
            cwd=package,
            check=True,
        )
        assert float(done.stdout) == pytest.approx(expected)


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
