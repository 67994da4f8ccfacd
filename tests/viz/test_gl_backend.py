"""Finding OpenGL: a working backend is taken, a missing one is named."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from mrmg.errors import ExitCode, MachineError
from mrmg.viz import gl_backend


@pytest.fixture(autouse=True)
def forget_the_choice():
    gl_backend.choose_backend.cache_clear()
    yield
    gl_backend.choose_backend.cache_clear()


def broken_python(folder: Path, script: str) -> str:
    """An interpreter in whose processes every probe ends as `script` says."""
    path = folder / "python"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return str(path)


def test_the_chosen_backend_opens_a_context_twice() -> None:
    for _ in range(2):
        with gl_backend.offscreen_context(64, 48) as backend:
            assert backend in gl_backend.BACKENDS


def test_opening_a_context_leaves_the_environment_as_it_was() -> None:
    before = dict(os.environ)
    with gl_backend.offscreen_context(64, 48):
        pass
    assert dict(os.environ) == before


def test_without_any_backend_one_error_names_the_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = 'echo "ImportError: no library" >&2; exit 1'
    monkeypatch.setattr(sys, "executable", broken_python(tmp_path, script))
    with pytest.raises(MachineError) as caught:
        gl_backend.choose_backend()
    message = str(caught.value)
    assert "egl: ImportError: no library" in message
    assert "libegl1 libgl1-mesa-dri libopengl0" in message
    assert "libosmesa6" in message
    assert "--no-video" in message
    assert caught.value.exit_code is ExitCode.MACHINE


def test_a_driver_that_kills_its_process_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # $3 is the backend: -c PROBE BACKEND.
    script = 'if [ "$3" = egl ]; then kill -SEGV $$; fi; exit 0'
    monkeypatch.setattr(sys, "executable", broken_python(tmp_path, script))
    assert gl_backend.choose_backend() == "osmesa"


def test_the_user_s_wish_is_tried_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", broken_python(tmp_path, "exit 0"))
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    assert gl_backend.choose_backend() == "osmesa"
    gl_backend.choose_backend.cache_clear()
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    assert gl_backend.choose_backend() == "egl"
