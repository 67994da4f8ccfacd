"""A thousand missions in one process: memory stays flat, no file handle is left."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import io
import multiprocessing
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from protocol import Row

from faults.inputs import SCENE
from faults.rows import Options, row_of

EVERY = 20
"""Missions between two readings."""

WARM_SHARE = 0.2
"""Share of the missions after which caches are filled."""

MOST_GROWTH_BYTES = 10_000
"""Memory that a mission may leave, by a straight line through the readings."""

ALLOCATOR = {"MALLOC_ARENA_MAX": "1", "MALLOC_MMAP_THRESHOLD_": "131072"}
"""Environment in which the C library gives large blocks back as soon as they are free.

Else it keeps some for each thread, in steps of twenty megabytes that come and go with
the threads' order, and would hide what missions leave."""

REQUIRED = (
    f"memory grows by at most {MOST_GROWTH_BYTES // 1000} kB a mission, no handle"
)


def rows(options: Options) -> Iterator[Row]:
    """Yield the one row."""
    if not options.missions:
        return
    folder = options.work / "long"

    def make() -> Row:
        context = multiprocessing.get_context("spawn")
        with patch.dict(os.environ, ALLOCATOR), context.Pool(1) as pool:
            return pool.apply(_missions, (str(folder), options.missions))

    found = options.trials.row(make, part="long", missions=options.missions)
    failures = [{"case": "long run", "fault": fault} for fault in found["faults"]]
    figures = {key: found[key] for key in found if key != "faults"}
    yield row_of("long run", REQUIRED, options.missions, failures, **figures)


def _missions(folder: str, count: int) -> dict[str, Any]:
    """Run missions one after the other; return readings and what was wrong."""
    from mrmg.cli.main import main

    place = Path(folder)
    place.mkdir(parents=True)
    os.chdir(place)
    Path("s.yaml").write_text(SCENE)
    numbers, untrimmed_bytes, memory_bytes, handles, faults = [], [], [], [], []
    for number in range(count):
        words = ["run", "s.yaml", "--no-video", "--seed", str(number), "--out", "out"]
        with (
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()) as errors,
        ):
            code = main(words)
        shutil.rmtree("out")
        if code != 0:
            faults.append(f"mission {number}: exit code {code}: {errors.getvalue()}")
        if number % EVERY == EVERY - 1:
            gc.collect()
            numbers.append(number)
            untrimmed_bytes.append(_resident_bytes())
            _give_back()
            memory_bytes.append(_resident_bytes())
            handles.append(len(os.listdir("/proc/self/fd")))
    first = int(WARM_SHARE * len(numbers))
    growth = 0.0
    if len(numbers) - first > 2:
        growth = float(np.polyfit(numbers[first:], memory_bytes[first:], 1)[0])
    if growth > MOST_GROWTH_BYTES:
        faults.append(f"memory grows by {growth / 1000:.1f} kB a mission")
    if handles and handles[-1] > handles[0]:
        faults.append(f"{handles[-1] - handles[0]} more file handles than at first")
    return {
        "faults": faults,
        "bytes_a_mission": growth,
        "memory_bytes": memory_bytes,
        "untrimmed_bytes": untrimmed_bytes,
        "handles": [handles[0], handles[-1]] if handles else [],
    }


def _give_back() -> None:
    """Give free memory back to the system, where the C library is one that can."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def _resident_bytes() -> int:
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0]) * 1024
