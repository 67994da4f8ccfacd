"""Kernels compiled by several processes at once, and not by the one that waits.

What compiling takes of memory is given back as those processes end.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence

from mrmg.compilation.cache import PACKAGE, compiled_kernels

_CALL = (
    "from mrmg.interruption import end_with_parent; end_with_parent({}); "
    "import gc, importlib; gc.set_threshold(50_000, 20, 100); "
    "getattr(importlib.import_module({!r}), {!r})()"
)
"""Ends with whoever waits for it. To compile is to make a million small objects that
all remain: to look through them for garbage as often as Python usually does takes a
tenth of the time."""

_SETTINGS = {
    "NUMBA_OPT": "1",
    "NUMBA_LOOP_VECTORIZE": "0",
    "NUMBA_SLP_VECTORIZE": "0",
}
"""numba's, for the processes that compile: kernels that branch at every step gain
nothing from what else there is to optimise."""

_LOOK_S = 0.2
"""How often the processes are looked at."""


def processors() -> int:
    """Return how many processors this process may use; only Linux limits them."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def compile_in_processes(
    calls: Sequence[Callable[[], None]],
    on_progress: Callable[[int], None],
) -> None:
    """Call functions for the kernels they compile, each in a process of its own.

    What keeps one of them from compiling is not reported: whoever needs the kernel
    compiles it then, and learns of it.

    Args:
        calls: functions of modules, without arguments, begun in this order.
        on_progress: receives the number of kernels compiled so far, now and then.
    """
    path = os.pathsep.join([str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")])
    environment = {**_SETTINGS, **os.environ, "PYTHONPATH": path.rstrip(os.pathsep)}
    own = os.getpid()
    waiting = [_CALL.format(own, call.__module__, call.__name__) for call in calls]
    running: list[subprocess.Popen[bytes]] = []
    try:
        while waiting or running:
            while waiting and len(running) < processors():
                process = subprocess.Popen(
                    [sys.executable, "-c", waiting.pop(0)],
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
                running.append(process)
            time.sleep(_LOOK_S)
            on_progress(compiled_kernels())
            running = [process for process in running if process.poll() is None]
    finally:
        for process in running:
            process.terminate()
            process.wait()
