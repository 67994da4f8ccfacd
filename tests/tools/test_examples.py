"""The examples work from any folder, and stay short."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from examples.own_planner import one_at_a_time
from examples.own_router import nearest_goal

from mrmg.planning import Planner, Router
from mrmg.scene.types import Scene
from mrmg.testing import PlannerContract, RouterContract, sample_scene

EXAMPLES = sorted((Path(__file__).parents[2] / "tools" / "examples").glob("*.py"))
LEAVES = {
    "battery_sweep": {"battery_sweep.png"},
    "first_scene": {"yard.yaml", "run"},
    "own_motion": {"glider", "plan.json", "plan.npz"},
    "own_planner": {"plan.json", "plan.npz"},
    "own_robot": {"slow_car"},
    "own_router": {"search", "__main__.nearest_goal"},
    "read_log": {"run", "r1.csv", "r2.csv"},
}
SAYS = {
    "battery_sweep": "120 m: ",
    "first_scene": "status: solved, exit code 0",
    "own_motion": "verified: True",
    "own_planner": "planned by __main__:one_at_a_time",
    "own_robot": "mission done",
    "own_router": "__main__:nearest_goal: ",
    "read_log": "psi_rad, u1_m_s2",
}


class TestOwnRouter(RouterContract):
    """Its greedy tours are often too long for the limits of the sample problems."""

    solved_at_least = 0.25

    def router(self) -> Router:
        return nearest_goal


class TestOwnPlanner(PlannerContract):
    """It knows only robots that turn on the spot, and waits for nobody."""

    def planner(self) -> Planner:
        return one_at_a_time

    def scenes(self) -> dict[str, Scene]:
        robots = [
            {"id": f"r{y}", "model": "diffdrive", "pose": [4, y, 0]} for y in (5, 15)
        ]
        return {"open ground": sample_scene(robots=robots)}

    def hopeless(self) -> Scene:
        (scene,) = self.scenes().values()
        return scene.with_(battery={"capacity_m": 6})


def test_every_example_is_tried_here() -> None:
    assert {path.stem for path in EXAMPLES} == set(LEAVES)


def check_what_it_made(name: str, folder: Path, said: str) -> None:
    assert SAYS[name] in said
    assert {item.name for item in (folder / "made").iterdir()} == LEAVES[name]
    assert [item.name for item in folder.iterdir()] == ["made"]


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_works_from_anywhere(
    path: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """As a script, with a folder of its own to find modules in."""
    assert len(path.read_text().splitlines()) <= 60
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(path), "made"])
    monkeypatch.setattr(sys, "path", [str(path.parent), *sys.path])
    runpy.run_path(str(path), run_name="__main__")
    said, complained = capsys.readouterr()
    assert complained == ""
    check_what_it_made(path.stem, tmp_path, said)


@pytest.mark.slow
def test_an_example_is_a_program(tmp_path: Path) -> None:
    (path,) = (path for path in EXAMPLES if path.stem == "own_planner")
    ended = subprocess.run(
        [sys.executable, str(path), "made"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    check_what_it_made(path.stem, tmp_path, ended.stdout)
