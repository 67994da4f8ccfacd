"""What benches share: seeds, versions, finished trials and the document of results.

With --output FILE a bench keeps one JSON object a line, one line a finished trial, and
the same command goes on from there after an interruption. With --json FILE it writes
one JSON document when it is through:

- `bench`: name of the tool;
- `protocol`: the tool's options by their names (`seeds` one by one), and `versions` by
  package, `machine`, its `load` (average of processes that want a core, over the last
  5 min), `date`, `command`, `commit` (null outside a checkout; `-changed` where files
  differ from it) and `state`, a fingerprint of code, models, scenes and versions;
- `rows`: the rows of the table that it prints, numbers as numbers, null for none; a
  bench of several tables has one more key for each of the others;
- `ok`: whether everything held; the exit code states the same.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import platform
import shlex
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

import mrmg
from mrmg import shipped, storage
from mrmg.errors import MrmgError

Row = dict[str, Any]

_FILES = ("json", "output", "figure", "runs")
"""Options that say where results go, and decide nothing."""

_ROOT = Path(__file__).parents[1]

_RESULTS = ("BENCHMARKS.md", "tools/results")
"""What benches write themselves, by `tools/benchmarks --run`."""

_PACKAGES = ("mrmg", "mujoco", "casadi", "numpy", "scipy", "shapely", "numba")


def seed_range(text: str) -> range:
    """Return the seeds `first-last`, or the single one."""
    first, _, last = text.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    if not seeds:
        raise ValueError(f"no seeds from {first} to {last}")
    return seeds


def versions() -> str:
    """Return the versions of everything that decides a figure."""
    packages = (f"{name} {found}" for name, found in _versions().items())
    return f"{', '.join(packages)}, {cpu()}"


def _versions() -> dict[str, str]:
    packages = {name: version(name) for name in _PACKAGES}
    return packages | {"Python": platform.python_version()}


@cache
def state() -> str:
    """Return a fingerprint of sources, models, scenes, versions and processor.

    What was measured in one state is not measured again in the same, and shows nothing
    of another.
    """
    package = Path(mrmg.__file__).parent
    files = [
        *package.rglob("*.py"),
        *Path(__file__).parent.rglob("*.py"),
        *(path for path in shipped.models_folder().rglob("*") if path.is_file()),
        *(path for path in shipped.scenes_folder().rglob("*") if path.is_file()),
    ]
    digest = hashlib.sha256(versions().encode())
    for path in sorted(files):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def commit(root: Path = _ROOT) -> str | None:
    """Return the commit of a checkout, marked where tracked files differ from it.

    Results that other benches have just stored do not count.
    """
    results = (f":(exclude){path}" for path in _RESULTS)
    calls = (
        ("rev-parse", "--short=12", "HEAD"),
        ("status", "--porcelain", "--untracked-files=no", "--", ".", *results),
    )
    try:
        found, changes = (
            subprocess.run(
                ["git", *call], cwd=root, capture_output=True, text=True, check=True
            ).stdout.strip()
            for call in calls
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return f"{found}-changed" if changes else found


def cpu() -> str:
    """Return the processor's name."""
    info = Path("/proc/cpuinfo")
    if not info.exists():
        return platform.processor()
    lines = info.read_text().splitlines()
    names = [line.partition(":")[2].strip() for line in lines if "model name" in line]
    return f"{names[0]} x {len(names)}" if names else platform.machine()


def run(main: Callable[[], int]) -> NoReturn:
    """Run a bench and leave with its exit code, or with that of what went wrong."""
    try:
        sys.exit(main())
    except MrmgError as error:
        print(error, file=sys.stderr)
        sys.exit(int(error.exit_code))
    except KeyboardInterrupt:
        print(
            "interrupted: with --output FILE the same command goes on from here",
            file=sys.stderr,
        )
        sys.exit(130)


def add_file_options(parser: argparse.ArgumentParser) -> None:
    """Let a bench take --output and --json."""
    parser.add_argument(
        "--output",
        type=_file,
        metavar="FILE",
        help="JSONL, one line a finished trial: the same command goes on from there "
        "after an interruption; lines of other code or arguments are dropped",
    )
    parser.add_argument(
        "--json",
        type=_file,
        metavar="FILE",
        help="one JSON document at the end: bench, protocol (options, versions, "
        "machine, state), rows (of the table, null for none), ok",
    )


