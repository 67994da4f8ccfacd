"""Writing and reading files so that a killed process leaves nothing half-written."""

from __future__ import annotations

import errno
import hashlib
import io
import json
import math
import os
import secrets
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mrmg.errors import Fault, RunFolderError
from mrmg.interruption import cleaned_up_by

_Kind = TypeVar("_Kind")

UNREADABLE = (
    *(OSError, ValueError, LookupError, TypeError, AttributeError),
    *(ArithmeticError, MemoryError, RecursionError),
)
"""What reading a file raises that is missing, damaged, or of another structure."""

MAX_UNPACKED_BYTES = 2**28
MAX_UNPACKED_RATIO = 100
"""A packed file that is larger unpacked than both of these allow is not unpacked."""


UNFINISHED = ".part-"
"""Begins the name of what is not yet in its place."""


def remove_unfinished(folder: Path) -> None:
    """Remove what a kill left of files, and of folders, that were made in a folder."""
    for leftover in folder.glob(f"{UNFINISHED}*"):
        if leftover.is_dir():
            shutil.rmtree(leftover, ignore_errors=True)
        else:
            leftover.unlink(missing_ok=True)


def unfinished_path(path: Path) -> Path:
    """Return where a file or folder can grow before it is put in its place."""
    return path.parent / f"{UNFINISHED}{secrets.token_hex(4)}-{path.name}"


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path; rename it onto `path` when all went well."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = unfinished_path(path)
    remove = partial(temporary.unlink, missing_ok=True)
    with _errors_about(path, temporary):
        if path.exists() and not (path.is_file() or path.is_dir()):
            what = "a device or a pipe, and a file is needed there"
            raise OSError(errno.EINVAL, what)
        temporary.touch(exist_ok=False)
        try:
            with cleaned_up_by(remove):
                yield temporary
                os.replace(temporary, path)
        finally:
            remove()


@contextmanager
def _errors_about(path: Path, temporary: Path) -> Iterator[None]:
    """Let errors name the file that is wanted, not the temporary one or none."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename not in (None, str(temporary)):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to `path` atomically."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` atomically, in UTF-8; what that lacks is escaped.

    That is in names of files that are no text to the system.
    """
    write_bytes(path, text.encode(errors="backslashreplace"))


def canonical_json(value: Any) -> str:
    """Return `value` as JSON with sorted keys: equal values give equal bytes.

    Dataclasses are written by the names of their fields, NumPy's numbers as Python's.
    """
    text = json.dumps(value, sort_keys=True, indent=1, allow_nan=False, default=_plain)
    return text + "\n"


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else asdict(value)


def write_json(path: Path, value: Any) -> None:
    """Write `value` as canonical JSON, atomically."""
    write_text(path, canonical_json(value))


def read_json(path: Path) -> Any:
    """Read a JSON file that `write_json` wrote.

    Raises:
        ValueError: if it is damaged: numbers that are not finite, half a character, or
            levels of nesting that nobody wrote included.
    """
    return json_of(path.read_bytes())


def json_of(content: bytes) -> Any:
    """Return the value of JSON; see `read_json`."""
    try:
        value = json.loads(content, parse_float=_finite, parse_constant=_finite)
        if b"\\ud" in content.lower():  # may stand for one half of a character alone
            json.dumps(value, ensure_ascii=False).encode()
    except RecursionError:
        raise ValueError("nested too deeply") from None
    return value


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text} is not a finite number")
    return value


def typed(kind: type[_Kind], data: Any) -> _Kind:
    """Return plain data as a value of a dataclass, all of its fields checked.

    Raises:
        ValueError: if a field is missing, unknown or of another type; names the first.
    """
    from pydantic import TypeAdapter, ValidationError

    try:
        return TypeAdapter(kind).validate_python(data)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ValueError(f"{place}: {first['msg']}") from error


WITH_ARRAYS = {"arbitrary_types_allowed": True}
"""`__pydantic_config__` of dataclasses with arrays, for `typed`."""

IN_SCHEMAS = {
    "extra": "forbid",
    "use_attribute_docstrings": True,
    "json_schema_serialization_defaults_required": True,
}
"""That of dataclasses in JSON Schemas: they have all keys, and state what they mean."""


