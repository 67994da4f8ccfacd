"""Whoever makes trials: every result once, and one message where workers are lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from mrmg.errors import MachineError, UsageError
from mrmg.studies import engine as module
from mrmg.studies.engine import Engine


def doubled(shared: int, item: int) -> int:
    if item < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return shared + 2 * item


@pytest.mark.parametrize("workers", [1, 2])
def test_every_job_has_its_result(workers: int) -> None:
    jobs = [(100 * (item % 2), item) for item in range(10)]
    found = dict(Engine(workers=workers).results(doubled, jobs))
    assert found == {item: 100 * (item % 2) + 2 * item for item in range(10)}
    assert dict(Engine(workers=workers).results(doubled, [])) == {}


def test_a_killed_worker_is_one_message() -> None:
    made = Engine(workers=2).results(doubled, [(0, 1), (0, -1), (0, 2)])
    with pytest.raises(MachineError, match="killed .* goes on from the trials"):
        list(made)


def test_a_scheduler_that_does_not_answer_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(module, "CONNECT_S", 0.3)
    made = Engine(kind="dask", scheduler="tcp://127.0.0.1:9").results(doubled, [(0, 1)])
    with pytest.raises(MachineError, match=r"answers at tcp://127\.0\.0\.1:9"):
        list(made)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"kind": "slurm"}, "allowed: local, dask"),
        ({"workers": 0}, "at least 1"),
        ({"scheduler": "tcp://host:1"}, "--engine dask"),
    ],
)
def test_contradictions_are_refused(given: dict, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        Engine(**given)


def test_workers_end_with_the_command_whenever_it_is_killed() -> None:
    code = (
        "import os, time\n"
        "from multiprocessing import Process\n"
        "from mrmg.interruption import end_with_parent\n"
        "def work(parent):\n"
        "    print(flush=True)\n"
        "    time.sleep(0.5)\n"  # its parent is dead by now
        "    end_with_parent(parent)\n"
        "    time.sleep(5)\n"
        "    print('still here', flush=True)\n"
        "Process(target=work, args=(os.getpid(),)).start()\n"
        "time.sleep(60)\n"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None
    parent.stdout.readline()
    parent.kill()
    assert parent.stdout.read() == ""
    parent.wait()


INTERRUPTS_HELD_BACK = """
import signal
from mrmg.studies.engine import Engine

def held_back(_, item):
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])

found = Engine(workers=2).results(held_back, [((), 1), ((), 2)])
print(sorted(found))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such masks")
def test_an_interrupt_does_not_reach_workers_while_they_start() -> None:
    """In a fresh process, where Python's resource tracker does not run yet."""
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTS_HELD_BACK], capture_output=True, text=True
    )
    assert done.stdout == "[(0, True), (1, True)]\n", done.stderr