def _file(text: str) -> Path:
    """Return a path that can be written to; a bench is too long to find out late."""
    path = Path(text)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise argparse.ArgumentTypeError(f"{text}: {error.strerror}") from error
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{text} is a folder: name a file")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise argparse.ArgumentTypeError(f"{text} cannot be written: name another")
    return path


def write_document(
    options: argparse.Namespace,
    bench: str,
    rows: Sequence[Row],
    ok: bool,
    **tables: Sequence[Row],
) -> None:
    """Write the document of a bench that is through, if it is asked for.

    Args:
        options: of the command line; names the file.
        bench: name of the tool.
        rows: of its table.
        ok: whether everything held.
        tables: its other tables by their keys.
    """
    if options.json is None:
        return
    chosen = {name: x for name, x in vars(options).items() if name not in _FILES}
    measured = {
        "versions": _versions(),
        "machine": cpu(),
        "date": datetime.now(UTC).date().isoformat(),
        "load": os.getloadavg()[1],
        "command": _command(bench),
        "commit": commit(),
        "state": state(),
    }
    document = {"bench": bench, "protocol": chosen | measured, "rows": rows, "ok": ok}
    storage.write_json(options.json, _plain(document | tables))


def _command(bench: str) -> str:
    """Return the command line without what says where results go."""
    line, left = [f"tools/{bench}"], sys.argv[1:]
    while left:
        word = left.pop(0)
        name, joined, _ = word.partition("=")
        if name.removeprefix("--") in _FILES and name.startswith("--"):
            del left[: 0 if joined else 1]
            continue
        line.append(os.path.relpath(word, _ROOT) if os.path.isabs(word) else word)
    return shlex.join(line)


def _plain(value: Any) -> Any:
    """Return what JSON has for a value: null for numbers that are not finite."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, range)):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return os.path.relpath(value, _ROOT) if isinstance(value, Path) else value


class Trials:
    """The finished trials of a bench, in a file of JSON lines if there is one.

    Each line has the trial's row, and what decides it: `state`, and in `trial` the
    bench's arguments and what is tried. Lines of another state or other arguments, and
    one that a killed process left half-written, are dropped; the file as it was is kept
    beside it, its name ending in `.old`.
    """

    def __init__(self, path: Path | None, **arguments: Any) -> None:
        """Read the trials that are finished.

        Args:
            path: of the file; None to keep none.
            arguments: those that decide what comes of every trial.
        """
        self._path = path
        self._arguments = _plain(arguments)
        self._rows: dict[str, Row] = {}
        if path is None or not path.exists():
            return
        text = path.read_text(errors="replace")
        lines = text.splitlines()
        used = [line for line in lines if self._read(line)]
        if used:
            print(f"{len(used)} trials are in {path} and are not made again")
        if len(used) < len(lines):
            old = path.with_name(f"{path.name}.old")
            storage.write_text(old, text)
            dropped = f"{len(lines) - len(used)} lines of other code or arguments"
            output = f"{path}: {dropped}, or broken, are dropped; {old} has them"
            print(output, file=sys.stderr)
        whole = "".join(f"{line}\n" for line in used)
        if whole != text:
            storage.write_text(path, whole)

    def _read(self, line: str) -> bool:
        """Take a line over; return whether it is of this state and arguments."""
        try:
            row = json.loads(line)
            trial, of = row.pop("trial"), row.pop("state")
            fits = bool(of == state() and {**trial, **self._arguments} == trial)
        except (ValueError, KeyError, TypeError, AttributeError):
            return False
        if fits:
            self._rows[json.dumps(trial, sort_keys=True)] = row
        return fits

    def get(self, **case: Any) -> Row | None:
        """Return the row of a trial, or None if it is not finished."""
        return self._rows.get(json.dumps(self._trial(case), sort_keys=True))

    def add(self, row: Row, **case: Any) -> Row:
        """Keep and return the row of a finished trial."""
        trial = self._trial(case)
        self._rows[json.dumps(trial, sort_keys=True)] = row
        if self._path is not None:
            line = json.dumps(row | {"state": state(), "trial": trial}, sort_keys=True)
            with self._path.open("a") as file:
                file.write(f"{line}\n")
        return row

    def row(self, make: Callable[[], Row], **case: Any) -> Row:
        """Return the row of a trial, made if it is not finished."""
        row = self.get(**case)
        return self.add(make(), **case) if row is None else row

    def _trial(self, case: Mapping[str, Any]) -> Row:
        return {**self._arguments, **_plain(case)}
