"""A clock that kernels can read, for what they report and never decide by."""

from __future__ import annotations

import time

import numba

from mrmg.compilation.decorators import kernel


@kernel
def now_ns() -> int:
    """Return the time since some moment [ns]; Python's own clock, on any system."""
    with numba.objmode(ns="int64"):
        ns = time.perf_counter_ns()
    return ns  # noqa: RET504  (numba returns from no such block)
