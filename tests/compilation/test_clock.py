"""Kernels read the same clock as Python."""

from __future__ import annotations

import time

from mrmg.compilation import kernel, now_ns


@kernel
def moments(count):
    """Return the first and the last of several looks at the clock."""
    first = now_ns()
    last = first
    for _ in range(count):
        last = now_ns()
    return first, last


def test_a_kernel_reads_the_clock_of_python() -> None:
    moments(1)
    before = time.perf_counter_ns()
    first, last = moments(1000)
    after = time.perf_counter_ns()
    assert before <= first < last <= after
