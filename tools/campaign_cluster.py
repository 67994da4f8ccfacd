"""A campaign on a Dask cluster of this machine, whose processes are killed."""

from __future__ import annotations

import csv
import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from physics.figures import Figure

from mrmg.compilation import cache_folder
from mrmg.errors import ExitCode
from mrmg.studies.campaigns.campaign import run_campaign
from mrmg.studies.campaigns.reading import read_campaign

CAMPAIGN = """\
scenes:
  - quickstart
  - {scene: quickstart, name: moved, perturb: {goals: 1, starts: 0.5}}
seeds: 0-3
disturbances: [none, default]
"""
"""Sixteen trials of about a second."""

PATIENCE_S = 900.0
"""How long anything is waited for [s]; compiling takes minutes."""

COMPILING_S = 5.0
"""Time from which on a trial has compiled, or waited for another one that did [s]."""


def cluster_figures(folder: Path, *, cold: bool) -> list[Figure]:
    """Make a campaign while its cluster is killed; return what is asked of it.

    Args:
        folder: of the campaign and of the workers' homes; emptied first.
        cold: whether the workers' caches are empty at first.
    """
    folder = folder.resolve()  # workers have other working folders
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    file = folder / "campaign.yaml"
    file.write_text(CAMPAIGN)
    run_campaign(read_campaign(file), folder / "serial")
    out = folder / "made"
    with _cluster(folder, cold) as (scheduler, workers, address):
        process = _started(file, address, out)
        _wait_for(out, 3, process)
        workers[0].kill()
        workers[0].wait()
        workers[0] = _worker(folder, 0, address)
        _wait_for(out, 7, process)
        scheduler.kill()
        _, lost = process.communicate(timeout=PATIENCE_S)
    before = {path.name: path.stat().st_mtime_ns for path in _trials(out)}
    with _cluster(folder, cold) as (_, _, address):
        again = _started(file, address, out)
        again.communicate(timeout=PATIENCE_S)
    after = {path.name: path.stat().st_mtime_ns for path in _trials(out)}
    kept = all(after[name] == at for name, at in before.items())
    tables = [(each / "trials.csv").read_bytes() for each in (folder / "serial", out)]
    rows = list(csv.DictReader((out / "times.csv").open()))
    compiled = sum(float(row["compile_s"] or 0.0) > COMPILING_S for row in rows)
    return [
        _figure(
            "campaign whose scheduler was killed",
            f"exit code {process.returncode}: {lost.strip().splitlines()[-1]}",
            f"exit code {int(ExitCode.MACHINE)}",
            process.returncode == ExitCode.MACHINE,
        ),
        _figure(
            "the same command with a new cluster",
            f"exit code {again.returncode}",
            "exit code 0",
            again.returncode == 0,
        ),
        _figure(
            f"{len(before)} trials of {len(after)} done before",
            "kept" if kept else "made again",
            "kept",
            kept,
        ),
        _figure(
            "table against a serial run",
            "equal" if tables[0] == tables[1] else "different",
            "equal",
            tables[0] == tables[1],
        ),
        Figure.at_most("trials that compiled, two caches", compiled, 2, ""),
    ]


def _figure(what: str, found: str, asked: str, holds: bool) -> Figure:
    return Figure(what, found, asked, holds)


@contextmanager
def _cluster(
    folder: Path, cold: bool
) -> Iterator[tuple[subprocess.Popen[bytes], list[subprocess.Popen[bytes]], str]]:
    """Start a scheduler and two workers; yield them and the scheduler's address."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    words = ["dask_scheduler", "--host", "127.0.0.1", "--port", str(port)]
    scheduler = _dask(folder / "scheduler", [*words, "--no-dashboard"])
    for number in range(2):
        kernels = folder / f"worker{number}" / "cache" / "mrmg" / "kernels"
        if not cold and not kernels.exists():
            shutil.copytree(cache_folder(), kernels / cache_folder().name)
    workers = [_worker(folder, number, address) for number in range(2)]
    try:
        yield scheduler, workers, address
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()


def _worker(folder: Path, number: int, address: str) -> subprocess.Popen[bytes]:
    words = ["dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    return _dask(folder / f"worker{number}", words)


def _dask(home: Path, words: list[str]) -> subprocess.Popen[bytes]:
    """Start a process of Dask with a home, a cache and a working folder of its own."""
    home.mkdir(parents=True, exist_ok=True)
    own = {"HOME": str(home), "XDG_CACHE_HOME": str(home / "cache")}
    with (home / "log.txt").open("ab") as log:
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.{words[0]}", *words[1:]],
            cwd=home,
            env={**os.environ, **own},
            stdout=log,
            stderr=log,
        )


def _started(file: Path, address: str, out: Path) -> subprocess.Popen[str]:
    words = ["--engine", "dask", "--scheduler", address, "--out", str(out)]
    return subprocess.Popen(
        [sys.executable, "-m", "mrmg", "campaign", str(file), *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def _trials(out: Path) -> list[Path]:
    return sorted((out / "trials").glob("[!.]*.json"))


def _wait_for(out: Path, count: int, process: subprocess.Popen[str]) -> None:
    """Return once so many trials are done."""
    until = time.monotonic() + PATIENCE_S
    while len(_trials(out)) < count:
        if process.poll() is not None or time.monotonic() > until:
            raise RuntimeError(f"the campaign ended early: {process.communicate()}")
        time.sleep(0.05)
