"""What counts as compiled belongs to sources, numba, Python and the processor."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numba
import pytest

import mrmg
from mrmg.compilation import cache
from mrmg.motion import _kernels

COUNT = """
from mrmg.compilation import (
    cache_folder, compiled_kernels, kernels_are_compiled, note_kernels_are_compiled
)
from mrmg.motion._kernels import turn_speed

before = compiled_kernels()
turn_speed(0, 1.0, 0.1, 2.0)
print(cache_folder().name, before, compiled_kernels(), kernels_are_compiled("one"))
note_kernels_are_compiled("one")
"""

FOLDER = "from mrmg.compilation import cache_folder; print(cache_folder())"


def digest() -> str:
    return cache.compilation_digest.__wrapped__()


@pytest.mark.parametrize(
    "change",
    [
        lambda patch: patch.setattr(numba, "__version__", "0.99.0"),
        lambda patch: patch.setattr(platform, "python_version", lambda: "3.99.1"),
        lambda patch: patch.setattr(numba.config, "CPU_NAME", "generic"),
        lambda patch: patch.setattr(numba.config, "CPU_FEATURES", "+sse2"),
        lambda patch: patch.setattr(
            cache.binding, "get_host_cpu_name", lambda: "another"
        ),
    ],
    ids=["numba", "python", "processor", "features", "host"],
)
def test_what_kernels_are_compiled_with_is_part_of_their_place(
    monkeypatch: pytest.MonkeyPatch, change: Callable[[pytest.MonkeyPatch], None]
) -> None:
    before = digest()
    assert digest() == before
    change(monkeypatch)
    assert digest() != before


def test_every_kernel_source_is_part_of_their_place(tmp_path: Path) -> None:
    package = tmp_path / "mrmg"
    shutil.copytree(Path(mrmg.__file__).parent, package)

    def folder() -> str:
        done = subprocess.run(
            [sys.executable, "-c", FOLDER],
            env={**os.environ, "PYTHONPATH": str(tmp_path)},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout

    before = folder()
    (package / "errors.py").open("a").write("# no kernel\n")
    assert folder() == before
    for name in ("energy/model.py", "motion/dynamics.py", "world/_kernels.py"):
        (package / name).open("a").write("# another comment\n")
        after = folder()
        assert after != before, name
        before = after


def test_a_part_is_complete_when_that_is_noted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(numba.config, "DISABLE_JIT", False)
    monkeypatch.setattr(cache, "cache_folder", lambda: tmp_path)
    assert not cache.kernels_are_compiled("one")
    cache.note_kernels_are_compiled("one")
    assert cache.kernels_are_compiled("one")
    assert not cache.kernels_are_compiled("other")


def test_kernels_that_were_cut_off_are_given_up(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(numba.config, "DISABLE_JIT", False)
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    kernel = cache.cache_folder.__wrapped__() / "world" / "kernel.1.nbc"
    kernel.parent.mkdir(parents=True)
    index = kernel.with_name("kernel.nbi")
    others = [kernel.with_name(f"{name}.1.nbc") for name in ("kernels", "other")]

    for file in (kernel, index, *others):
        file.write_bytes(b"compiled")
    folder = kernel.parents[1]
    with monkeypatch.context() as patch:
        patch.setattr(cache, "cache_folder", lambda: folder)
        cache.note_kernels_are_compiled("one")
    again = cache.cache_folder.__wrapped__
    assert again() == folder and kernel.exists()
    kernel.write_bytes(b"compiled for one type more")
    assert again() == folder and kernel.exists()
    kernel.write_bytes(b"comp")
    assert again() == folder and not kernel.exists() and not index.exists()
    assert all(other.exists() for other in others)
    note = folder / "complete-one"
    assert not note.exists()
    note.write_bytes(b"")
    assert again() == folder and not any(other.exists() for other in others)


def test_kernels_are_kept_in_the_folder_that_numba_is_given(tmp_path: Path) -> None:
    kept = tmp_path / "numba"
    environment = {
        **os.environ,
        "XDG_CACHE_HOME": str(tmp_path / "unused"),
        "NUMBA_CACHE_DIR": str(kept),
    }
    counted = [
        subprocess.run(
            [sys.executable, "-c", COUNT],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        for _ in range(2)
    ]
    digest = counted[0][0]
    assert counted == [[digest, "0", "1", "False"], [digest, "1", "1", "True"]]
    found = {path.relative_to(kept).parts[0] for path in tmp_path.rglob("*.nb?")}
    assert found and all(name.startswith(digest) for name in found)

    next(kept.rglob("*.nbc")).write_bytes(b"cut off")
    asked = [sys.executable, "-c", FOLDER]
    subprocess.run(asked, env=environment, capture_output=True, check=True)
    assert list(tmp_path.rglob("*.nb?")) == []


def test_without_a_writable_folder_nothing_is_kept(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    kernel = _kernels.turn_speed.py_func  # type: ignore[attr-defined]
    kept = cache.to_be_kept(kernel)
    assert kept is not None and kept.__code__.co_code == kernel.__code__.co_code
    monkeypatch.setattr(cache, "cache_folder", lambda: blocked / "kernels")
    assert cache.to_be_kept(kernel) is None


def test_kernels_of_others_are_not_kept() -> None:
    def kernel() -> None:
        """Do nothing."""

    assert cache.to_be_kept(kernel) is None
