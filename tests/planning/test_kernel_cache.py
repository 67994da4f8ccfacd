"""Kernels are compiled once per machine: a new process finds them all, and fast."""

from __future__ import annotations

import subprocess
import sys

import pytest

COUNT = """
import mrmg.compilation
from numba.core import event

compiled = []

class Listener(event.Listener):
    def on_start(self, started):
        compiled.append(started.data["dispatcher"].py_func.__qualname__)

    def on_end(self, ended):
        pass

event.register("numba:compile", Listener())

import mrmg
from mrmg.planning import plan_mission

assert plan_mission(mrmg.load_scene("quickstart"), with_bound=True).plan
print(*compiled)
"""


def names_compiled() -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", COUNT], capture_output=True, text=True, check=True
    )
    return done.stdout.split()


@pytest.mark.slow
def test_no_kernel_is_compiled_in_a_second_process() -> None:
    """The first one may be that; where it compiled nothing, there is no more to see."""
    assert names_compiled() == [] or names_compiled() == []
