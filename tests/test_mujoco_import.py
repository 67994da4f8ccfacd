"""What MuJoCo's import starts is out of reach of Ctrl-C."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

REPORT = """
import signal, sys

def report(event, arguments):
    if event == "subprocess.Popen":
        print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))

sys.addaudithook(report)
import mrmg.mujoco_import
print("after:", signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems start no children")
def test_children_of_the_import_do_not_see_ctrl_c() -> None:
    """Where no child is started any more, the shelter has become needless."""
    answer = subprocess.run(
        [sys.executable, "-c", REPORT], capture_output=True, text=True, check=True
    )
    *children, after = answer.stdout.splitlines()
    assert set(children) == {"True"}
    assert after == "after: False"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["nonsense", "osmesa"])
def test_drawing_that_is_missing_keeps_nobody_from_driving_and_drawing(
    name: str,
) -> None:
    code = (
        "from mrmg.mujoco_import import mujoco; mujoco.MjData\n"
        "from mrmg.viz.gl_backend import offscreen_context\n"
        "with offscreen_context(32, 32) as backend: print(backend)"
    )
    environment = {**os.environ, "MUJOCO_GL": name}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
