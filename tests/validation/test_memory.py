"""The memory that planning takes, as a whole process with all it imports."""

from __future__ import annotations

import subprocess
import sys

import pytest

MOST_MB = 500.0

PEAK = """
from pathlib import Path

import mrmg
from mrmg.planning import plan_mission

assert plan_mission(mrmg.load_scene("scene6_r8"), with_bound=True).plan
# Not ru_maxrss: that is at least what the process was started from had.
status = dict(line.split(":") for line in Path("/proc/self/status").open())
print(float(status["VmHWM"].split()[0]) / 1024.0)
"""


@pytest.mark.slow
def test_planning_for_eight_robots_and_bounding_keeps_to_half_a_gigabyte() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PEAK], capture_output=True, text=True, check=True
    )
    assert 50.0 < float(done.stdout) < MOST_MB
