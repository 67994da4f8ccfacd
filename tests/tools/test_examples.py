"""The examples work from any folder, and stay short."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "tools" / "examples").glob("*.py"))
LEAVES = {
    "battery_sweep": {"battery_sweep.png"},
    "first_scene": {"yard.yaml", "run"},
    "own_robot": {"slow_car"},
    "read_log": {"run", "r1.csv", "r2.csv"},
}
SAYS = {
    "battery_sweep": "120 m: ",
    "first_scene": "status: solved, exit code 0",
    "own_robot": "mission done",
    "read_log": "psi_rad, u1_m_s2",
}


def test_every_example_is_tried_here() -> None:
    assert {path.stem for path in EXAMPLES} == set(LEAVES)


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_works_from_anywhere(path: Path, tmp_path: Path) -> None:
    assert len(path.read_text().splitlines()) <= 60
    ended = subprocess.run(
        [sys.executable, str(path), "made"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert SAYS[path.stem] in ended.stdout
    assert {item.name for item in (tmp_path / "made").iterdir()} == LEAVES[path.stem]
    assert [item.name for item in tmp_path.iterdir()] == ["made"]
