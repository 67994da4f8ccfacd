"""Commands killed at random moments, and folders that go wrong under them."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

from protocol import Row

from faults.conditions import CONDITIONS
from faults.rows import Options, row_of
from faults.tasks import (
    TASKS,
    Reference,
    Started,
    digests,
    fault_of_files,
)

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)

COLD_SHARE = 10
"""One of so many commands is started anew; others are forked from a warm process."""

PARALLEL = ("robustness", "campaign")
"""Commands that those have worker processes of."""

ENDS_WITHIN_S = 30.0
"""Time on a busy machine's clock until a stopped command has ended."""

REQUIRED = "nothing lost, nothing half-written; the next command finishes as if alone"


def rows(options: Options) -> Iterator[Row]:
    """Yield a row for the kills of each command, and one for each condition."""
    reference = Reference(options.work / "reference")
    failures: dict[str, list[Row]] = {name: [] for name in TASKS}
    counts = dict.fromkeys(TASKS, 0)
    names = [*TASKS]
    for number in range(options.kills):
        name = names[number % len(names)]
        found = options.trials.row(
            lambda name=name, number=number: {  # type: ignore[misc]
                "fault": _fault_of_kill(options, reference, name, number)
            },
            part="kills",
            number=number,
        )
        counts[name] += 1
        if found["fault"]:
            case = f"{name} {number}"
            failures[name].append({"case": case, "fault": found["fault"]})
    for name in TASKS:
        if counts[name]:
            yield row_of(f"kills: {name}", REQUIRED, counts[name], failures[name])
    if options.kills:
        yield from _conditions(options, reference)


def _fault_of_kill(
    options: Options, reference: Reference, name: str, number: int
) -> str:
    """Stop a command once or twice, let the next one finish; return what was wrong."""
    random = Random(f"{options.seed} kills {number}")
    place = options.work / "killed"
    reference.prepare(name, place)
    took_s = reference.took_s(name)
    for _ in range(random.choice((1, 1, 2))):
        sent = random.choice(SIGNALS)
        cold = random.randrange(COLD_SHARE) == 0
        workers = ("--workers", "2") if cold and name in PARALLEL else ()
        process = Started(place, (*TASKS[name].words, *workers), warm=not cold)
        process.wait(random.uniform(0.0, 1.1 * took_s + 3.0 * cold))
        process.send(sent)
        ended = process.finish(ENDS_WITHIN_S)
        codes = (0, 130, -sent) if sent is not signal.SIGKILL else (0, -sent)
        left = fault_of_files(place, unfinished=sent is not signal.SIGINT)
        if name == "calibrate" and "--overwrite" in ended.text:
            codes = (2,)  # it was through already
        fault = ended.fault(*codes) or left or _fault_of_children(process.group)
        if fault:
            return f"after {sent.name}: {fault}"
    return finished(reference, name, place)


def _fault_of_children(group: int) -> str:
    """Return whether processes outlived the command that started them."""
    end = time.monotonic() + ENDS_WITHIN_S
    while time.monotonic() < end:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return ""
        time.sleep(0.1)
    os.killpg(group, signal.SIGKILL)
    return "processes were left"


def finished(reference: Reference, name: str, place: Path) -> str:
    """Let a task finish; return what differs from the same one done alone, or ""."""
    ended = Started(place, TASKS[name].words, warm=True).finish()
    if name == "calibrate" and ended.code == 2 and "--overwrite" in ended.text:
        again = (*TASKS[name].words, "--overwrite")
        ended = Started(place, again, warm=True).finish()
    fault = ended.fault(0) or fault_of_files(place, unfinished=False)
    if fault:
        return f"the next command: {fault}"
    wanted, found = reference.left(name), digests(name, place)
    differing = [path for path in wanted if found.get(path) != wanted[path]]
    return f"{differing[0]} is not as of the command alone" if differing else ""


def _conditions(options: Options, reference: Reference) -> Iterator[Row]:
    for condition in CONDITIONS:
        failures, skipped = [], ""
        for name in condition.tasks:
            random = Random(f"{options.seed} {condition.name} {name}")
            place = options.work / "condition"
            found = options.trials.row(
                lambda condition=condition, name=name, random=random, place=place: {  # type: ignore[misc]
                    "fault": condition.fault(reference, name, place, random)
                },
                part="conditions",
                condition=condition.name,
                task=name,
            )
            if found["fault"].startswith("skipped"):
                skipped = found["fault"]
            elif found["fault"]:
                failures.append({"case": name, "fault": found["fault"]})
        cases = 0 if skipped else len(condition.tasks)
        required = skipped or condition.required
        yield row_of(f"kills: {condition.name}", required, cases, failures)
