"""Disks, caches, clocks and neighbours that fail a command while it works."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random

from faults.tasks import (
    TASKS,
    Ended,
    Reference,
    Started,
    digests,
    fault_of_files,
)
from mrmg import storage

FULL_DISK_BYTES = (4096, 1_500_000)
"""Least and most room of a full disk: nothing fits, or nearly all."""

ALL = tuple(TASKS)


@dataclass(frozen=True, kw_only=True)
class Condition:
    """What goes wrong, for which commands, and what must hold.

    Attributes:
        name: of the condition.
        required: what must hold.
        tasks: commands that it is tried with.
        fault: lets it happen to a task in a folder; returns what was wrong, or "".
    """

    name: str
    required: str
    tasks: tuple[str, ...]
    fault: Callable[[Reference, str, Path, Random], str]


def _fault_of_finished(reference: Reference, name: str, place: Path) -> str:
    from faults.kills import finished

    return finished(reference, name, place)


def _two_at_once(reference: Reference, name: str, place: Path, random: Random) -> str:
    reference.prepare(name, place)
    first = Started(place, TASKS[name].words, warm=True)
    time.sleep(random.uniform(0.0, 0.6 * reference.took_s(name)))
    second = Started(place, TASKS[name].words, warm=True)
    ended = [process.finish() for process in (first, second)]
    faults = [each.fault(0, 2, 3) for each in ended]
    if not any(each.code == 0 for each in ended):
        return f"neither finished: {[each.text[-200:] for each in ended]}"
    fault = next(filter(None, faults), "") or fault_of_files(place, unfinished=False)
    return fault or _fault_of_finished(reference, name, place)


class MountError(Exception):
    """This machine does not let this user mount anything."""


@contextmanager
def _mounted(place: Path, *words: str) -> Iterator[None]:
    """Mount something on a folder for the block."""
    place.mkdir(parents=True, exist_ok=True)
    made = subprocess.run(["mount", *words, place], capture_output=True, text=True)
    if made.returncode:
        raise MountError(f"skipped: mounts are not permitted ({made.stderr.strip()})")
    try:
        yield
    finally:
        subprocess.run(["umount", place], check=True)


def _full_disk(reference: Reference, name: str, place: Path, random: Random) -> str:
    ready = place.with_name("ready")
    reference.prepare(name, ready)
    held = sum(path.stat().st_size for path in ready.rglob("*") if path.is_file())
    room = random.randrange(*FULL_DISK_BYTES)
    size = f"size={(held + room) // 1024 + 64}k"
    try:
        shutil.rmtree(place, ignore_errors=True)
        with _mounted(place, "-t", "tmpfs", "-o", size, "tmpfs"):
            shutil.copytree(ready, place, dirs_exist_ok=True)
            before = digests(TASKS[name].needs or name, place)
            ended = Started(place, TASKS[name].words, warm=True).finish()
            fault = ended.fault(0, 7) or fault_of_files(place, unfinished=False)
            if ended.code == 7 and "space" not in ended.text:
                fault = fault or f"does not say why: {ended.text}"
            after = digests(TASKS[name].needs or name, place)
            lost = [path for path in before if path not in after]
            if fault or lost:
                return fault or f"lost {lost[0]}"
            subprocess.run(["mount", "-o", "remount,size=64m", place], check=True)
            return _fault_of_finished(reference, name, place)
    except MountError as error:
        return str(error)


def _read_only(reference: Reference, name: str, place: Path, random: Random) -> str:
    reference.prepare(name, place)
    before = sorted(place.rglob("*"))
    try:
        with _mounted(place, "--bind", str(place)):
            subprocess.run(["mount", "-o", "remount,bind,ro", place], check=True)
            ended = Started(place, TASKS[name].words, warm=True).finish()
            fault = ended.fault(7)
            if not fault and "Read-only" not in ended.text:
                fault = f"does not say why: {ended.text}"
    except MountError as error:
        return str(error)
    if fault or sorted(place.rglob("*")) != before:
        return fault or "changed a folder that cannot be written"
    return _fault_of_finished(reference, name, place)


def _cut_off_cache(reference: Reference, name: str, place: Path, random: Random) -> str:
    """Cut some files of the cache off, of both kinds, while the command works."""
    return _with_cache(reference, name, place, random, share=0.05)


def _no_cache(reference: Reference, name: str, place: Path, random: Random) -> str:
    return _with_cache(reference, name, place, random, share=1.0)


def _with_cache(
    reference: Reference, name: str, place: Path, random: Random, share: float
) -> str:
    reference.prepare(name, place)
    reference.left(name)
    cache = place.with_name("cache")
    shutil.rmtree(cache, ignore_errors=True)
    shutil.copytree(storage.user_cache_folder(), cache / "mrmg")
    env = {"XDG_CACHE_HOME": str(cache)}
    files = sorted(path for path in cache.rglob("*") if path.is_file())
    if share == 1.0:
        process = Started(place, TASKS[name].words, env)
        time.sleep(random.uniform(0.0, 0.5 * reference.took_s(name)))
        shutil.rmtree(cache, ignore_errors=True)
    else:
        for path in random.sample(files, max(2, int(share * len(files)))):
            os.truncate(path, random.randrange(path.stat().st_size + 1))
        library = random.choice([path for path in files if path.suffix == ".so"])
        os.truncate(library, library.stat().st_size // 2)
        process = Started(place, TASKS[name].words, env)
    fault = process.finish().fault(0) or fault_of_files(place, unfinished=False)
    return fault or _differences(reference, name, place)


def _differences(reference: Reference, name: str, place: Path) -> str:
    wanted, found = reference.left(name), digests(name, place)
    differing = [path for path in wanted if found.get(path) != wanted[path]]
    return f"{differing[0]} is not as of the command alone" if differing else ""


CLOCK = """
import time
for name, unit in (("time", 1), ("time_ns", 10**9)):
    def back(read=getattr(time, name), unit=unit, began=time.monotonic()):
        return read() - unit * (400 * 86400 if time.monotonic() - began > 1.0 else 0)
    setattr(time, name, back)
