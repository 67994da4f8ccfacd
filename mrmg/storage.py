"""Writing and reading files so that a killed process leaves nothing half-written."""

from __future__ import annotations

import hashlib
import io
import json
import os
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mrmg.interruption import cleaned_up_by


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path; rename it onto `path` when all went well."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with _errors_about(path):
        handle, name = tempfile.mkstemp(
            dir=path.parent, prefix=".part-", suffix=f"-{path.name}"
        )
    os.close(handle)
    temporary = Path(name)
    remove = partial(temporary.unlink, missing_ok=True)
    try:
        with cleaned_up_by(remove):
            yield temporary
            os.chmod(temporary, 0o644)
            with _errors_about(path):
                os.replace(temporary, path)
    finally:
        remove()


@contextmanager
def _errors_about(path: Path) -> Iterator[None]:
    """Let errors name the file that is wanted, not the temporary one."""
    try:
        yield
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from error


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to `path` atomically."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` atomically, in UTF-8."""
    write_bytes(path, text.encode())


def canonical_json(value: Any) -> str:
    """Return `value` as JSON with sorted keys: equal values give equal bytes."""
    return json.dumps(value, sort_keys=True, indent=1, allow_nan=False) + "\n"


def write_json(path: Path, value: Any) -> None:
    """Write `value` as canonical JSON, atomically."""
    write_text(path, canonical_json(value))


def read_json(path: Path) -> Any:
    """Read a JSON file."""
    return json.loads(path.read_text())


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
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            return {key: archive[key] for key in archive.files}
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError) as error:
        # RuntimeError covers a flipped flag that makes a member look encrypted.
        raise ValueError(f"{name} is damaged: {error}") from error


def user_cache_folder() -> Path:
    """Return the folder for what this machine need not work out twice."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "mrmg"


def digest(text: str) -> str:
    """Return a short hexadecimal fingerprint of `text`."""
    return bytes_digest(text.encode())


def bytes_digest(data: bytes) -> str:
    """Return a short hexadecimal fingerprint of `data`."""
    return hashlib.sha256(data).hexdigest()[:16]
