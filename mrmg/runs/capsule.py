"""A failed execution in one file: all that is needed to make it fail again.

A capsule is a zip of the run's scene, plan and arguments, with what came of them: why
the execution failed, its last states, a digest of all of them, and the versions of the
packages that decide them.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrmg import storage
from mrmg.errors import Fault, FileError
from mrmg.scene.loading.carrying import safe_path
from mrmg.simulation.log import ExecutionLog, package_versions

CAPSULE_FORMAT = 2
"""Format 2 also has models of the user's own; format 1 is still read."""
CAPSULE_FILE = "capsule.zip"

LAST_TICKS = 250
"""Number of ticks whose states are kept: five seconds."""

_RUN_FILES = ("scene.yaml", "planning.json", "plan.json", "plan.npz")
_STATES = ("time_s", "clock_s", "state", "reference", "command", "qpos")
_HEADER = "capsule.json"
_LAST = "last.npz"
_EPOCH = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """How an execution failed.

    Attributes:
        causes: kinds of failure, as the audit names them; "crash" where the program
            itself broke down.
        reasons: one sentence each.
        log_digest: of the execution's log; "" after a crash.
        last: the last states by name of the log's arrays, up to `LAST_TICKS` of them.
        versions: of the packages that decided the outcome.
    """

    __pydantic_config__ = storage.WITH_ARRAYS

    causes: tuple[str, ...]
    reasons: tuple[str, ...]
    log_digest: str
    last: Mapping[str, np.ndarray]
    versions: Mapping[str, str]

    @staticmethod
    def of(
        log: ExecutionLog, causes: tuple[str, ...], reasons: tuple[str, ...]
    ) -> Failure:
        """Return the failure that a log and its audit show."""
        # Time runs along the second axis of what is kept by robot.
        last = {
            name: values[:, -LAST_TICKS:]
            if len(values) != len(log.time_s)
            else values[-LAST_TICKS:]
            for name in _STATES
            for values in [getattr(log, name)]
        }
        return Failure(
            causes=causes,
            reasons=reasons,
            log_digest=log.digest,
            last=last,
            versions=log.versions,
        )

    @staticmethod
    def of_crash(error: Exception) -> Failure:
        """Return the failure of a program that broke down before there was a log."""
        return Failure(
            causes=("crash",),
            reasons=(f"{type(error).__name__}: {error}",),
            log_digest="",
            last={},
            versions=package_versions(),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Capsule:
    """A failed execution.

    Attributes:
        arguments: of the run, as JSON data.
        failure: what came of it.
        files: content of the run folder's files that it was made from, by name.
    """

    arguments: Mapping[str, Any]
    failure: Failure
    files: Mapping[str, bytes]

    @staticmethod
    def of_run(
        folder: Path,
        arguments: Mapping[str, Any],
        failure: Failure,
        carried: Mapping[str, bytes],
    ) -> Capsule:
        """Return the capsule of an execution of the plan that lies in a run folder.

        Args:
            folder: of the run.
            arguments: of the run, as JSON data.
            failure: what came of it.
            carried: the scene and its models (`scene.loading.carrying`).
        """
        files = {name: (folder / name).read_bytes() for name in _RUN_FILES}
        return Capsule(arguments=arguments, failure=failure, files={**files, **carried})

    def save(self, path: Path) -> None:
        """Write the capsule; equal ones give equal bytes."""
        failure = asdict(self.failure)
        last = storage.array_bytes(failure.pop("last"))
        header = {"format": CAPSULE_FORMAT, "arguments": self.arguments, **failure}
        members = {
            _HEADER: storage.canonical_json(header).encode(),
            **self.files,
            _LAST: last,
        }
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in members.items():
                info = zipfile.ZipInfo(name, _EPOCH)
                info.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(info, content)
        storage.write_bytes(path, buffer.getvalue())

    @staticmethod
    def load(path: Path) -> Capsule:
        """Read a capsule that `save` wrote.

        Raises:
            FileError: if the file is missing, damaged, or no capsule of this format.
        """
        try:
            members = _members(path)
            header = storage.json_of(members.pop(_HEADER))
            if header.pop("format") not in (1, CAPSULE_FORMAT):
                raise ValueError(f"this version reads formats 1 and {CAPSULE_FORMAT}")
            arguments = dict(header.pop("arguments"))
            last = storage.arrays_of(members.pop(_LAST), _LAST)
            failure = storage.typed(Failure, {**header, "last": last})
            return Capsule(arguments=arguments, failure=failure, files=members)
        except OSError as error:
            raise _refused(path, f"cannot be read ({error.strerror})") from error
        except Exception as error:  # flipped bits make zipfile and zlib raise anything
            raise _refused(path, f"no usable capsule ({error})") from error

    def lies_in(self, folder: Path) -> bool:
        """Return whether a folder holds the scene and the plan of this capsule."""
        return all(
            (folder / name).exists() and (folder / name).read_bytes() == content
            for name, content in self.files.items()
        )

    def unpack(self, folder: Path) -> None:
        """Write the scene with its models, and the plan, into a run folder."""
        for name, content in self.files.items():
            storage.write_bytes(folder / name, content)


def _members(path: Path) -> dict[str, bytes]:
    """Return the content of exactly those members that a capsule has."""
    expected: tuple[str, ...] = (_HEADER, *_RUN_FILES, _LAST)
    with zipfile.ZipFile(path) as archive:
        missing = sorted({*expected} - {*archive.namelist()})
        if missing:
            raise ValueError(f"{missing[0]} is missing")
        models = {*archive.namelist()} - {*expected}
        unsafe = sorted(name for name in models if not safe_path(name))
        if unsafe:
            raise ValueError(f"{unsafe[0]!r} is no file of a capsule")
        found = storage.unpacked(archive, path.stat().st_size)
        return {name: found[name] for name in (*expected, *sorted(models))}


def _refused(path: Path, message: str) -> FileError:
    remedy = f"a failed execution leaves one as {CAPSULE_FILE} in its run folder"
    return FileError(str(path), [Fault("", f"{message}; {remedy}")])
