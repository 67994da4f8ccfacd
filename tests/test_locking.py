"""A folder is locked once at a time, on systems with fcntl and without."""

from __future__ import annotations

import fcntl
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from mrmg import locking


@pytest.fixture(params=["posix", "windows"])
def system(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a test as on a system; Windows cannot open folders and lacks fcntl."""
    if request.param == "posix":
        return

    def lock(handle: int, mode: int, length: int) -> None:
        assert (mode, length) == (2, 1)
        assert not os.path.isdir(f"/proc/self/fd/{handle}")
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise PermissionError from error

    fake = SimpleNamespace(locking=lock, LK_NBLCK=2)
    monkeypatch.setitem(sys.modules, "msvcrt", fake)
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setattr(locking.sys, "platform", "win32")


@pytest.mark.usefixtures("system")
def test_a_folder_is_locked_once_at_a_time(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    with locking.locked(folder) as first:
        assert first
        with locking.locked(folder) as second:
            assert not second
    with locking.locked(folder) as again:
        assert again
    assert not list(folder.iterdir())
