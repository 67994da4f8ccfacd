"""Compiled functions give the same bits; without a working compiler nothing is lost."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from mrmg.simulation import mpc
from mrmg.simulation.native_code import compiled

needs_cc = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache of our own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "mrmg" / "controllers"


def example() -> ca.Function:
    x = ca.SX.sym("x", 3)
    value = ca.vertcat(ca.sin(x[0]) * x[1] + x[2], ca.tan(x[1]) / x[2])
    return ca.Function("example", [x], [value, ca.jacobian(value, x)])


def is_native(function: ca.Function) -> bool:
    return bool(function.class_name() == "External")


def without_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "bin").mkdir(exist_ok=True)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))


def compiler_that(does: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Put a shell script in the place of the compiler."""
    real = shutil.which("cc")
    script = tmp_path / "fake" / "cc"
    script.parent.mkdir()
    script.write_text(f"#!/bin/sh\n{does.format(cc=real)}\n")
    script.chmod(0o755)
    monkeypatch.setenv("PATH", f"{script.parent}:/usr/bin:/bin")


@needs_cc
@pytest.mark.parametrize("motion_model", ["car", "unicycle"])
def test_the_linearisation_gives_the_same_bits(motion_model: str) -> None:
    interpreted = mpc._linearised_gaps(motion_model, 1.2)
    native = compiled(interpreted)
    assert is_native(native)
    rng = np.random.default_rng(1)
    for _ in range(200):
        z = rng.uniform(-3.0, 3.0, interpreted.numel_in(0))
        for one, other in zip(interpreted.call([z]), native.call([z]), strict=True):
            assert one.full().tobytes() == other.full().tobytes()


@pytest.mark.parametrize("motion_model", ["car", "unicycle"])
def test_the_linearisation_is_that_of_the_gaps(motion_model: str) -> None:
    """Oracle: central differences of the gaps themselves."""
    gaps = mpc._linearised_gaps(motion_model, 1.2)
    z = np.random.default_rng(2).uniform(-0.5, 0.5, gaps.numel_in(0))
    jacobian = gaps(z)[0].full()
    for column in range(len(z)):
        step = 1e-6 * np.eye(len(z))[column]
        change = (gaps(z + step)[1] - gaps(z - step)[1]).full()[:, 0] / 2e-6
        np.testing.assert_allclose(jacobian[:, column], change, atol=1e-8)


@needs_cc
def test_what_is_compiled_once_needs_no_compiler_again(
    cache: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert is_native(compiled(example()))
    (library,) = cache.glob("*.so")
    before = library.stat().st_mtime_ns
    without_compiler(monkeypatch, tmp_path)
    assert is_native(compiled(example()))
    assert library.stat().st_mtime_ns == before


@needs_cc
def test_a_library_that_was_cut_off_is_made_anew(cache: Path, tmp_path: Path) -> None:
    kept = compiled(example())  # by this process, of which the file is taken away
    (library,) = cache.glob("*.so")
    whole = library.read_bytes()
    library.rename(tmp_path / "loaded.so")
    library.write_bytes(whole[: len(whole) // 2])
    assert is_native(compiled(example()))
    assert library.read_bytes() == whole
    assert is_native(kept)


@needs_cc
def test_a_digest_that_is_no_text_is_made_anew(cache: Path) -> None:
    kept = compiled(example())
    (noted,) = cache.glob("*.digest")
    digest = noted.read_text()
    noted.write_bytes(b"\xff\xfe")
    assert is_native(compiled(example()))
    assert noted.read_text() == digest
    assert is_native(kept)


def test_without_a_compiler_the_function_itself_drives(
    cache: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    without_compiler(monkeypatch, tmp_path)
    function = example()
    assert compiled(function) is function
    assert not cache.exists()


@needs_cc
@pytest.mark.parametrize(
    "does",
    [
        "exit 1",
        "exit 0",  # leaves an empty file
        "kill -9 $$",
        # the same code with a sine that is not quite one
        '{cc} -Dsin=cos "$@"',
    ],
)
def test_a_compiler_that_fails_or_errs_is_passed_over(
    does: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    compiler_that(does, monkeypatch, tmp_path)
    function = example()
    assert compiled(function) is function


def test_a_cache_that_cannot_be_written_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "file"))
    function = example()
    assert compiled(function) is function
