"""No verb takes a plan or a log of another scene."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import mrmg
from mrmg.cli.main import main
from mrmg.errors import (
    ExitCode,
    IdentityError,
    RunFolderError,
    SceneError,
    UsageError,
)
from mrmg.plans import Plan
from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz.energy_plot import draw_energy
from mrmg.viz.gif import render_gif
from mrmg.viz.overview import draw_overview
from mrmg.viz.replay import Replay
from mrmg.viz.timeline_plot import draw_timeline

Mission = tuple[Scene, Plan, ExecutionLog]


@pytest.fixture(scope="module")
def mission(quickstart_run: Path) -> Mission:
    scene = load_scene(quickstart_run / "scene.yaml")
    return scene, Plan.load(quickstart_run), ExecutionLog.load(quickstart_run)


VERBS: dict[str, Callable[..., Any]] = {
    "execute": lambda scene, plan, log, path: mrmg.execute(scene, plan),
    "drive": lambda scene, plan, log, path: mrmg.drive(scene, plan),
    "audit": lambda scene, plan, log, path: mrmg.audit(scene, plan, log),
    "render": lambda scene, plan, log, path: mrmg.render(scene, plan, log, path),
    "gif": lambda scene, plan, log, path: render_gif(scene, plan, log, path),
    "overview": lambda scene, plan, log, path: draw_overview(scene, plan, path=path),
    "energy": lambda scene, plan, log, path: draw_energy(scene, plan, log, path=path),
    "timeline": lambda scene, plan, log, path: draw_timeline(scene, plan, path=path),
    "replay": lambda scene, plan, log, path: Replay(scene, plan, log),
}


@pytest.mark.parametrize("verb", VERBS)
def test_a_changed_scene_is_refused(
    mission: Mission, verb: str, tmp_path: Path
) -> None:
    scene, plan, log = mission
    battery = replace(scene.robots[0].battery, capacity_J=1e6, start_J=1e6)
    robots = (replace(scene.robots[0], battery=battery), *scene.robots[1:])
    out = tmp_path / "out.png"
    with pytest.raises(IdentityError, match=r"plan of another scene.*plan this scene"):
        VERBS[verb](replace(scene, robots=robots), plan, log, out)
    assert not out.exists()


def test_the_refusal_is_caught_as_what_it_always_was(mission: Mission) -> None:
    scene, plan, _ = mission
    for kind in (UsageError, RunFolderError):
        with pytest.raises(kind):
            mrmg.execute(replace(scene, name="other"), plan)


def test_the_verifier_finds_a_plan_of_another_scene(mission: Mission) -> None:
    scene, plan, _ = mission
    assert mrmg.verify(scene, plan).ok
    assert not mrmg.verify(scene.with_(name="other"), plan).ok


@pytest.mark.parametrize("verb", ["audit", "render"])
def test_a_log_of_another_plan_is_refused(
    mission: Mission, verb: str, tmp_path: Path
) -> None:
    scene, plan, log = mission
    with pytest.raises(IdentityError, match="log of another plan"):
        VERBS[verb](
            scene, plan, replace(log, plan_digest="other"), tmp_path / "out.mp4"
        )


@pytest.mark.parametrize(
    "words", ["execute", "audit", "report", "render", "figure --kind map -o f.pdf"]
)
def test_verbs_refuse_an_edited_run_folder(
    quickstart_run: Path,
    tmp_path: Path,
    words: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import shutil

    folder = Path(shutil.copytree(quickstart_run, tmp_path / "run"))
    monkeypatch.chdir(tmp_path)
    scene = folder / "scene.yaml"
    scene.write_text(scene.read_text() + "time_limit: 500\n")
    before = {path: path.read_bytes() for path in folder.iterdir()}
    verb, *rest = words.split()
    assert main([verb, str(folder), *rest]) in (ExitCode.INVALID_FILE, ExitCode.USAGE)
    error = capsys.readouterr().err
    assert "another scene" in error or "before it was changed" in error
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_a_run_stores_the_scene_that_was_changed(tmp_path: Path) -> None:
    """The old scene is never stored, neither is a mission of it called done."""
    scene = load_scene(Path(__file__).parents[1] / "scenes" / "one_goal.yaml")
    late = replace(scene, time_limit_s=1.0)
    result = mrmg.run(late, out=tmp_path / "run", video=None)
    assert load_scene(tmp_path / "run" / "scene.yaml") == late
    assert not result.summary["mission_ok"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mjcf": Path("other.xml")}, "made in memory; give it a folder"),
        ({"mass_kg": 300.0}, "with another mass: mass"),
    ],
)
def test_a_robot_no_file_can_state_is_refused_before_any_folder(
    change: dict[str, Any], message: str, tmp_path: Path
) -> None:
    scene = load_scene("quickstart")
    first, second = scene.robots
    other = replace(first, model=replace(first.model, **change))
    with pytest.raises(SceneError, match=message):
        mrmg.run(replace(scene, robots=(other, second)), out=tmp_path / "r", video=None)
    assert not (tmp_path / "r").exists()


def test_a_robot_changed_in_memory_is_stored_as_it_was_driven(tmp_path: Path) -> None:
    scene = load_scene(Path(__file__).parents[1] / "scenes" / "one_goal.yaml")
    (robot,) = scene.robots
    model = replace(robot.model, drive_efficiency=0.7, regeneration_efficiency=0.2)
    changed = replace(scene, robots=(replace(robot, model=model),))
    result = mrmg.run(changed, out=tmp_path / "run", video=None)
    assert result.summary["mission_ok"]
    stored = load_scene(tmp_path / "run" / "scene.yaml")
    assert stored == changed
    assert stored.robots[0].model.drive_efficiency == 0.7


def test_refusals_come_through_from_worker_processes(mission: Mission) -> None:
    scene, plan, _ = mission
    with pytest.raises(IdentityError) as refused:
        mrmg.execute(replace(scene, name="other"), plan)
    again = pickle.loads(pickle.dumps(refused.value))  # noqa: S301 (its own bytes)
    assert type(again) is IdentityError
    assert (str(again), again.faults) == (str(refused.value), refused.value.faults)
