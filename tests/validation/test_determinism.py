"""Same scene, seed and budget of iterations: the same bytes, wherever they are made."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import mrmg

FILES = ("plan.json", "plan.npz")


def test_two_plans_of_one_process_are_equal_bytes(
    quickstart_run: Path, tmp_path: Path
) -> None:
    result = mrmg.plan(mrmg.load_scene("quickstart"), seed=0)
    assert result.plan is not None
    result.plan.save(tmp_path)
    for name in FILES:
        assert (tmp_path / name).read_bytes() == (quickstart_run / name).read_bytes()


@pytest.mark.quick("1")
@pytest.mark.parametrize("hash_seed", ["1", "4711"])
def test_another_process_plans_equal_bytes(
    hash_seed: str, quickstart_run: Path, tmp_path: Path
) -> None:
    subprocess.run(
        [sys.executable, "-m", "mrmg", "plan", "quickstart", "--out", str(tmp_path)],
        env={**os.environ, "PYTHONHASHSEED": hash_seed},
        check=True,
        capture_output=True,
    )
    for name in FILES:
        assert (tmp_path / name).read_bytes() == (quickstart_run / name).read_bytes()


def test_another_seed_gives_another_plan(quickstart_run: Path, tmp_path: Path) -> None:
    result = mrmg.plan(mrmg.load_scene("quickstart"), seed=1)
    assert result.plan is not None
    result.plan.save(tmp_path)
    name = "plan.npz"
    assert (tmp_path / name).read_bytes() != (quickstart_run / name).read_bytes()
