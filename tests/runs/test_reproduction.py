"""Failed executions fail again from their capsules, to the last bit."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrmg.errors import FileError, UsageError
from mrmg.runs import pipeline
from mrmg.runs.capsule import CAPSULE_FILE, Capsule, Failure
from mrmg.runs.folder import RunFolder, Step
from mrmg.runs.reproduction import Reproduction, reproduce
from mrmg.runs.steps import taken_up
from mrmg.simulation.log import ExecutionLog

SCENE = Path(__file__).parents[1] / "scenes" / "one_goal.yaml"


@pytest.fixture(scope="module")
def failed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose battery was much smaller than planned for."""
    folder = tmp_path_factory.mktemp("failed") / "run"
    result = pipeline.run(
        SCENE, out=folder, video=None, disturb="capacity=-90%", disturb_seed=3
    )
    assert result.summary["mission_ok"] is False
    return folder


def test_a_failed_run_leaves_a_capsule(failed: Path) -> None:
    capsule = Capsule.load(failed / CAPSULE_FILE)
    log = ExecutionLog.load(failed)
    assert capsule.failure.causes == ("battery empty",)
    assert "ran empty" in capsule.failure.reasons[0]
    assert capsule.arguments["disturb"] == "capacity=-90%"
    assert capsule.failure.versions == log.versions
    np.testing.assert_array_equal(
        capsule.failure.last["state"], log.state[:, -capsule_ticks(capsule) :]
    )


