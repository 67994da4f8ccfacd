"""Commands that take long enough to be stopped, and what must be left of them."""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
import json
import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import time
import traceback
import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from PIL import Image

from faults.runs import FIRST_RUN_S, SITE
from mrmg import storage


@dataclass(frozen=True, kw_only=True)
class Task:
    """A command, and the files of it that equal commands leave equal.

    Attributes:
        words: of the command, run in a folder that `Reference.prepare` makes.
        needs: task whose folder it works in, or "".
        kept: patterns of files whose bytes the command's arguments decide.
    """

    words: tuple[str, ...]
    needs: str = ""
    kept: tuple[str, ...]


TASKS: dict[str, Task] = {
    "run": Task(
        words=("run", "site.yaml", "--no-video", "--out", "out"),
        kept=("out/plan.*", "out/log.*", "out/verdict.json", "out/audit.json"),
    ),
    "robustness": Task(
        words=("robustness", "out", "--trials", "6"),
        needs="run",
        kept=("out/robustness.json", "out/trials/*/*/*.json"),
    ),
    "campaign": Task(
        words=("campaign", "campaign.yaml", "--out", "made"),
        kept=("made/trials.csv",),
    ),
    "calibrate": Task(
        words=("calibrate", "diffdrive", "-o", "made"),
        kept=("made/*.json", "made/*.yaml", "made/*.xml"),
    ),
}

CAMPAIGN = "scenes: [site.yaml]\nseeds: [0, 1, 2]\ndisturbances: [none, default]\n"


class Reference:
    """What each task leaves when nothing disturbs it."""

    def __init__(self, folder: Path) -> None:
        """Note where the tasks are done once."""
        self._folder = folder
        self._left: dict[str, Mapping[str, str]] = {}
        self._took_s: dict[str, float] = {}

    def prepare(self, name: str, place: Path) -> None:
        """Make a folder in which a task can be done."""
        shutil.rmtree(place, ignore_errors=True)
        needs = TASKS[name].needs
        if needs:
            self.left(needs)
            shutil.copytree(self._folder / needs, place)
            return
        place.mkdir(parents=True)
        (place / "site.yaml").write_text(SITE)
        (place / "campaign.yaml").write_text(CAMPAIGN)

    def left(self, name: str) -> Mapping[str, str]:
        """Return digests of the files that a task leaves."""
        if name not in self._left:
            place = self._folder / name
            self.prepare(name, place)
            began = time.monotonic()
            ended = Started(place, TASKS[name].words, warm=True).finish()
            if ended.code != 0:
                raise RuntimeError(f"mrmg {name}: {ended.text}")
            self._took_s[name] = time.monotonic() - began
            self._left[name] = digests(name, place)
        return self._left[name]

    def took_s(self, name: str) -> float:
        """Return how long a task took."""
        self.left(name)
        return self._took_s[name]


