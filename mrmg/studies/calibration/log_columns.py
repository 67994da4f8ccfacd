"""Columns of logs by what they hold, in SI units: of CSV files with a line of names."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mrmg.errors import Fault, FileError

MAX_BYTES = 200_000_000
"""Largest log that is read: a day at 50 rows a second has a tenth of it."""

MAX_VALUE = 1e10
"""Largest magnitude of a value, in SI units: beyond any robot and any time since 1970.

Squares of what is computed from such values are still finite.
"""

LEAST_ROWS = 10
"""Fewest rows of which a power can be found."""

COLUMNS = {
    "time": ("time", "t", "timestamp"),
    "speed_left": ("vell", "vleft", "velleft", "speedleft", "velocityleft"),
    "speed_right": ("velr", "vright", "velright", "speedright", "velocityright"),
    "speed": ("v", "speed", "vel", "velocity"),
    "yaw_rate": ("yawrate", "omega", "w", "angularvelocity"),
    "power": ("power", "p"),
    "current_left": ("curl", "ileft", "curleft", "currentleft"),
    "current_right": ("curr", "iright", "curright", "currentright"),
    "current": ("current", "i", "cur"),
    "voltage_left": ("voltl", "uleft", "voltleft", "voltageleft"),
    "voltage_right": ("voltr", "uright", "voltright", "voltageright"),
    "voltage": ("voltage", "u", "volt", "volts"),
}
"""Names of columns by what they hold; case, underscores and units do not count."""

_SPEEDS = {"m/s": 1.0, "km/h": 1 / 3.6, "cm/s": 0.01, "mm/s": 0.001, "mph": 0.44704}
_RATES = {"rad/s": 1.0, "deg/s": math.pi / 180.0, "°/s": math.pi / 180.0}
UNITS = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9},
    "speed": _SPEEDS,
    "yaw_rate": _RATES,
    "power": {"W": 1.0, "kW": 1e3},
    "current": {"A": 1.0, "mA": 1e-3},
    "voltage": {"V": 1.0, "mV": 1e-3},
}
"""Units of columns by what they hold, and what one is in SI units."""

_NO_DIGITS = str.maketrans("", "", "0123456789")
_SPELLINGS = {"mps": "ms", "kmph": "kmh", "kph": "kmh", "ms1": "ms"}
_SPELLINGS |= {"sec": "s", "radps": "rads", "rads1": "rads"}
_SPELLINGS |= {"degps": "degs", "dps": "degs", "degs1": "degs"}


def read_columns(path: Path, source: str) -> tuple[dict[str, np.ndarray], list[int]]:
    """Return the known columns of a file, and the line of each row.

    Columns are in SI units by what they hold, each of shape (n,).

    Args:
        path: of a CSV file, separated by commas, semicolons or tabs.
        source: its name in messages.

    Raises:
        FileError: if the file cannot be read, or holds no log.
    """
    text = _text(path, source)
    head = text.lstrip().partition("\n")[0]
    delimiter = max(",;\t", key=head.count)
    reader = csv.reader(text.splitlines(), delimiter=delimiter)
    try:
        # Lines are those of the file, blank ones counted.
        rows = [(reader.line_num, row) for row in reader if any(row)]
    except csv.Error as error:
        raise FileError(source, [Fault("", f"is no CSV: {error}")]) from error
    names = rows[0][1] if rows else []
    known = _known(names, source)
    if len(rows) <= LEAST_ROWS:
        message = f"has {max(len(rows) - 1, 0)} rows; at least {LEAST_ROWS} are needed"
        raise FileError(source, [Fault("", message)])
    if "time" not in known:
        message = f"has no column 'time'; it has {', '.join(names)}"
        raise FileError(source, [Fault("columns", message)])
    values = {
        kind: _values(rows[1:], at, _unit(names[at], kind, source), source)
        for kind, at in known.items()
    }
    return values, [line for line, _ in rows[1:]]


def _text(path: Path, source: str) -> str:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise FileError(source, [Fault("", f"larger than {MAX_BYTES} bytes")])
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is no text in UTF-8"
        raise FileError(source, [Fault("", f"cannot be read: {reason}")]) from error


def _known(names: list[str], source: str) -> dict[str, int]:
    kinds = [_kind(name)[0] for name in names]
    twice = {kind for kind in kinds if kind and kinds.count(kind) > 1}
    if twice:
        message = f"{' and '.join(sorted(twice))} named by more than one column"
        raise FileError(source, [Fault("columns", message)])
    return {kind: at for at, kind in enumerate(kinds) if kind}


def _values(
    rows: Iterable[tuple[int, list[str]]], column: int, unit: float, source: str
) -> np.ndarray:
    return np.array([_number(row, column, unit, line, source) for line, row in rows])


def _number(row: list[str], column: int, unit: float, line: int, source: str) -> float:
    text = row[column] if column < len(row) else ""
    try:
        value = float(text) * unit
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        message = f"got '{text[:40]}'; expected a finite number, such as 0.25"
    elif abs(value) > MAX_VALUE:
        message = f"got '{text[:40]}'; expected at most {MAX_VALUE / unit:g}"
    else:
        return value
    raise FileError(source, [Fault(f"column {column + 1}", message, line=line)])


def _kind(name: str) -> tuple[str, str]:
    """Return what a column of that name holds, and the unit that the name ends with.

    Both are "" for nothing that is known.
    """
    plain = _plain(re.sub(r"[\[(].*", "", name)).translate(_NO_DIGITS)
    for kind, names in COLUMNS.items():
        for known in names:
            suffix = plain.removeprefix(known)
            if plain.startswith(known) and suffix in {"", *_factors(kind)}:
                return kind, suffix
    return "", ""


def _unit(name: str, kind: str, source: str) -> float:
    """Return what the unit that a column's name states is in SI units.

    Raises:
        FileError: if it states another one than those allowed.
    """
    _, _, stated = re.sub(r"[\])].*", "", name.replace("(", "[")).partition("[")
    unit = _plain(stated) or _kind(name)[1]
    factors = _factors(kind)
    if not unit:
        return 1.0
    if unit not in factors:
        allowed = ", ".join(_units(kind))
        message = (
            f"column '{name}': the unit '{stated}' is not known; allowed: {allowed}; "
            "convert the column, or rename it if that is no unit"
        )
        raise FileError(source, [Fault("columns", message)])
    return factors[unit]


def _units(kind: str) -> dict[str, float]:
    return UNITS[kind.removesuffix("_left").removesuffix("_right")]


def _factors(kind: str) -> dict[str, float]:
    """Return the units of a column as `_plain` spells them."""
    found = {_plain(unit): factor for unit, factor in _units(kind).items()}
    return found | {
        spelling: found[plain]
        for spelling, plain in _SPELLINGS.items()
        if plain in found
    }


def _plain(unit: str) -> str:
    return re.sub(r"[^a-z0-9°µ]", "", unit.lower().replace("μ", "µ"))