@pytest.mark.parametrize("change", [{"controller": "nobody"}, {"faults": ["r1"]}])
def test_a_capsule_that_nothing_can_be_driven_from_leaves_no_folder(
    failed: Path, tmp_path: Path, change: dict[str, object]
) -> None:
    capsule = Capsule.load(failed / CAPSULE_FILE)
    altered = replace(capsule, arguments={**capsule.arguments, **change})
    altered.save(tmp_path / CAPSULE_FILE)
    with pytest.raises(FileError, match="capsule.json: .*(allowed|expected)"):
        reproduce(tmp_path / CAPSULE_FILE, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def capsule_ticks(capsule: Capsule) -> int:
    return len(capsule.failure.last["time_s"])


def test_a_good_run_leaves_none_and_removes_one(failed: Path, tmp_path: Path) -> None:
    capsule = Capsule.load(failed / CAPSULE_FILE)
    folder = RunFolder(tmp_path / "run")
    with folder.opened_for_writing():
        folder.begin(Step.PLAN, {})
        capsule.unpack(folder.path)
        run = taken_up(folder)
        capsule.save(folder.file(CAPSULE_FILE))
        run.make(Step.EXECUTE)
    assert not folder.file(CAPSULE_FILE).exists()


def test_it_fails_again_bit_for_bit(failed: Path, tmp_path: Path) -> None:
    outcome = reproduce(failed / CAPSULE_FILE, tmp_path / "replay")
    assert outcome.same_causes
    assert outcome.same_bits
    assert outcome.drift_m == 0.0
    assert outcome.changed_versions == {}
    assert outcome.verdict() == "fails in the same way, bit for bit"
    for name in ("log.npz", "log.json", "audit.json", CAPSULE_FILE):
        repeated = (tmp_path / "replay" / name).read_bytes()
        assert repeated == (failed / name).read_bytes(), name


def test_another_failure_is_told_apart(failed: Path, tmp_path: Path) -> None:
    capsule = Capsule.load(failed / CAPSULE_FILE)
    other = replace(capsule, failure=replace(capsule.failure, causes=("contact",)))
    other.save(tmp_path / "capsule.zip")
    outcome = reproduce(tmp_path / "capsule.zip", tmp_path / "replay")
    assert not outcome.same_causes
    assert outcome.verdict() == "fails in another way"


def test_what_does_not_fail_any_more_is_told(failed: Path, tmp_path: Path) -> None:
    capsule = Capsule.load(failed / CAPSULE_FILE)
    mended = replace(capsule, arguments={**capsule.arguments, "disturb": None})
    mended.save(tmp_path / "capsule.zip")
    outcome = reproduce(tmp_path / "capsule.zip", tmp_path / "replay")
    assert outcome.after is None
    assert outcome.verdict() == "does not fail any more"
    assert outcome.to_json()["after"] is None


def test_drift_and_versions_are_told(failed: Path) -> None:
    before = Capsule.load(failed / CAPSULE_FILE).failure
    last = {name: values.copy() for name, values in before.last.items()}
    last["state"][0, -1, 1] += 0.25
    after = replace(
        before,
        log_digest="other",
        last=last,
        versions={**before.versions, "mujoco": "9.9", "new": "1"},
    )
    outcome = Reproduction(before=before, after=after)
    assert outcome.same_causes
    assert not outcome.same_bits
    assert outcome.drift_m == pytest.approx(0.25)
    assert outcome.changed_versions == {
        "mujoco": (before.versions["mujoco"], "9.9"),
        "new": ("none", "1"),
    }
    assert "but not bit for bit, ending 0.25 m apart" in outcome.verdict()
    shorter = replace(after, last={"state": last["state"][:, 1:]})
    assert Reproduction(before=before, after=shorter).drift_m is None


def test_two_crashes_are_never_the_same_bits() -> None:
    crash = Failure.of_crash(ValueError("no"))
    outcome = Reproduction(before=crash, after=crash)
    assert outcome.same_causes
    assert not outcome.same_bits
    assert outcome.verdict() == "fails in the same way"


def test_a_crash_leaves_a_capsule_that_crashes_again(
    failed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A controller with a bug breaks the program down in the middle of a run."""
    from mrmg.simulation.mpc import TrackingMpc

    def broken(*_: object) -> np.ndarray:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(TrackingMpc, "correct", broken)
    folder = tmp_path / "run"
    with pytest.raises(ZeroDivisionError) as crash:
        pipeline.run(SCENE, out=folder, video=None)
    assert any(CAPSULE_FILE in note for note in crash.value.__notes__)
    outcome = reproduce(folder / CAPSULE_FILE, tmp_path / "replay")
    assert outcome.same_causes
    assert outcome.before.reasons == ("ZeroDivisionError: division by zero",)


def test_arguments_of_a_later_version_are_refused(failed: Path, tmp_path: Path) -> None:
    capsule = Capsule.load(failed / CAPSULE_FILE)
    later = replace(capsule, arguments={**capsule.arguments, "gravity": 1.6})
    later.save(tmp_path / "capsule.zip")
    with pytest.raises(FileError, match="gravity"):
        reproduce(tmp_path / "capsule.zip", tmp_path / "replay")
    assert not (tmp_path / "replay").exists()


@pytest.mark.parametrize("member", ["scene.yaml", "plan.json", "plan.npz"])
def test_spoilt_members_are_named(member: str, failed: Path, tmp_path: Path) -> None:
    path = tmp_path / "capsule.zip"
    with zipfile.ZipFile(failed / CAPSULE_FILE) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members[member] = b"nonsense: ["
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    with pytest.raises(FileError):
        reproduce(path, tmp_path / "replay")


def test_a_folder_of_other_things_is_not_overwritten(
    failed: Path, tmp_path: Path
) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(UsageError, match="not a run folder"):
        reproduce(failed / CAPSULE_FILE, tmp_path)


def test_a_state_that_is_no_number_ends_in_a_readable_run(
    failed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Physics that break down are told as such, by every judge, and kept."""
    from mrmg.simulation.fleet import Fleet

    exact = Fleet.state
    calls = iter(range(10**9))

    def breaking(self: Fleet) -> np.ndarray:
        state = exact(self)
        return state * np.nan if next(calls) > 200 else state

    monkeypatch.setattr(Fleet, "state", breaking)
    folder = tmp_path / "run"
    result = pipeline.run(SCENE, out=folder, video=None)
    assert result.summary["mission_ok"] is False
    assert result.summary["execution"]["gave_up"] == "diverged"
    log = ExecutionLog.load(folder)
    assert np.isfinite(log.state).all()
    assert log.time_s[-1] == pytest.approx(4.0, abs=0.05)  # some 200 ticks
    assert len(log.time_s) == log.force_N.shape[1] + 1
    capsule = Capsule.load(folder / CAPSULE_FILE)
    assert capsule.failure.causes == ("diverged", "goal missed")
    assert json.loads((folder / "audit.json").read_text())["causes"] == [
        "diverged",
        "goal missed",
    ]
    assert (folder / "report.html").exists()
