"""Finished results are replaced only when that was asked for.

A folder may hold results of another scene, of other arguments, or of another version.
What takes long to make again is the plan, the drive, the video and trials of the plan.
"""

from __future__ import annotations

from pathlib import Path

from mrmg.errors import FileError, UsageError
from mrmg.plans import Plan, PlanStatus
from mrmg.runs.arguments import RunArguments, recorded
from mrmg.runs.folder import Step, stale_after
from mrmg.runs.options import options_of
from mrmg.runs.steps import Run

_COSTLY = {Step.PLAN: "plan", Step.EXECUTE: "drive", Step.RENDER: "video"}


def require_room(
    run: Run, first: Step = Step.PLAN, *, plan: Plan | None = None
) -> None:
    """Refuse to replace finished results that came of something else.

    Args:
        run: about to be made in its folder.
        first: step that is to be made first.
        plan: to be put there; None where it is to be planned.

    Raises:
        UsageError: naming what would be lost, why it is not kept, and the remedies.
    """
    lost = would_be_lost(run, first, plan)
    if lost:
        raise UsageError(
            f"{run.folder.path} holds results that this would replace: "
            f"{', '.join(lost)}. {_why(run)}. --overwrite (in Python: overwrite=True) "
            "replaces them; another --out DIR keeps them"
        )


def would_be_lost(run: Run, first: Step, plan: Plan | None) -> list[str]:
    """Return the names of costly results that making `first` anew would remove."""
    folder = run.folder
    if not folder.holds(Step.PLAN) or run.status() is not PlanStatus.SOLVED:
        return []
    other_plan = plan is not None and run.plan().digest != plan.digest
    stale = [
        step
        for step in stale_after(first)
        if folder.holds(step) and (other_plan or not run.is_done(step))
    ]
    if not {Step.PLAN, Step.EXECUTE} & {*stale}:
        return []  # a video alone is replaced only by one that was asked for
    lost = [name for step, name in _COSTLY.items() if step in stale]
    if Step.PLAN in stale:
        from mrmg.studies.outcomes import ROBUSTNESS_FILE

        if folder.file(ROBUSTNESS_FILE).exists():
            lost.append("trials under disturbances")
    return lost


def _why(run: Run) -> str:
    """Return in one sentence how the results differ from those of `run`."""
    differences = [*_scene_difference(run), *_argument_differences(run)]
    if not differences:
        return "They were made by another version of mrmg or of a robot model"
    return f"They were made with {', '.join(differences)}"


def _scene_difference(run: Run) -> list[str]:
    try:
        there = run.plan()
    except FileError:
        return ["a plan that cannot be read"]
    if there.scene_digest == run.scene.digest:
        return []
    if there.scene_name == run.scene.name:
        return [f"scene '{there.scene_name}' before it was changed (or mrmg was)"]
    return [f"scene '{there.scene_name}' (now '{run.scene.name}')"]


def _argument_differences(run: Run) -> list[str]:
    there = recorded(run.folder)
    return [
        f"{option.flag} {_shown(before)} (now {_shown(now)})"
        for option in options_of(RunArguments)
        if option.decides
        for before in [getattr(there, option.name)]
        for now in [getattr(run.arguments, option.name)]
        if before != now
    ]


def require_absent(path: Path, *, overwrite: bool) -> None:
    """Refuse to write over a file, or into a folder that is not empty.

    Raises:
        UsageError: if there is one and it is not to be replaced.
    """
    there = any(path.iterdir()) if path.is_dir() else path.exists()
    if there and not overwrite:
        raise UsageError(
            f"{path} exists; --overwrite replaces it, another name for -o keeps it"
        )


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        value = " ".join(value)
    return "not given" if value in (None, "") else str(value)
