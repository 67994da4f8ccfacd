"""`mrmg scene check` refuses what `mrmg run` refuses, before anything is planned."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

from mrmg import shipped
from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS
from mrmg.scene.robot_model import MAX_CORNERS

SLIDER = (Path(__file__).parents[2] / "tools" / "first_order.py").read_text()
SCENE = {
    "format": 1,
    "bounds": [0, 0, 30, 20],
    "goals": [{"id": "g1", "circle": {"center": [20, 10], "radius": 2}}],
    "robots": [{"id": "r1", "model": "car", "pose": [5, 10, 0]}],
}


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def written(folder: Path, **changes: Any) -> str:
    path = folder / "scene.yaml"
    path.write_text(yaml.safe_dump({**SCENE, **changes}))
    return str(path)


def with_model(folder: Path, **changes: Any) -> str:
    """Write a scene with a car of its own, some values of its robot.yaml changed."""
    model = folder / "mine"
    shutil.copytree(shipped.models_folder() / "car", model)
    raw = yaml.safe_load((model / "robot.yaml").read_text()) | changes
    raw = {key: value for key, value in raw.items() if value is not None}
    (model / "robot.yaml").write_text(yaml.safe_dump(raw))
    (model / "motion.py").write_text(SLIDER)
    return written(folder, robots=[{"id": "r1", "model": "./mine", "pose": [5, 10, 0]}])


def no_robots(folder: Path) -> str:
    return written(folder, robots=[])


def tiny_obstacle(folder: Path) -> str:
    corners = [[10, 3], [10 + 1e-6, 3], [10, 3 + 1e-6]]
    return written(folder, obstacles=[{"polygon": corners}])


def missing_actuator(folder: Path) -> str:
    scene = with_model(folder)
    file = folder / "mine" / "car.xml"
    file.write_text(file.read_text().replace('motor name="drive"', 'motor name="d"'))
    return scene


def many_corners(folder: Path) -> str:
    from math import cos, pi, sin

    angles = [2 * pi * corner / 20 for corner in range(20)]
    ring = [[0.6 + 0.9 * cos(angle), 0.9 * sin(angle)] for angle in angles]
    return with_model(folder, footprint=ring, mjcf=None)


def broken_motion(folder: Path) -> str:
    scene = with_model(folder, motion_model="motion.py")
    file = folder / "mine" / "motion.py"
    file.write_text(SLIDER.replace("def steer(", "def stear("))
    return scene


def uncompilable_motion(folder: Path) -> str:
    scene = with_model(folder, motion_model="motion.py")
    file = folder / "mine" / "motion.py"
    file.write_text(SLIDER.replace("v, w = control", "v, w = open('/dev/null'), 0"))
    return scene


REFUSED = {
    no_robots: "robots: there are none",
    tiny_obstacle: "MuJoCo cannot build its world",
    missing_actuator: "car.xml has no actuator 'drive'",
    many_corners: "has 20 corners, at most 12",
    broken_motion: "steer: is not defined",
    uncompilable_motion: "cannot be compiled by numba",
}


@pytest.mark.parametrize("make", REFUSED, ids=lambda make: make.__name__)
def test_check_refuses_what_run_refuses(
    tmp_path: Path, make: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = make(tmp_path)
    words = ["scene", "check", scene, "--trust-code", "--json"]
    assert main(words) == ExitCode.INVALID_FILE
    captured = capsys.readouterr()
    assert REFUSED[make] in captured.err
    assert json.loads(captured.out)["faults"]
    words = ["run", scene, "--trust-code", "--no-video", "--out", "out"]
    assert main(words) in (ExitCode.INVALID_FILE, ExitCode.USAGE)
    assert capsys.readouterr().err


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"motion_model": "motion.py"}, "a motion of its own"),
        ({"mjcf": None}, "no MJCF"),
    ],
)
def test_what_is_only_planned_for_is_a_note(
    tmp_path: Path,
    changes: dict[str, Any],
    reason: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    scene = with_model(tmp_path, **changes)
    assert main(["scene", "check", scene, "--trust-code"]) == ExitCode.OK
    assert f"  note: r1: model 'mine' has {reason}" in capsys.readouterr().out
    assert main(["scene", "check", scene, "--trust-code", "--json"]) == ExitCode.OK
    found = json.loads(capsys.readouterr().out)
    assert found["faults"] == []
    assert reason in found["notes"][0]["message"]
    assert main(["run", scene, "--trust-code"]) == ExitCode.USAGE
    assert not (tmp_path / "runs").exists()


def test_the_planner_holds_the_corners_that_a_model_may_have() -> None:
    assert MAX_CORNERS == MOST_CORNERS
