"""Capsules through the disk, and every way a file can be no capsule."""

from __future__ import annotations

import io
import json
import random
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrmg.errors import FileError
from mrmg.runs.capsule import LAST_TICKS, Capsule, Failure
from mrmg.simulation.log import ExecutionLog


@pytest.fixture(scope="session")
def log(quickstart_run: Path) -> ExecutionLog:
    return ExecutionLog.load(quickstart_run)


@pytest.fixture(scope="session")
def capsule(quickstart_run: Path, log: ExecutionLog) -> Capsule:
    failure = Failure.of(log, ("contact",), ("r1 touched rock",))
    arguments = {"seed": 0, "profile": "default"}
    return Capsule.of_run(quickstart_run, arguments, failure, {})


@pytest.fixture
def saved(capsule: Capsule, tmp_path: Path) -> Path:
    capsule.save(tmp_path / "capsule.zip")
    return tmp_path / "capsule.zip"


def test_a_capsule_survives_the_disk(capsule: Capsule, saved: Path) -> None:
    loaded = Capsule.load(saved)
    assert loaded.arguments == capsule.arguments
    assert loaded.files == capsule.files
    one, other = loaded.failure, capsule.failure
    assert replace(one, last={}) == replace(other, last={})
    assert {*one.last} == {*other.last}
    for name, values in other.last.items():
        np.testing.assert_array_equal(one.last[name], values)


def test_equal_capsules_are_equal_bytes(
    capsule: Capsule, saved: Path, tmp_path: Path
) -> None:
    capsule.save(tmp_path / "again.zip")
    assert (tmp_path / "again.zip").read_bytes() == saved.read_bytes()


def test_the_last_states_are_kept(capsule: Capsule, log: ExecutionLog) -> None:
    last = capsule.failure.last
    assert len(log.time_s) > LAST_TICKS
    np.testing.assert_array_equal(last["time_s"], log.time_s[-LAST_TICKS:])
    np.testing.assert_array_equal(last["state"], log.state[:, -LAST_TICKS:])
    np.testing.assert_array_equal(last["qpos"], log.qpos[-LAST_TICKS:])


def test_a_short_log_is_kept_whole(log: ExecutionLog) -> None:
    """Even one of as many ticks as there are robots."""
    both = len(log.robots)
    short = replace(
        log,
        **{name: getattr(log, name)[:both] for name in ("time_s", "clock_s", "qpos")},
        **{
            name: getattr(log, name)[:, :both]
            for name in ("state", "reference", "command")
        },
    )
    last = Failure.of(short, (), ()).last
    np.testing.assert_array_equal(last["state"], short.state)
    np.testing.assert_array_equal(last["qpos"], short.qpos)


def test_one_bit_of_one_state_changes_the_digest(log: ExecutionLog) -> None:
    state = log.state.copy()
    state[0, 3, 1] = np.nextafter(state[0, 3, 1], np.inf)
    other = Failure.of(replace(log, state=state), (), ())
    assert other.log_digest != Failure.of(log, (), ()).log_digest


def test_unpacked_files_are_those_of_the_run(
    capsule: Capsule, quickstart_run: Path, tmp_path: Path
) -> None:
    capsule.unpack(tmp_path / "run")
    for name in ("scene.yaml", "planning.json", "plan.json", "plan.npz"):
        unpacked = (tmp_path / "run" / name).read_bytes()
        assert unpacked == (quickstart_run / name).read_bytes()


def without(path: Path, name: str) -> None:
    """Take a member out of a zip."""
    with zipfile.ZipFile(path) as archive:
        members = {item: archive.read(item) for item in archive.namelist()}
    del members[name]
    rewrite(path, members)


def rewrite(path: Path, members: dict[str, bytes]) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    path.write_bytes(buffer.getvalue())


def with_header(
    change: Callable[[dict[str, object]], object],
) -> Callable[[Path], None]:
    """Return a function that changes a capsule's header."""

    def spoil(path: Path) -> None:
        with zipfile.ZipFile(path) as archive:
            members = {item: archive.read(item) for item in archive.namelist()}
        header = json.loads(members["capsule.json"])
        change(header)
        members["capsule.json"] = json.dumps(header).encode()
        rewrite(path, members)

    return spoil


SPOILERS: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (lambda path: path.unlink(), "cannot be read"),
    "folder": (lambda path: (path.unlink(), path.mkdir()), "cannot be read"),
    "empty": (lambda path: path.write_bytes(b""), "no usable capsule"),
    "text": (lambda path: path.write_text("hello"), "no usable capsule"),
    "half": (
        lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
        "no usable capsule",
    ),
    "no plan": (lambda path: without(path, "plan.npz"), "plan.npz is missing"),
    "no header": (
        lambda path: without(path, "capsule.json"),
        "capsule.json is missing",
    ),
    "no states": (lambda path: without(path, "last.npz"), "last.npz is missing"),
    "later format": (
        with_header(lambda header: header.update(format=99)),
        "this version reads formats 1 and 2",
    ),
    "no causes": (with_header(lambda header: header.pop("causes")), "no usable"),
    "odd versions": (
        with_header(lambda header: header.update(versions=3)),
        "no usable",
    ),
    "odd arguments": (
        with_header(lambda header: header.update(arguments=7)),
        "no usable",
    ),
}


@pytest.mark.parametrize("name", SPOILERS)
def test_what_is_no_capsule_is_refused_by_name(name: str, saved: Path) -> None:
    spoil, message = SPOILERS[name]
    spoil(saved)
    with pytest.raises(FileError, match=message) as refused:
        Capsule.load(saved)
    assert str(saved) in str(refused.value)


def test_flipped_bytes_are_noticed_or_harmless(saved: Path) -> None:
    """No flip of a byte ends in anything but a capsule or a refusal."""
    content = saved.read_bytes()
    rng = random.Random(7)
    refused = 0
    for _ in range(150):
        spoilt = bytearray(content)
        spoilt[rng.randrange(len(spoilt))] ^= 1 << rng.randrange(8)
        saved.write_bytes(spoilt)
        try:
            Capsule.load(saved)
        except FileError:
            refused += 1
    assert refused > 100


def test_a_crash_is_kept_without_states(quickstart_run: Path, tmp_path: Path) -> None:
    failure = Failure.of_crash(ZeroDivisionError("division by zero"))
    Capsule.of_run(quickstart_run, {}, failure, {}).save(tmp_path / "crash.zip")
    loaded = Capsule.load(tmp_path / "crash.zip").failure
    assert loaded.causes == ("crash",)
    assert loaded.reasons == ("ZeroDivisionError: division by zero",)
    assert loaded.last == {}
