from __future__ import annotations

from pathlib import Path

import pytest

from mrmg import storage
from mrmg.errors import RunFolderError, UsageError
from mrmg.runs.folder import NEEDS, OUTPUTS, RunFolder, Step, existing, stale_after


@pytest.fixture
def folder(tmp_path: Path) -> RunFolder:
    """A folder in which every step has been made."""
    made = RunFolder(tmp_path / "run")
    with made.opened_for_writing():
        for step in Step:
            made.begin(step, {"seed": 1})
            for name in OUTPUTS[step]:
                storage.write_text(made.file(name), "{}")
            made.finish(step, f"mark of {step}")
    return made


def test_a_step_is_done_only_under_its_own_fingerprint(folder: RunFolder) -> None:
    for step in Step:
        assert folder.is_done(step, f"mark of {step}")
        assert not folder.is_done(step, "another mark")


@pytest.mark.parametrize("step", list(Step))
def test_a_step_is_not_done_without_its_last_file(
    folder: RunFolder, step: Step
) -> None:
    folder.file(OUTPUTS[step][-1]).unlink()
    assert not folder.is_done(step, f"mark of {step}")


@pytest.mark.parametrize("step", list(Step))
def test_beginning_a_step_removes_what_came_of_it_and_nothing_else(
    folder: RunFolder, step: Step
) -> None:
    folder.begin(step, {"seed": 2})
    gone = stale_after(step)
    for other in Step:
        present = [folder.file(name).exists() for name in OUTPUTS[other]]
        assert set(present) == {other not in gone}
        assert (other in folder.marks()) == (other not in gone)
    assert folder.arguments() == {"seed": 2}


def test_steps_come_after_what_they_need() -> None:
    order = list(Step)
    for step, needs in NEEDS.items():
        assert all(order.index(need) < order.index(step) for need in needs)
    assert stale_after(Step.PLAN) == order
    assert stale_after(Step.RENDER) == [Step.RENDER]
    assert Step.EXECUTE not in stale_after(Step.VERIFY)


def test_a_folder_with_other_files_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    with (
        pytest.raises(UsageError, match=r"thesis\.tex.*--out"),
        RunFolder(tmp_path).opened_for_writing(),
    ):
        pass
    assert [item.name for item in tmp_path.iterdir()] == ["thesis.tex"]


def test_leftovers_of_a_killed_write_are_cleared(folder: RunFolder) -> None:
    leftover = folder.file(".part-abc-plan.json")
    leftover.write_text("half a pl")
    with folder.opened_for_writing():
        assert not leftover.exists()
    assert folder.file("plan.json").exists()


def test_two_processes_never_share_a_folder(folder: RunFolder) -> None:
    with (
        folder.opened_for_writing(),
        pytest.raises(RunFolderError, match="another mrmg process"),
        RunFolder(folder.path).opened_for_writing(),
    ):
        pass
    with folder.opened_for_writing():
        assert folder.marks()


def test_a_path_without_a_run_is_named(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match=r"not a run folder.*mrmg run"):
        existing(tmp_path / "nothing")


@pytest.mark.parametrize("content", ["[]", "{}", '{"format": 99}', "{half"])
def test_a_damaged_record_is_named(folder: RunFolder, content: str) -> None:
    folder.file("run.json").write_text(content)
    with pytest.raises(RunFolderError, match=r"run\.json"):
        folder.marks()
