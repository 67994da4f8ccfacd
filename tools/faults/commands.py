"""Commands run by the thousand in one process, with a watchdog, and what each left."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from mrmg.errors import ExitCode

LONGEST_S = 5.0
"""Time of the processor after which a command counts as hanging."""

LONGEST_CLOCK_S = 60.0
"""The same on the clock, which other processes stretch."""

MOST_BYTES = 10**9
"""Memory that a command may hold at its peak."""

LONGEST_LINE = 500
"""Characters of a message's line that a person still reads."""

CODES = {int(code) for code in ExitCode}

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
_ERROR = re.compile(r"^(mrmg|mrmg [a-z ]+): (?!warning: )")


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a command left.

    Attributes:
        code: its exit code; None where it did not end.
        out, err: what it wrote.
        trace: traceback of an exception that nobody caught, or "".
        cpu_s: time of the processor.
        peak_bytes: memory of the process at its peak.
    """

    code: int | None
    out: str = ""
    err: str = ""
    trace: str = ""
    cpu_s: float = 0.0
    peak_bytes: int = 0

    def fault(self) -> str:
        """Return what is wrong with the command's end; "" if nothing is."""
        if self.trace or "Traceback (most recent call last)" in self.err:
            return f"traceback: {(self.trace or self.err).strip().splitlines()[-1]}"
        if self.code is None:
            return "hang: it did not end"
        if self.cpu_s > LONGEST_S:
            return f"hang: took {self.cpu_s:.1f} s of the processor"
        if self.peak_bytes > MOST_BYTES:
            return f"memory: {self.peak_bytes / 1e6:.0f} MB"
        if self.code not in CODES:
            return f"exit code {self.code} is none of the documented ones"
        return self._fault_of_message()

    def _fault_of_message(self) -> str:
        lines = self.err.splitlines()
        errors = [line for line in lines if _ERROR.match(line)]
        usage = self.code == ExitCode.USAGE and lines[1:] and lines[-1][:6] == "usage:"
        strange = [
            line
            for line in (lines[:-1] if usage else lines)
            if not line.startswith(("mrmg: ", "mrmg ", "  "))
        ]
        if strange:
            return f"message: a line of another kind: {strange[0][:120]}"
        if self.code and len(errors) > 1:
            return f"message: {len(errors)} of them: {errors[1][:120]}"
        if self.code and not errors and not self.out.strip():
            return f"message: none with exit code {self.code}"
        if any(len(line) > LONGEST_LINE for line in lines):
            longest = max(lines, key=len)
            return f"message: a line of {len(longest)} characters: {longest[:120]}"
        if _CONTROL.search(self.err):
            return f"message: control characters: {self.err[:120]!r}"
        return ""


class Commands:
    """Runs commands of mrmg in one process, which is started anew when it hangs."""

    def __init__(self) -> None:
        """Start the process."""
        self._context = multiprocessing.get_context("spawn")
        self._start()

    def _start(self) -> None:
        self._connection, other = self._context.Pipe()
        self._process = self._context.Process(target=_serve, args=(other,), daemon=True)
        self._process.start()
        other.close()
        self._connection.recv()

    def run(self, folder: Path, words: Sequence[str]) -> Outcome:
        """Run the command `mrmg WORDS` in a folder."""
        self._connection.send((str(folder), list(words)))
        try:
            if self._connection.poll(LONGEST_CLOCK_S):
                return Outcome(**self._connection.recv())
            outcome = Outcome(code=None)
        except (EOFError, ConnectionError):
            self._process.join()
            code = self._process.exitcode
            outcome = Outcome(code=code, trace=f"the process ended with {code}")
        self.close()
        self._start()
        return outcome

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self._connection.close()


def run_process(
    folder: Path, words: Sequence[str], *, longest_s: float = LONGEST_CLOCK_S
) -> Outcome:
    """Run the command `mrmg WORDS` in a folder, as a process of its own."""
    command = [sys.executable, "-m", "mrmg", *words]
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        process = subprocess.Popen(command, cwd=folder, stdout=out, stderr=err)
        try:
            process.wait(longest_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return Outcome(code=None)
        out.seek(0)
        err.seek(0)
        return Outcome(code=process.returncode, out=out.read(), err=err.read())


def left_over(place: Path, before: set[Path], outcome: Outcome) -> str:
    """Return what a command left that it should not; "" for nothing."""
    new = {path for path in place.rglob("*")} - before
    unfinished = sorted(path.name for path in new if path.name.startswith(".part-"))
    if unfinished:
        return f"left {unfinished[0]}"
    if outcome.code in (2, 3) and new:
        return f"left {min(new).relative_to(place)} with exit code {outcome.code}"
    return ""


def _serve(connection: Connection) -> None:
    """Run the commands that come; a worker's whole life."""
    resource.setrlimit(resource.RLIMIT_DATA, (6 * 10**9, 6 * 10**9))
    files = [tempfile.TemporaryFile("w+b") for _ in range(2)]  # noqa: SIM115
    for number, file in enumerate(files, start=1):
        os.dup2(file.fileno(), number)
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stderr = open(  # noqa: SIM115
        2, "w", encoding="utf-8", errors="backslashreplace", closefd=False
    )
    connection.send("ready")
    with contextlib.suppress(EOFError):
        while True:
            folder, words = connection.recv()
            connection.send(_run(folder, words, files))


def _run(folder: str, words: list[str], files: list[Any]) -> dict[str, Any]:
    import warnings

    from mrmg.cli.main import main

    os.chdir(folder)
    for file in files:
        os.ftruncate(file.fileno(), 0)
        os.lseek(file.fileno(), 0, os.SEEK_SET)
    Path("/proc/self/clear_refs").write_text("5")  # the peak is that of now again
    warnings.simplefilter("always")
    began, trace, code = time.process_time(), "", None
    try:
        code = main(words)
    except SystemExit as end:
        code = end.code
    except BaseException:  # whatever a user would see as a traceback
        trace = traceback.format_exc()
    cpu_s = time.process_time() - began
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    texts = [_text(file) for file in files]
    return {
        "code": code,
        "out": texts[0],
        "err": texts[1],
        "trace": trace,
        "cpu_s": cpu_s,
        "peak_bytes": _peak_bytes(),
    }


def _text(file: Any) -> str:
    with open(f"/proc/self/fd/{file.fileno()}", "rb") as again:
        return str(again.read(10**7).decode("utf-8", errors="backslashreplace"))


def _peak_bytes() -> int:
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) * 1024
