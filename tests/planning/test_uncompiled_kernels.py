"""Kernels mean the same without numba: their tests pass uncompiled, too.

What only a compiler lets pass (fields of records, types that change, indices out of
range) shows there.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
QUICK = ("band", "reeds_shepp", "random", "refuel", "roadmap")
"""Kernels whose tests take seconds uncompiled."""


@pytest.mark.slow
def test_tests_of_kernels_pass_uncompiled() -> None:
    names = [f"test_{name}_kernels.py" for name in QUICK]
    files = [str(path) for name in names for path in HERE.rglob(name)]
    assert len(files) == len(names)
    options = ["-q", "-p", "no:cacheprovider"]
    ended = subprocess.run(
        [sys.executable, "-m", "pytest", *options, *files],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=HERE.parents[1],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout
