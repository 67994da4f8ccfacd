"""Work on daemon threads, which a caller may leave behind and a process ends with.

The threads of `concurrent.futures.ThreadPoolExecutor` are joined when the interpreter
exits, so that work which nobody waits for any longer would keep a command from ending.
Daemon threads are not; but the process aborts if one is inside compiled code when the
interpreter ends. So a command that leaves work behind ends without that
(`mrmg.__main__.command`), and a script of a user's waits for the work at its end.
"""

from __future__ import annotations

import atexit
import threading
from collections.abc import Callable, Collection
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import TypeVar

Result = TypeVar("Result")


PATIENCE_S = 10.0
"""How long the end of a process waits for each work that was asked to halt [s]."""

_running: set[threading.Thread] = set()


def in_background(call: Callable[[], Result]) -> Future[Result]:
    """Run `call` on a daemon thread of its own; the future holds what became of it."""
    future: Future[Result] = Future()

    def work() -> None:
        try:
            result = call()
        except BaseException as error:  # whoever waits for the result raises it
            future.set_exception(error)
        else:
            future.set_result(result)
        finally:
            _running.discard(threading.current_thread())

    thread = threading.Thread(target=work, daemon=True)
    _running.add(thread)
    thread.start()
    return future


@atexit.register
def _wait() -> None:
    for thread in list(_running):
        thread.join(PATIENCE_S)


def finished(
    futures: Collection[Future[Result]], within_s: float
) -> set[Future[Result]]:
    """Return the futures that are done once one is; none if that takes too long.

    Args:
        futures: what is waited for.
        within_s: how long [s]; inf for as long as it takes.
    """
    timeout_s = None if within_s > threading.TIMEOUT_MAX else within_s
    return wait(futures, timeout=timeout_s, return_when=FIRST_COMPLETED).done


def within(call: Callable[[], Result], within_s: float) -> Result | None:
    """Return what `call` returns, or None if that takes longer than `within_s` [s].

    A call that takes too long goes on in the background.
    """
    future = in_background(call)
    return future.result() if finished([future], within_s) else None
