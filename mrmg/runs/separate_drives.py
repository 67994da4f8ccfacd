"""Drives of a run's plan other than its own, each in a run folder of its own."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from mrmg import storage
from mrmg.runs.arguments import RunArguments
from mrmg.runs.folder import RunFolder, Step
from mrmg.runs.replacing import require_room
from mrmg.runs.steps import Run, write_planning
from mrmg.scene.loading.carrying import carried_files

LONGEST_NAME = 60
"""Characters of a folder's name after which a digest stands for what it describes."""


def folder_beside(run: Run, arguments: RunArguments) -> Path:
    """Return the folder, beside that of `run`, for a drive with other arguments.

    Its name describes the drive: `RUN-disturbed-s4`, `RUN-tvlqr-fault-r2-40s-replan`.
    """
    path = run.folder.path
    if path.name in ("", ".."):
        path = path.resolve()
    words = list(_description(run.arguments, arguments)) or ["again"]
    plain = re.sub(r"[=%]", "", "-".join(words))
    name = re.sub(r"[^\w.+]+", "-", plain).strip("-")
    if len(name) > LONGEST_NAME:
        name = f"drive-{storage.digest(name)}"
    return path.parent / f"{path.name}-{name}"


def _description(own: RunArguments, other: RunArguments) -> Iterator[str]:
    if other.controller != own.controller:
        yield other.controller
    if other.plant != own.plant:
        yield f"on-{other.plant}"
    if other.disturb is not None:
        yield f"disturbed-{other.disturb}-s{other.disturb_seed}"
    elif own.disturb is not None:
        yield "undisturbed"
    yield from (f"fault-{fault}" for fault in other.faults)
    if other.replan:
        yield "replan"
    elif own.replan:
        yield "no-replan"


def drive_apart(
    run: Run, folder: RunFolder, arguments: RunArguments, *, overwrite: bool
) -> tuple[Run, bool]:
    """Drive the plan of `run` in a folder of its own; verify, audit and report there.

    Args:
        run: has the plan.
        folder: for the drive.
        arguments: how to drive.
        overwrite: replace results that the folder holds.

    Returns:
        The run in `folder`, and whether the drive was made now: one that is there is
        kept unless `overwrite`.

    Raises:
        UsageError: if it holds others and they are not to be replaced.
    """
    other = replace(run, folder=folder, arguments=arguments)
    plan = run.plan()
    if not overwrite:
        require_room(other, plan=plan)
    if not other.is_done(Step.PLAN) or other.plan().digest != plan.digest:
        files = carried_files(run.scene)
        folder.begin(Step.PLAN, arguments.to_json())
        write_planning(folder, files, plan, run.planning())
        folder.finish(Step.PLAN, other.fingerprint(Step.PLAN))
    driven = drive_again(other, overwrite=overwrite)
    for step in (Step.VERIFY, Step.AUDIT, Step.DRAW):
        other.ensure(step)
    other.make(Step.REPORT)
    return other, driven


def drive_again(run: Run, *, overwrite: bool) -> bool:
    """Drive in the folder of `run`, unless the same drive is there.

    Returns:
        Whether the drive was made now.

    Raises:
        UsageError: if results of another drive are not to be replaced.
    """
    if not overwrite:
        if run.is_readable(Step.EXECUTE):
            return False
        require_room(run, Step.EXECUTE)
    run.make(Step.EXECUTE)
    return True
