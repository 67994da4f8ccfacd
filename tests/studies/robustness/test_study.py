"""Studies on a real, short mission: the same with any workers, and taken up again."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrmg import storage
from mrmg.energy.audit import audit
from mrmg.errors import UsageError
from mrmg.plans import PlanStatus
from mrmg.runs import pipeline
from mrmg.runs.drive import drive
from mrmg.runs.folder import RunFolder
from mrmg.runs.steps import Run, taken_up
from mrmg.studies.outcomes import Study, assess_trial
from mrmg.studies.robustness.study import study_robustness

SCENE = Path(__file__).parents[2] / "scenes" / "one_goal.yaml"

EARLIER = Path(__file__).parents[2] / "run_of_0.1.0"
"""A run, with a plan."""


@pytest.fixture(scope="session")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run folder with a plan of the smallest mission; only to be read."""
    folder = tmp_path_factory.mktemp("runs") / "one_goal"
    pipeline.run(SCENE, out=folder, video=None)
    return folder


@pytest.fixture
def run(planned: Path, tmp_path: Path) -> Run:
    return taken_up(RunFolder(Path(shutil.copytree(planned, tmp_path / "run"))))


@pytest.fixture(scope="session")
def three(planned: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, str]:
    """Three trials made one after the other, and their file."""
    folder = tmp_path_factory.mktemp("three") / "run"
    run = taken_up(RunFolder(Path(shutil.copytree(planned, folder))))
    study = study_robustness(run, trials=3, seed=5)
    return study, (folder / "robustness.json").read_text()


def test_trials_have_the_seeds_asked_for(three: tuple[Study, str]) -> None:
    study, _ = three
    assert [trial.seed for trial in study.trials] == [5, 6, 7]
    assert len({trial.charge_J for trial in study.trials}) == 3
    assert study.feasible == 3


def test_the_worst_case_is_repeated_by_its_seed(
    run: Run, three: tuple[Study, str]
) -> None:
    worst = three[0].worst
    arguments = replace(run.arguments, disturb="", disturb_seed=worst.seed)
    driven = drive(run.scene, run.plan(), arguments)
    account = audit(run.scene, driven.plan, driven.log)
    assert assess_trial(run.scene, driven.log, account) == worst


def test_a_worst_case_names_what_differs_from_the_run(tmp_path: Path) -> None:
    """`mrmg execute` takes controller and plant of the run where none is named."""
    folder = RunFolder(Path(shutil.copytree(EARLIER, tmp_path / "run")))
    record = storage.read_json(folder.file("run.json"))
    record["arguments"] |= {"controller": "pure_pursuit", "plant": "scrub"}
    storage.write_json(folder.file("run.json"), record)
    run = taken_up(folder)
    usual = replace(run.arguments, controller="mpc", plant="default")
    study = study_robustness(replace(run, arguments=usual), trials=1)
    assert study.options == {"disturb": "", "controller": "mpc", "plant": "default"}


def test_a_stopped_study_is_taken_up(run: Run, three: tuple[Study, str]) -> None:
    def stop(done: int, trials: int, feasible: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study_robustness(run, trials=3, seed=5, on_trial=stop)
    assert not run.folder.file("robustness.json").exists()
    kept = sorted(run.folder.file("trials").rglob("*.json"))
    assert [path.name for path in kept] == ["000005.json", "000006.json"]
    before = [path.stat().st_mtime_ns for path in kept]
    output: list[tuple[int, int, int]] = []
    study_robustness(run, trials=3, seed=5, on_trial=lambda *now: output.append(now))
    assert [path.stat().st_mtime_ns for path in kept] == before
    assert output == [(1, 3, 1), (2, 3, 2), (3, 3, 3)]
    assert run.folder.file("robustness.json").read_text() == three[1]


def test_a_damaged_trial_is_made_again(run: Run) -> None:
    study = study_robustness(run, trials=1)
    (path,) = run.folder.file("trials").rglob("*.json")
    for text in ("", '{"seed": 0}'):
        path.write_text(text)
        assert study_robustness(run, trials=1) == study
        assert storage.read_json(path)["seed"] == 0


def test_trials_of_another_plan_go(run: Run) -> None:
    stale = run.folder.file("trials") / "otherplan" / "mark"
    stale.mkdir(parents=True)
    study_robustness(run, trials=1)
    assert not stale.exists()


def test_a_new_plan_in_the_same_folder_is_driven(run: Run) -> None:
    first, plan = study_robustness(run, trials=1), run.plan()
    (motion,) = plan.trajectories
    state = np.concatenate([motion.state, np.tile(motion.state[-1], (20, 1))])
    control = np.concatenate([motion.control, np.zeros((20, 2))])
    longer = replace(motion, state=state, control=control)
    replace(plan, trajectories=(longer,)).save(run.folder.path)
    second = study_robustness(run, trials=1)
    driven = drive(run.scene, run.plan(), replace(run.arguments, disturb=""))
    assert second.trials[0].log_digest == driven.log.digest
    assert second.trials[0].log_digest != first.trials[0].log_digest


def test_disturbances_are_told_apart(run: Run) -> None:
    soft = study_robustness(run, trials=1)
    hard = study_robustness(run, trials=1, disturb="rolling=+30%")
    assert hard.trials[0].charge_J < soft.trials[0].charge_J
    assert hard.options == {"disturb": "rolling=+30%"}
    written = storage.read_json(run.folder.file("robustness.json"))["studies"]
    assert [study["options"]["disturb"] for study in written] == ["", "rolling=+30%"]


def test_a_run_without_a_plan_is_refused(walled_scene: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    result = pipeline.run(walled_scene, out=folder, video=None)
    assert result.summary["status"] == PlanStatus.INFEASIBLE.value
    with pytest.raises(UsageError, match="holds no plan"):
        study_robustness(taken_up(RunFolder(folder)), trials=1)


def test_a_wrong_disturbance_is_refused(run: Run) -> None:
    with pytest.raises(UsageError, match="'weight' is not known"):
        study_robustness(run, trials=1, disturb="weight=+5%")
