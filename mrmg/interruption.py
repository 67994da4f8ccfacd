"""Ctrl-C ends a command at any moment: in an orderly way if possible, else by force.

Python turns the signal into an exception of the main thread. It comes late while C code
does not return, and never where a callback, or the import of a compiled module, drops
it. A second thread, which the system wakes at once, therefore gives the main thread
`GRACE_S` to end, and then ends the process itself.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, NoReturn

EXIT_CODE = 130
"""Exit code after Ctrl-C, as shells have it."""

MESSAGE = "mrmg: stopped; the same command takes it up again"

GRACE_S = 1.0
"""Time in which the main thread may end in an orderly way."""

_LOOK_S = 0.5
"""How often a worker process looks whether its parent is still there [s]."""

_LOOKS = 3
"""How often a process that ends looks for children: the system's lists of them may lack
some where others have just ended."""

_cleanups: list[Callable[[], object]] = []
_accepted = threading.Event()
_pending = threading.Event()


def install() -> None:
    """Let Ctrl-C end this process with `EXIT_CODE`, at the latest after `GRACE_S`.

    A process that was started to ignore it, such as a shell's background job, does.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        return
    reader, writer = os.pipe()
    if hasattr(os, "set_blocking"):  # Windows has it from Python 3.12 on
        os.set_blocking(writer, False)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    signal.signal(signal.SIGINT, _raise)
    sys.unraisablehook = _end_where_dropped
    sys.excepthook = _end_where_printed
    threading.Thread(target=_watch, args=(reader,), daemon=True).start()


def is_pending() -> bool:
    """Return whether there was a Ctrl-C that nobody has accepted."""
    return _pending.is_set()


def accept() -> None:
    """State that the process goes on after this Ctrl-C, which is acted on."""
    _pending.clear()
    _accepted.set()


@contextmanager
def cleaned_up_by(cleanup: Callable[[], object]) -> Iterator[None]:
    """Have `cleanup` called if the process is ended by force within the block."""
    _cleanups.append(cleanup)
    try:
        yield
    finally:
        _cleanups.remove(cleanup)


def end(*, reported: bool = False) -> NoReturn:
    """End the process at once, without children and unfinished files.

    Args:
        reported: whether the user has been informed.
    """
    # Other threads may still miss the children, start new ones, and have them complain.
    told = os.dup(2)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    for _ in range(_LOOKS):
        for child in _children(os.getpid()):
            with suppress(OSError):
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)
    for cleanup in [*_cleanups]:
        with suppress(Exception):
            cleanup()
    if not reported:
        with suppress(OSError):
            os.write(told, f"{MESSAGE}\n".encode())
    os._exit(EXIT_CODE)


def end_with_parent(parent: int) -> None:
    """Leave Ctrl-C to the parent of this worker process, and end when it has ended.

    Args:
        parent: its process id; it may have ended before this is called.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def follow() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK_S)
        os._exit(EXIT_CODE)

    threading.Thread(target=follow, daemon=True).start()


@contextmanager
def sheltered_children() -> Iterator[None]:
    """Start processes in the block that Ctrl-C never reaches, not even at first."""
    if sys.platform == "win32":  # has no such masks
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _raise(number: int, frame: FrameType | None) -> None:
    _pending.set()
    raise KeyboardInterrupt


def _watch(reader: int) -> None:
    while True:
        if signal.SIGINT not in os.read(reader, 64):
            continue
        if not _accepted.wait(GRACE_S):
            end()
        _accepted.clear()


def _end_where_dropped(dropped: Any) -> None:
    if isinstance(dropped.exc_value, KeyboardInterrupt):
        end()
    sys.__unraisablehook__(dropped)


def _end_where_printed(
    kind: type[BaseException], value: BaseException, trace: TracebackType | None
) -> None:
    """End the process where compiled code would print the exception and go on."""
    if issubclass(kind, KeyboardInterrupt):
        end()
    sys.__excepthook__(kind, value, trace)


def _children(process: int) -> list[int]:
    """Return the processes below one, the lowest first; none where /proc is missing."""
    found: list[int] = []
    with suppress(OSError):  # it has ended meanwhile
        for task in Path(f"/proc/{process}/task").glob("*/children"):
            with suppress(OSError, ValueError):
                for child in map(int, task.read_text().split()):
                    found += [*_children(child), child]
    return found