@contextmanager
def damage_reported(path: Path, found: str, remedy: str) -> Iterator[None]:
    """Refuse a file of a run that cannot be read within the block.

    Args:
        path: of the file.
        found: what it turned out to be, such as "no readable plan".
        remedy: what the user can do, such as "run 'mrmg plan'".

    Raises:
        RunFolderError: if the file is missing, damaged or of another structure.
    """
    try:
        yield
    except UNREADABLE as error:
        fault = Fault(path.name, f"{found} ({error}); {remedy}")
        raise RunFolderError(str(path.parent), [fault]) from error


def of_format(content: bytes, version: int) -> dict[str, Any]:
    """Return the other keys of the content of a JSON file of a format.

    Raises:
        ValueError: if it is of another format; others of `UNREADABLE` as `json_of`.
    """
    keys: dict[str, Any] = json_of(content)
    if keys.pop("format") != version:
        raise ValueError(f"this version reads format {version} only")
    return keys


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write named arrays to an `.npz` without pickle, atomically and byte-stable."""
    write_bytes(path, array_bytes(arrays))


def array_bytes(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return named arrays as the content of an `.npz` without pickle, byte-stable."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **dict(sorted(arrays.items())))
    return buffer.getvalue()


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read the arrays of an `.npz`; refuses pickled content.

    Raises:
        ValueError: if the file is damaged.
    """
    return arrays_of(path.read_bytes(), path.name)


def arrays_of(content: bytes, name: str) -> dict[str, np.ndarray]:
    """Return the arrays of an `.npz`; refuses pickled content.

    Args:
        content: of the file.
        name: what an error calls it.

    Raises:
        ValueError: if it is damaged.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            return {
                member.removesuffix(".npy"): array_of(data)
                for member, data in unpacked(archive, len(content)).items()
            }
    except Exception as error:  # readers raise anything, of tokens and of zlib, too
        reason = str(error).partition("\n")[0]
        raise ValueError(f"{name} is damaged: {reason}") from error


def unpacked(archive: zipfile.ZipFile, packed_bytes: int) -> dict[str, bytes]:
    """Return the members of a zip by name, none of which lies about its size.

    Raises:
        ValueError: if they are far larger than a file of `packed_bytes` can mean.
    """
    unpacked_bytes = sum(info.file_size for info in archive.infolist())
    if unpacked_bytes > max(MAX_UNPACKED_BYTES, MAX_UNPACKED_RATIO * packed_bytes):
        raise ValueError(
            f"{packed_bytes} bytes unpack to {unpacked_bytes}; allowed are "
            f"{MAX_UNPACKED_BYTES}, or {MAX_UNPACKED_RATIO} times as many"
        )
    return {info.filename: archive.read(info) for info in archive.infolist()}


def array_of(data: bytes) -> np.ndarray:
    """Return the array of an .npy, which must have the size that its header states.

    Raises:
        Exception: of many kinds, if it is damaged; it refuses pickled content.
    """
    file = io.BytesIO(data)
    array = np.lib.format.read_array(file, allow_pickle=False)  # refuses too few bytes
    if file.read(1):
        raise ValueError(f"more than the {array.nbytes} bytes of its array are there")
    array.setflags(write=False)
    return np.asarray(array)


def user_cache_folder() -> Path:
    """Return the folder for what this machine need not work out twice.

    Where that of the user cannot be written, as that of another one or of a machine
    that is read only, it is one of the user's own among temporary files. Where there is
    none either, nothing can be made in what is returned.
    """
    with suppress(OSError, RuntimeError):  # a user may have no home
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folder = base / "mrmg"
        nearest = next(path for path in (folder, *folder.parents) if path.exists())
        if is_writable(nearest):
            return folder
    user = os.getuid() if sys.platform != "win32" else 0  # Windows calls all owners 0
    with suppress(OSError):
        folder = Path(tempfile.gettempdir(), f"mrmg-{user}")
        folder.mkdir(mode=0o700, exist_ok=True)
        if folder.lstat().st_uid == user and is_writable(folder):
            return folder  # what is run from there comes from nobody else
    return Path(os.devnull, "mrmg")


def is_writable(folder: Path) -> bool:
    """Return whether files can be made in a folder."""
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def digest(text: str) -> str:
    """Return a short hexadecimal fingerprint of `text`."""
    return bytes_digest(text.encode())


def bytes_digest(data: bytes) -> str:
    """Return a short hexadecimal fingerprint of `data`."""
    return hashlib.sha256(data).hexdigest()[:16]