def digests(name: str, place: Path) -> Mapping[str, str]:
    """Return digests of the files that a task's arguments decide, by their paths."""
    files = {path for each in TASKS[name].kept for path in place.glob(each)}
    return {
        str(path.relative_to(place)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(files)
        if path.is_file()
    }


@dataclass(frozen=True, kw_only=True)
class Ended:
    """How a process ended.

    Attributes:
        code: its exit code; negative for a signal.
        text: what it wrote to stderr.
    """

    code: int
    text: str

    def fault(self, *codes: int) -> str:
        """Return what is wrong with it, if it may only end with some codes; or ""."""
        if "Traceback" in self.text:
            return f"traceback: {self.text.strip()[-1500:]}"
        if self.code not in codes:
            return f"exit code {self.code}: {self.text.strip()[-200:]}"
        if self.code > 0 and self.code != 130 and "mrmg: " not in self.text:
            return f"no message with exit code {self.code}"
        return ""


_number = itertools.count()


class Started:
    """A command under way: a process of its own, or forked from a warm one."""

    def __init__(
        self,
        place: Path,
        words: tuple[str, ...],
        env: Mapping[str, str] | None = None,
        *,
        warm: bool = False,
    ) -> None:
        """Start the command `mrmg WORDS` in a folder, in a process group of its own.

        Args:
            place: folder.
            words: of the command.
            env: variables of the environment beside those of this process.
            warm: whether it is forked from a process that has imported and loaded all
                that commands need, which takes most of a short command's time.
        """
        place.mkdir(parents=True, exist_ok=True)
        self._errors = place.with_name(f"{place.name}.{next(_number)}.stderr")
        self._errors.write_text("")
        # A shell's background job ignores Ctrl-C, and so would its children.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        self._process: Any
        if warm:
            context = multiprocessing.get_context("forkserver")
            context.set_forkserver_preload(["faults.warm"])
            arguments = (str(place), words, str(self._errors))
            self._process = context.Process(target=_command, args=arguments)
            self._process.start()
        else:
            with self._errors.open("w") as errors:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "mrmg", *words],
                    cwd=place,
                    env={**os.environ, **(env or {})},
                    stdout=subprocess.DEVNULL,
                    stderr=errors,
                    start_new_session=True,
                )
        self.group = int(self._process.pid)

    def wait(self, within_s: float) -> int | None:
        """Return the exit code; None if it has not ended within a time."""
        if isinstance(self._process, subprocess.Popen):
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(within_s)
            return self._process.returncode
        self._process.join(within_s)
        code = self._process.exitcode
        return None if code is None else int(code)

    def send(self, number: int) -> None:
        """Send a signal: Ctrl-C to the whole group, as a terminal does.

        A forked command has its group, and minds Ctrl-C, only after a moment.
        """
        while self.wait(0.0) is None:
            with suppress(ProcessLookupError):
                if number == signal.SIGINT:
                    os.killpg(self.group, number)
                else:
                    os.kill(self.group, number)
                return
            time.sleep(0.01)

    def finish(self, within_s: float = FIRST_RUN_S) -> Ended:
        """Wait for the end; a hanging one is killed."""
        code = self.wait(within_s)
        text = self._errors.read_text(errors="replace")
        if code is None:
            os.killpg(self.group, signal.SIGKILL)
            self.wait(within_s)
            return Ended(code=999, text=f"did not end within {within_s} s; {text}")
        return Ended(code=code, text=text)


def _command(place: str, words: tuple[str, ...], errors: str) -> None:
    """Be the command `mrmg WORDS` in this process, which was forked for it."""
    from mrmg.__main__ import command

    signal.signal(signal.SIGINT, lambda number, frame: os._exit(130))
    os.setsid()
    os.chdir(place)
    for number, name in ((1, os.devnull), (2, errors)):
        os.dup2(os.open(name, os.O_WRONLY | os.O_APPEND), number)
    sys.stdout, sys.stderr = (open(n, "w", closefd=False) for n in (1, 2))  # noqa: SIM115
    sys.argv = ["mrmg", *words]
    try:
        command()
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)


def fault_of_files(folder: Path, *, unfinished: bool) -> str:
    """Return which file below a folder is not whole; "" if all are.

    Args:
        folder: holds what commands left.
        unfinished: whether files under temporary names may be left.
    """
    for path in sorted(item for item in folder.rglob("*") if item.is_file()):
        if path.name.startswith(".part-"):
            if not unfinished:
                return f"left {path.relative_to(folder)}"
            continue
        try:
            _READERS.get(path.suffix, Path.read_bytes)(path)
        except Exception as error:  # readers raise anything of a half-written file
            return f"half-written: {path.relative_to(folder)} ({error})"
    return ""


def _read_png(path: Path) -> None:
    with Image.open(path) as picture:
        picture.load()


def _read_html(path: Path) -> None:
    if not path.read_text().rstrip().endswith("</html>"):
        raise ValueError("no end")


def _read_csv(path: Path) -> None:
    rows = [*csv.reader(io.StringIO(path.read_text()))]
    if {len(row) for row in rows} != {len(rows[0])}:
        raise ValueError("rows of other lengths")


def _read_zip(path: Path) -> None:
    with zipfile.ZipFile(path) as archive:
        if archive.testzip():
            raise ValueError("damaged")


_READERS: Mapping[str, Callable[[Path], object]] = {
    ".json": lambda path: json.loads(path.read_text()),
    ".yaml": lambda path: (
        yaml.safe_load(path.read_text())["format"]
        if path.name in ("scene.yaml", "robot.yaml")
        else yaml.safe_load(path.read_text())
    ),
    ".npz": storage.read_arrays,
    ".png": _read_png,
    ".html": _read_html,
    ".csv": _read_csv,
    ".zip": _read_zip,
}
