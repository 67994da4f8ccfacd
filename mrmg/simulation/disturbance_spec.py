"""Disturbance ranges as users write them, on the command line or in a YAML file.

    rolling=+30%,lag=0..80ms,position_noise=5cm

amends the default disturbances; a leading `none` starts from no disturbance instead,
and a leading `field:snow` from the spread that was found in runs on that terrain. A
YAML file is a mapping of the same keys and values, with `base: none` or
`base: field:snow` in place of the leading word. A value is a fixed one (`+30%`), a
symmetric range (`+-5%`) or a range (`-10%..+30%`); numbers without a unit are in SI.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

from mrmg.errors import UsageError, require_known
from mrmg.scene.loading.yaml_text import read_yaml
from mrmg.simulation.disturbance import (
    DEFAULT_RANGES,
    FIELD_SPREADS,
    DisturbanceRanges,
    Span,
    field_ranges,
)

_TIME = {"ms": 1e-3, "s": 1.0}
_LENGTH = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
_ANGLE = {"deg": 0.017453292519943295, "rad": 1.0}
_SPEED = {"cm/s": 1e-2, "m/s": 1.0}
_CHANGE = {"%": 1e-2}


@dataclass(frozen=True, slots=True)
class _Key:
    """What one key of a specification sets, and within which bounds.

    Attributes:
        field: of `DisturbanceRanges`.
        units: factor to SI by unit; the last one is used for printing.
        low, high: allowed, in SI.
        example: shown where a value cannot be read.
    """

    field: str
    units: Mapping[str, float]
    low: float
    high: float
    example: str


_HALF, _DOUBLE = -0.9, 10.0
_KEYS = {
    "mass": _Key("mass", _CHANGE, _HALF, _DOUBLE, "+-5%"),
    "friction": _Key("friction", _CHANGE, _HALF, _DOUBLE, "+-20%"),
    "rolling": _Key("rolling", _CHANGE, _HALF, _DOUBLE, "+30%"),
    "drive_gain": _Key("drive_gain", _CHANGE, _HALF, _DOUBLE, "-5%..0%"),
    "steering_gain": _Key("steering_gain", _CHANGE, _HALF, _DOUBLE, "+-3%"),
    "lag": _Key("lag_s", _TIME, 0.0, 5.0, "50ms"),
    "position_noise": _Key("position_noise_m", _LENGTH, 0.0, 10.0, "2cm"),
    "heading_noise": _Key("heading_noise_rad", _ANGLE, 0.0, 3.2, "1deg"),
    "speed_noise": _Key("speed_noise_m_s", _SPEED, 0.0, 10.0, "2cm/s"),
    "delay": _Key("delay_s", _TIME, 0.0, 5.0, "0..100ms"),
    "start_x": _Key("start_x_m", _LENGTH, -10.0, 10.0, "+-5cm"),
    "start_y": _Key("start_y_m", _LENGTH, -10.0, 10.0, "+-5cm"),
    "start_heading": _Key("start_heading_rad", _ANGLE, -3.2, 3.2, "+-2deg"),
    "capacity": _Key("capacity", _CHANGE, _HALF, _DOUBLE, "-10%..0%"),
}
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([a-zA-Z%/]*)")
_WORD_OF_BASE = "none"
_FIELD = "field:"


def parse_disturbance(spec: str) -> DisturbanceRanges:
    """Return the ranges of a specification: a YAML file or `key=value,...`.

    Args:
        spec: the path of a file that ends in .yaml or .yml, or the text itself; an
            empty one stands for the defaults.

    Raises:
        UsageError: naming the key or value that is wrong and what is allowed.
        FileError: if the file is no YAML.
    """
    if spec.strip().endswith((".yaml", ".yml")):
        return _of_document(read_yaml(Path(spec.strip()), source=spec.strip()), spec)
    words = [word.strip() for word in spec.split(",") if word.strip()]
    base = _base(words[0]) if words else None
    if base is not None:
        del words[0]
    pairs = []
    for word in words:
        key, equals, value = word.partition("=")
        if not equals:
            _refuse(
                f"'{word}' is not key=value, nor '{_WORD_OF_BASE}' or "
                f"'{_FIELD}TERRAIN' in the first place, nor a file that ends in .yaml"
            )
        pairs.append((key.strip(), value.strip()))
    return _amended(base or DEFAULT_RANGES, pairs)


def written_out(spec: str) -> str:
    """Return a specification that does not depend on a file, equal for equal ranges.

    Raises:
        UsageError, FileError: as `parse_disturbance` does.
    """
    return disturbance_text(parse_disturbance(spec))


def disturbance_text(ranges: DisturbanceRanges) -> str:
    """Return the shortest specification of `ranges`: what strays from the defaults."""
    words = [
        f"{name}={_value_text(key, getattr(ranges, key.field))}"
        for name, key in _KEYS.items()
        if getattr(ranges, key.field) != getattr(DEFAULT_RANGES, key.field)
    ]
    return ",".join(words)


def _of_document(document: Any, source: str) -> DisturbanceRanges:
    if not isinstance(document, dict):
        _refuse(f"{source} is no mapping of keys to values")
    word = document.pop("base", "default")
    ranges = DEFAULT_RANGES if word == "default" else _base(str(word))
    if ranges is None:
        allowed = f"default, {_WORD_OF_BASE}, {_FIELD}TERRAIN"
        _refuse(f"base is {word!r}; allowed: {allowed}")
    return _amended(ranges, ((key, str(value)) for key, value in document.items()))


def _base(word: str) -> DisturbanceRanges | None:
    """Return the ranges that a leading word stands for; None if it stands for none."""
    if word == _WORD_OF_BASE:
        return DisturbanceRanges()
    if not word.startswith(_FIELD):
        return None
    require_known("disturbance", word, [_FIELD + name for name in FIELD_SPREADS])
    return field_ranges(word.removeprefix(_FIELD))


def _amended(
    ranges: DisturbanceRanges, pairs: Iterable[tuple[str, str]]
) -> DisturbanceRanges:
    changes: dict[str, Span] = {}
    for name, value in pairs:
        require_known("disturbance: key", name, _KEYS)
        field = _KEYS[name].field
        if field in changes:
            _refuse(f"'{name}' is given twice")
        changes[field] = _span(name, value)
    return replace(ranges, **changes)


def _span(name: str, text: str) -> Span:
    key = _KEYS[name]
    if ".." in text:
        first, _, last = text.partition("..")
        low, high = _number(name, text, first), _number(name, text, last)
    elif text.startswith(("+-", "±")):
        high = _number(name, text, text.removeprefix("+-").removeprefix("±"))
        low = -high
    else:
        low = high = _number(name, text, text)
    if low > high:
        _refuse(f"{name}={text}: the range ends before it begins")
    if low < key.low or high > key.high:
        unit = list(key.units)[-1]
        factor = key.units[unit]
        _refuse(
            f"{name}={text}: allowed are {key.low / factor:g} to "
            f"{key.high / factor:g} {unit}"
        )
    return Span(low + 0.0, high + 0.0)  # no negative zeros


def _number(name: str, text: str, part: str) -> float:
    key = _KEYS[name]
    match = _NUMBER.fullmatch(part.strip())
    unit = match[2] if match else ""
    # A bare number is in SI; a change without its sign could also mean a factor.
    bare_allowed = key.units is not _CHANGE or (match and float(match[1]) == 0.0)
    if match is None or (unit not in key.units and not (unit == "" and bare_allowed)):
        _refuse(
            f"{name}={text}: not a value; expected one such as {key.example}, "
            f"in {' or '.join(key.units)}"
        )
    return float(match[1]) * key.units.get(unit, 1.0)


def _value_text(key: _Key, span: Span) -> str:
    unit = list(key.units)[-1]
    sign = "+" if key.units is _CHANGE else ""
    written: Callable[[float], str] = lambda value: (  # noqa: E731
        f"{value / key.units[unit]:{sign}.9g}{unit}"
    )
    if span.low == span.high:
        return written(span.low)
    if span.low == -span.high:
        return "+-" + written(span.high).removeprefix("+")
    return f"{written(span.low)}..{written(span.high)}"


def _refuse(text: str) -> NoReturn:
    raise UsageError(f"disturbance: {text}")
