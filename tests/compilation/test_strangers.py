"""Importing and using this package changes nothing in numba for anybody else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

pytestmark = pytest.mark.skipif(
    numba.config.DISABLE_JIT, reason="about compiled kernels"
)

STRANGER = """
import numba
import numpy as np
from numba.core import types


@numba.njit(cache=True)
def arrays(n):
    first, second = np.zeros(n), np.full((n, 2), 3.0)
    for i in range(n):
        first[i] = second[i, 0] * i + np.arange(n).sum()
    return first, np.ones(n, np.int64), np.empty(0)


@numba.njit
def misfit(n):
    target = np.zeros(n)
    target[: n - 1] = np.ones(n)
    return target


@numba.njit
def nonsense(x):
    return x + "text"


def settings():
    return {
        name: repr(getattr(numba.config, name))
        for name in dir(numba.config)
        if name.isupper()
    }


def seen(kernels):
    arrays, misfit, nonsense = kernels
    found = [settings(), [a.tolist() for a in arrays(4)], arrays.stats.cache_path]
    for function, given in ((misfit, 3), (nonsense, 1)):
        try:
            function(given)
        except Exception as error:
            found.append((type(error).__name__, str(error)))
        else:
            found.append(None)
    return found
"""

LOOK = """
import importlib.util
import os
import sys


def fresh(name):
    spec = importlib.util.spec_from_file_location("stranger", sys.argv[1])
    module = sys.modules["stranger"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.seen((module.arrays, module.misfit, module.nonsense))


def use_mrmg():
    import mrmg
    from mrmg.motion._kernels import turn_speed
    from mrmg.world import _kernels

    assert turn_speed(0, 1.0, 0.1, 2.0) > 0.0


before = dict(os.environ)
steps = {"stranger": lambda: print(fresh("stranger")), "mrmg": use_mrmg}
for step in sys.argv[2:]:
    steps[step]()
assert dict(os.environ) == before
"""


def seen_in(folder: Path, *steps: str) -> list[str]:
    """Return what a stranger's kernels do at each of its steps in one process."""
    done = subprocess.run(
        [sys.executable, "-c", LOOK, str(folder / "stranger.py"), *steps],
        env={**os.environ, "XDG_CACHE_HOME": str(folder / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_strangers_kernels_do_the_same_before_and_after(tmp_path: Path) -> None:
    (tmp_path / "stranger.py").write_text(STRANGER)
    # numba itself words some errors another way the second time.
    alone = seen_in(tmp_path, "stranger", "stranger")
    assert seen_in(tmp_path, "stranger", "mrmg", "stranger") == alone
    assert seen_in(tmp_path, "mrmg", "stranger") == alone[:1]