"""
"""A `sitecustomize.py` that sets Python's clock back by 400 days after a second."""


def _clock_set_back(
    reference: Reference, name: str, place: Path, random: Random
) -> str:
    """Stop a command, let its files be of the future, and go on with a clock set back.

    No clock of the machine is touched: the files' times are changed, and Python's clock
    in the process, 400 days back from a second after its start.
    """
    reference.prepare(name, place)
    process = Started(place, TASKS[name].words, warm=True)
    time.sleep(random.uniform(0.3, 0.9) * reference.took_s(name))
    process.send(signal.SIGKILL)
    process.finish()
    future = time.time() + 400 * 86400
    for path in place.rglob("*"):
        os.utime(path, (future, future))
    site = place.with_name("site")
    site.mkdir(exist_ok=True)
    (site / "sitecustomize.py").write_text(CLOCK)
    paths = os.pathsep.join(filter(None, [str(site), os.environ.get("PYTHONPATH", "")]))
    ended = Started(place, TASKS[name].words, {"PYTHONPATH": paths}).finish()
    if name == "calibrate" and ended.code == 2:
        ended = Ended(code=0, text="")
    fault = ended.fault(0) or fault_of_files(place, unfinished=False)
    return fault or _fault_of_finished(reference, name, place)


CONDITIONS = (
    Condition(
        name="two at once",
        required="one finishes, the other one too or says why not",
        tasks=ALL,
        fault=_two_at_once,
    ),
    Condition(
        name="disk full",
        required="one message, nothing lost; finishes once there is room",
        tasks=ALL,
        fault=_full_disk,
    ),
    Condition(
        name="read-only folder",
        required="one message, nothing changed",
        tasks=ALL,
        fault=_read_only,
    ),
    Condition(
        name="cache cut off",
        required="finishes as if alone",
        tasks=("run", "robustness"),
        fault=_cut_off_cache,
    ),
    Condition(
        name="cache deleted meanwhile",
        required="finishes as if alone",
        tasks=("run",),
        fault=_no_cache,
    ),
    Condition(
        name="clock set back",
        required="finishes as if alone",
        tasks=ALL,
        fault=_clock_set_back,
    ),
)
