"""Processes that compile kernels end with the command that waits for them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SLOW = """
import os, time
from pathlib import Path

def kernel():
    Path("pid").write_text(str(os.getpid()))
    time.sleep(600)

def wait():
    from mrmg.compilation.parallel import compile_in_processes
    compile_in_processes([kernel], lambda count: None)
"""


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{pid}/stat")
    return not status.exists() or ") Z " not in status.read_text()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGKILL])
def test_a_killed_command_leaves_no_process_that_compiles(
    tmp_path: Path, sent: signal.Signals
) -> None:
    (tmp_path / "slow.py").write_text(SLOW)
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    waiting = subprocess.Popen(
        [sys.executable, "-c", "import slow; slow.wait()"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": path},
    )
    noted = tmp_path / "pid"
    while not (noted.exists() and noted.read_text()):
        assert waiting.poll() is None
        time.sleep(0.05)
    pid = int(noted.read_text())
    assert is_alive(pid)
    waiting.send_signal(sent)
    waiting.wait()
    while is_alive(pid):  # until the test's time is over
        time.sleep(0.05)
