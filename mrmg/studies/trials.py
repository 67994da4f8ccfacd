"""Trials of a study, each in a file of its own: the files are what is true.

A trial that lies in its file is not made again, whoever made it and however the command
ended that had it made. Files are put in their place by renaming.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrmg import storage
from mrmg.studies.engine import Call, Engine

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
    call: Call,
    engine: Engine,
    *,
    check: Callable[[Job, Any], object],
    keep: Callable[[Job, Any], Any] = lambda job, made: made,
) -> Iterator[tuple[int, Any, float | None]]:
    """Yield all trials: those of earlier commands, then others as they are made.

    Args:
        jobs: all trials.
        call: makes a trial of `shared` and `item` of its job.
        engine: who calls.
        check: raises one of `storage.UNREADABLE` where the content of a trial's
            file is not good, and the trial is to be made anew.
        keep: returns the content of the file from what `call` returned, as JSON data.

    Yields:
        place in `jobs`, content of its file, and an estimate of the time that the
        trials still missing take [s]; None before any was made.
    """
    missing = []
    for number, job in enumerate(jobs):
        try:
            content = storage.read_json(job.path)
            check(job, content)
        except storage.UNREADABLE:
            missing.append(number)
        else:
            yield number, content, None
    wanted = [(jobs[number].shared, jobs[number].item) for number in missing]
    began = time.monotonic()
    for count, (place, made) in enumerate(engine.results(call, wanted), start=1):
        job = jobs[missing[place]]
        content = keep(job, made)
        storage.write_json(job.path, content)
        each_s = (time.monotonic() - began) / count
        yield missing[place], content, each_s * (len(missing) - count)
