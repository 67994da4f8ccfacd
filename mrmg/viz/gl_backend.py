"""Finding an OpenGL that can draw without a screen: EGL first, then OSMesa.

A backend is tried in a process of its own, since a broken driver may end the process
that loads it. The context is then opened by name, so that it does not matter whether
mujoco was imported before, or what `MUJOCO_GL` was at that time.
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from unittest import mock

from mrmg.errors import MachineError

BACKENDS = ("egl", "osmesa")
"""Offscreen backends in the order they are tried."""

_CURE = (
    "install one of them:\n"
    "  apt-get install --no-install-recommends libegl1 libgl1-mesa-dri libopengl0\n"
    "  apt-get install --no-install-recommends libosmesa6\n"
    "or run without video (--no-video)"
)

_PROBE = """
import sys
from importlib import import_module
from mrmg.mujoco_import import mujoco
context = import_module("mujoco." + sys.argv[1]).GLContext(32, 32)
context.make_current()
model = mujoco.MjModel.from_xml_string("<mujoco/>")
drawing = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
assert drawing.offFBO, "no offscreen framebuffer"
drawing.free()
context.free()
"""


@cache
def choose_backend() -> str:
    """Return the first backend that can draw here; probed once per process.

    The variable `MUJOCO_GL`, where it names one of the backends, puts that one first.

    Raises:
        MachineError: if none works; names the packages that remedy it.
    """
    wish = os.environ.get("MUJOCO_GL", "").strip().lower()
    reasons = []
    for backend in sorted(BACKENDS, key=lambda name: name != wish):
        reason = _why_not(backend)
        if reason is None:
            return backend
        reasons.append(f"  {backend}: {reason}")
    raise MachineError(
        "no OpenGL that draws without a screen was found\n"
        + "\n".join(reasons)
        + f"\n{_CURE}"
    )


@contextmanager
def offscreen_context(width: int, height: int) -> Iterator[str]:
    """Make an offscreen OpenGL context current while the block runs.

    Args:
        width: of the frame buffer [pixels].
        height: of the frame buffer [pixels].

    Yields:
        The name of the backend.

    Raises:
        MachineError: if no backend works on this machine.
    """
    backend = choose_backend()
    # PyOpenGL takes its platform from the environment at first import.
    with mock.patch.dict(os.environ, {"PYOPENGL_PLATFORM": backend}):
        context = importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
    context.make_current()
    try:
        yield backend
    finally:
        context.free()


def _why_not(backend: str) -> str | None:
    """Return why a backend cannot draw here, or None if it can."""
    environment = {**os.environ, "MUJOCO_GL": backend, "PYOPENGL_PLATFORM": backend}
    probe = subprocess.run(
        [sys.executable, "-c", _PROBE, backend],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    if probe.returncode == 0:
        return None
    lines = [line.strip() for line in probe.stderr.splitlines() if line.strip()]
    return lines[-1] if lines else f"its driver ended with status {probe.returncode}"
