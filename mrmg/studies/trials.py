"""Trials of a study, each in a file of its own: the files are what is true.

A trial that lies in its file is not made again, whoever made it and however the command
ended that had it made. Files are put in their place by renaming.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrmg import storage
from mrmg.studies.engine import Engine

OnTrial = Callable[[int, int, int], None]
"""Called with (trials done, trials in all, feasible ones) after each trial."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """A trial to be made.

    Attributes:
        path: its file.
        shared: first argument of the call that makes it; other trials may share it.
        item: second argument.
    """

    path: Path
    shared: Any
    item: Any


def completed_trials(
    jobs: Sequence[Job],
    call: Callable[[Any, Any], Any],
    engine: Engine,
    *,
    check: Callable[[Job, Any], object],
    keep: Callable[[Job, Any], Any] = lambda job, made: made,
) -> Iterator[tuple[int, Any]]:
    """Yield all trials by their place: those of earlier commands, then others as made.

    Args:
        jobs: all trials.
        call: makes a trial of `shared` and `item` of its job.
        engine: who calls.
        check: raises one of `storage.UNREADABLE` where the content of a trial's
            file is not good, and the trial is to be made anew.
        keep: returns the content of the file from what `call` returned, as JSON data.
    """
    missing = []
    for number, job in enumerate(jobs):
        try:
            content = storage.read_json(job.path)
            check(job, content)
        except storage.UNREADABLE:
            missing.append(number)
        else:
            yield number, content
    wanted = [(jobs[number].shared, jobs[number].item) for number in missing]
    for place, made in engine.results(call, wanted):
        job = jobs[missing[place]]
        content = keep(job, made)
        storage.write_json(job.path, content)
        yield missing[place], content
