"""MuJoCo's own viewer on a screen that only exists in memory, used by a machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from ctypes.util import find_library
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        shutil.which("Xvfb") is None or find_library("Xtst") is None,
        reason="Xvfb and libXtst are not installed",
    ),
]

PERSON = """
import ctypes, sys, threading, time
from pathlib import Path

from mrmg.viz import native_view
from mrmg.viz.replay import replay_of

LEFT_ALT, C, SPACE = 0xFFE9, 0x63, 0x20
X11, XTEST = ctypes.CDLL("libX11.so.6"), ctypes.CDLL("libXtst.so.6")
X11.XOpenDisplay.restype = ctypes.c_void_p
SCREEN = ctypes.c_void_p(X11.XOpenDisplay(None))


def key(symbol, down):
    code = X11.XKeysymToKeycode(SCREEN, ctypes.c_ulong(symbol))
    XTEST.XTestFakeKeyEvent(SCREEN, code, down, 0)
    settle()


def move(x, y):
    XTEST.XTestFakeMotionEvent(SCREEN, -1, x, y, 0)
    settle()


def press(down):
    XTEST.XTestFakeButtonEvent(SCREEN, 1, down, 0)
    settle()


def settle():
    X11.XFlush(SCREEN)
    time.sleep(0.2)


def until(true):
    while not true():
        time.sleep(0.05)


def use(replay):
    until(lambda: replay.time_s > 0.0)  # it plays at once
    move(300, 240)
    key(SPACE, 1), key(SPACE, 0)
    until(lambda: not replay.playing)
    key(LEFT_ALT, 1), key(C, 1), key(C, 0), key(LEFT_ALT, 0)
    move(720, 115)
    press(1)
    for x in range(720, 800, 10):
        move(x, 115)
    press(0)
    print(replay.playing, replay.time_s / replay.end_s, flush=True)
    replay.speed = 32.0
    key(SPACE, 1), key(SPACE, 0)
    until(lambda: replay.time_s == replay.end_s)
    print("end", flush=True)


replay = replay_of(Path(sys.argv[1]))
replay.speed = 1.0
threading.Thread(target=use, args=(replay,), daemon=True).start()
native_view.open_window(replay.film.scene, replay)
"""


def test_slider_and_keys_move_the_time(quickstart_run: Path, tmp_path: Path) -> None:
    script = tmp_path / "person.py"
    script.write_text(PERSON)
    shown, output = subprocess.PIPE, subprocess.STDOUT
    screen = subprocess.Popen(
        ["Xvfb", "-displayfd", "1", "-screen", "0", "1280x720x24"],
        stdout=shown,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert screen.stdout is not None
    try:
        number = screen.stdout.readline().strip()
        viewer = subprocess.Popen(
            [sys.executable, str(script), str(quickstart_run)],
            env={**os.environ, "DISPLAY": f":{number}"},
            stdout=shown,
            stderr=output,
            text=True,
        )
        assert viewer.stdout is not None
        try:
            playing, share = viewer.stdout.readline().split()
            assert playing == "False"
            assert 0.55 < float(share) < 0.95
            assert viewer.stdout.readline() == "end\n"
        finally:
            viewer.terminate()
            viewer.wait()
    finally:
        screen.terminate()
        screen.wait()
