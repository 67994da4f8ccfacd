"""What planning calls is compiled ahead of it, so that no time limit includes it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

pytestmark = [
    pytest.mark.skipif(numba.config.DISABLE_JIT, reason="about compiled kernels"),
    pytest.mark.ci,
]

TOOLS = Path(__file__).parents[2] / "tools"

MISSIONS = """
import sys

import mrmg
from bench_docks import hall
from bench_headings import yard
from mrmg.compilation.decorators import Kernel
from mrmg.planning import preparation
from mrmg.planning.parameters import PATH_FOLLOWING
from mrmg.scene.populating.populate import populate

for call in preparation.CALLS[PATH_FOLLOWING]:
    call()


def compiled():
    kernels = {
        f"{name}.{key}": value
        for name, module in sys.modules.items()
        if name.startswith("mrmg.") and name.endswith("_kernels")
        for key, value in vars(module).items()
        if isinstance(value, Kernel) and value.__module__ == name
    }
    return {name: len(one.for_python.signatures) for name, one in kernels.items()}


missions = [mrmg.load_scene(name) for name in ("scene1", "hills", "diffdrive", "mixed")]
missions += [one.with_(objective="makespan") for one in missions]
missions += [yard("diffdrive", 100, 3), yard("car", 101, 3)]
missions += [hall("diffdrive", 101), hall("car", 102)]
missions.append(missions[-1].with_(objective="makespan"))
field = mrmg.load_scene("scene6")
missions += [field, populate(field, robots=6, goals=70)]
before = compiled()
for mission in missions:
    assert mrmg.plan(mission, with_bound=True).plan is not None, mission.name
mrmg.plan(field, router="nrpa")
print([name for name, count in compiled().items() if count > before.get(name, 0)])
"""


def test_no_mission_needs_a_kernel_that_the_smallest_ones_do_not() -> None:
    """Nor one for arrays of another type, such as those that cannot be written."""
    ended = subprocess.run(
        [sys.executable, "-c", MISSIONS],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(TOOLS), *sys.path])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.stdout.strip() == "[]", ended.stdout + ended.stderr[-2000:]
