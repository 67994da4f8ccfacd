"""Files appear whole or not at all, and equal content gives equal bytes."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrmg import storage

ARRAYS = {
    "state": np.linspace(0.0, 1.0, 15).reshape(3, 5),
    "empty": np.zeros((0, 2)),
    "count": np.arange(4),
    "flag": np.array(True),
}


def test_a_writer_that_raises_leaves_nothing(tmp_path: Path) -> None:
    with (
        pytest.raises(RuntimeError, match="disk"),
        storage.atomic_path(tmp_path / "plan.json") as temporary,
    ):
        temporary.write_text("half")
        raise RuntimeError("disk")
    assert list(tmp_path.iterdir()) == []


def test_a_writer_that_raises_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    storage.write_json(path, {"a": 1})
    with pytest.raises(ValueError, match="JSON compliant"):
        storage.write_json(path, {"a": math.nan})
    assert storage.read_json(path) == {"a": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_a_reader_never_sees_a_file_that_is_being_written(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    storage.write_text(path, "old")
    with storage.atomic_path(path) as temporary:
        temporary.write_text("new, but not yet whole")
        assert path.read_text() == "old"
        assert temporary.parent == path.parent, "a rename must not cross file systems"
    assert path.read_text() == "new, but not yet whole"


def test_a_killed_writer_leaves_no_file_of_the_final_name(tmp_path: Path) -> None:
    code = (
        "import os, pathlib, signal, sys\n"
        "from mrmg import storage\n"
        "with storage.atomic_path(pathlib.Path(sys.argv[1])) as temporary:\n"
        "    temporary.write_text('half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    path = tmp_path / "plan.npz"
    process = subprocess.run([sys.executable, "-c", code, str(path)], check=False)
    assert process.returncode == -signal.SIGKILL
    assert not path.exists()
    storage.write_arrays(path, ARRAYS)
    assert storage.read_arrays(path).keys() == ARRAYS.keys()


def test_missing_folders_are_made(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b" / "text.txt"
    storage.write_text(path, "grün")
    assert path.read_bytes() == "grün".encode()


@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_who_may_read_what_was_written_is_for_the_umask_to_say(
    mask: int, tmp_path: Path
) -> None:
    before = os.umask(mask)
    try:
        storage.write_text(tmp_path / "plan.json", "{}")
    finally:
        os.umask(before)
    assert (tmp_path / "plan.json").stat().st_mode & 0o777 == 0o666 & ~mask


def test_a_full_disk_is_told_with_the_file_that_was_to_be_written(
    tmp_path: Path,
) -> None:
    path = tmp_path / "plan.json"
    with (
        pytest.raises(OSError, match="left on device") as told,
        storage.atomic_path(path),
        open("/dev/full", "wb", buffering=0) as full,
    ):
        full.write(b"{}")
    assert told.value.filename == str(path)
    assert list(tmp_path.iterdir()) == []


def test_names_of_files_that_are_no_text_are_escaped(tmp_path: Path) -> None:
    storage.write_text(tmp_path / "page.html", os.fsdecode(b"Z\xc3\xbcrich \xff"))
    assert (tmp_path / "page.html").read_text("utf-8") == "Zürich \\udcff"


def test_arrays_return_as_they_were(tmp_path: Path) -> None:
    path = tmp_path / "arrays.npz"
    storage.write_arrays(path, ARRAYS)
    back = storage.read_arrays(path)
    assert back.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert back[name].dtype == array.dtype
        assert back[name].shape == array.shape
        assert np.array_equal(back[name], array)


def test_equal_arrays_give_equal_bytes(tmp_path: Path) -> None:
    """In whatever order they come, and whenever they are written."""
    storage.write_arrays(tmp_path / "first.npz", ARRAYS)
    os.utime(tmp_path / "first.npz", (0, 0))
    storage.write_arrays(tmp_path / "second.npz", dict(reversed(ARRAYS.items())))
    first, second = (tmp_path / f"{n}.npz" for n in ("first", "second"))
    assert first.read_bytes() == second.read_bytes()
    changed = {**ARRAYS, "count": np.arange(1, 5)}
    storage.write_arrays(second, changed)
    assert first.read_bytes() != second.read_bytes()


def test_pickled_content_is_refused_both_ways(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="allow_pickle"):
        storage.write_arrays(tmp_path / "a.npz", {"a": np.array([object()])})
    assert list(tmp_path.iterdir()) == []
    np.savez(tmp_path / "b.npz", a=np.array([{}], dtype=object))
    with pytest.raises(ValueError, match="allow_pickle"):
        storage.read_arrays(tmp_path / "b.npz")


def test_a_file_that_unpacks_to_far_more_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    storage.write_arrays(tmp_path / "bomb.npz", {"a": np.zeros(2**18)})
    assert storage.read_arrays(tmp_path / "bomb.npz")["a"].size == 2**18
    monkeypatch.setattr(storage, "MAX_UNPACKED_BYTES", 2**20)
    with pytest.raises(ValueError, match="unpack to 2097280; allowed are 1048576"):
        storage.read_arrays(tmp_path / "bomb.npz")


@pytest.mark.parametrize("shape", ["(10**9,)", "(1000000000000,)", "(-1,)", "(3, 2)"])
def test_an_array_has_the_size_that_it_states(tmp_path: Path, shape: str) -> None:
    storage.write_arrays(tmp_path / "a.npz", {"a": np.arange(5.0)})
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        data = archive.read("a.npy").replace(b"(5,), ", f"{shape}, ".encode())
    start = data.index(b"{")
    line = data[start:].partition(b"}")[0] + b"}"
    header = line.ljust(117) + b"\n"
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive:
        head = data[:8] + len(header).to_bytes(2, "little")
        archive.writestr("a.npy", head + header + np.arange(5.0).tobytes())
    with pytest.raises(ValueError, match=r"b\.npz is damaged"):
        storage.read_arrays(tmp_path / "b.npz")


@pytest.mark.parametrize(
    "text", ["[NaN]", "[1e999]", '["\\ud800"]', "[" * 9999, "9" * 5000, "{", "\xff"]
)
def test_json_that_nobody_wrote_is_a_value_error(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(ValueError):
        storage.read_json(path)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.99])
def test_a_truncated_file_is_called_damaged(tmp_path: Path, share: float) -> None:
    path = tmp_path / "plan.npz"
    storage.write_arrays(path, ARRAYS)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(ValueError, match="damaged"):
        storage.read_arrays(path)


def test_no_flipped_bit_is_read_as_other_numbers(tmp_path: Path) -> None:
    path = tmp_path / "plan.npz"
    storage.write_arrays(path, {"a": np.arange(50.0)})
    whole = path.read_bytes()
    for position in range(0, len(whole), 3):
        broken = bytearray(whole)
        broken[position] ^= 0x10
        path.write_bytes(bytes(broken))
        try:
            back = storage.read_arrays(path)
        except (ValueError, OSError, RuntimeError):
            continue
        assert all(np.array_equal(array, np.arange(50.0)) for array in back.values())


def test_text_that_is_no_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "plan.npz"
    path.write_text("hello")
    with pytest.raises(ValueError):  # noqa: PT011  (numpy chooses the words)
        storage.read_arrays(path)


@given(
    st.dictionaries(
        st.text(max_size=5),
        st.recursive(
            st.none()
            | st.booleans()
            | st.integers()
            | st.text()
            | st.floats(allow_nan=False, allow_infinity=False),
            lambda inner: (
                st.lists(inner, max_size=3)
                | st.dictionaries(st.text(max_size=5), inner, max_size=3)
            ),
            max_leaves=8,
        ),
        max_size=5,
    )
)
def test_canonical_json_knows_no_order_and_loses_nothing(value: dict) -> None:
    import json

    text = storage.canonical_json(value)
    assert json.loads(text) == value
    assert storage.canonical_json(dict(reversed(value.items()))) == text


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_json_does_not_know_are_refused(value: float) -> None:
    with pytest.raises(ValueError, match="JSON compliant"):
        storage.canonical_json({"a": [value]})


def test_digest_tells_texts_apart() -> None:
    assert storage.digest("plan") == storage.digest("plan")
    assert len({storage.digest(str(i)) for i in range(1000)}) == 1000


def test_a_device_or_a_pipe_is_no_place_for_a_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="a file is needed there"):
        storage.write_text(tmp_path / "pipe", "{}")
    assert [path.is_fifo() for path in tmp_path.iterdir()] == [True]


def test_a_user_whose_cache_cannot_be_written_has_one_among_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file" / "cache"))
    folder = storage.user_cache_folder()
    assert folder.parent == tmp_path
    assert folder.stat().st_mode & 0o777 == 0o700
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "new" / "cache"))
    assert storage.user_cache_folder() == tmp_path / "new" / "cache" / "mrmg"
    assert not (tmp_path / "new").exists()


def test_a_user_without_home_uses_no_cache_that_is_someone_elses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nowhere() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", nowhere)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    folder = storage.user_cache_folder()
    assert folder == tmp_path / f"mrmg-{os.getuid()}"
    folder.rename(tmp_path / "mrmg-12345")
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    with pytest.raises(NotADirectoryError):
        storage.write_text(storage.user_cache_folder() / "kernel", "")
