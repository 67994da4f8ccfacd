"""Readers of argument values, for the command line and the Python API alike.

Each takes a text or a value of its kind, returns the value, and raises ValueError with
a message that states what is allowed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from typing import Any, TypeVar

from mrmg.errors import UsageError
from mrmg.ranges import Range
from mrmg.scene.margins import margins_from
from mrmg.scene.objective import Objective

LAST_PORT = 65535

_Number = TypeVar("_Number", int, float)


def _reader(read: Callable[[str], _Number], allowed: Range) -> Callable[[Any], _Number]:
    """Return a reader of numbers in a range; `read` makes a number of a text."""

    def number_of(value: Any) -> _Number:
        with suppress(ValueError):  # a text that is no number is refused below, too
            number = read(str(value))
            if number in allowed:
                return number
        raise ValueError(f"{value!r} is not {allowed}")

    return number_of


seed = _reader(int, Range(whole=True))
"""Read a seed: a whole number of at least 0."""

count = _reader(int, Range(1, whole=True))
"""Read a number of things: a whole number of at least 1."""

port = _reader(int, Range(1, LAST_PORT, whole=True))
"""Read the number of a port."""

positive = _reader(float, Range(ends="(]"))
"""Read a positive number."""

time = _reader(float, Range())
"""Read a time: a number of at least 0."""

share = _reader(float, Range(0.0, 1.0, ends="[)"))
"""Read a share: a number of at least 0 and below 1."""


def switch(value: Any) -> bool:
    """Read a switch: True or False."""
    if not isinstance(value, bool):
        raise ValueError(f"{value!r} is neither True nor False")
    return value


def name(value: Any) -> str:
    """Read the name of a planner or router."""
    if not isinstance(value, str):
        raise ValueError(
            f"{value!r} is not a name; `mrmg.plan` takes objects, a run takes names, "
            "which packages add by entry points"
        )
    return value


def words(value: Any) -> tuple[str, ...]:
    """Read several texts."""
    listed = isinstance(value, Collection) and not isinstance(value, str)
    if not listed or not all(isinstance(word, str) for word in value):
        raise ValueError(f"{value!r} is not a sequence of texts")
    return tuple(value)


def objective(value: Any) -> str | dict[str, float]:
    """Read an objective as scene files have it.

    Allowed are a name, weights of energy and makespan such as "1:50" or
    {"energy": 1, "makespan": 50}, and an `Objective`.
    """
    if value in ("energy", "makespan"):
        return str(value)
    if isinstance(value, Objective):
        weights: tuple[Any, ...] = (value.energy_weight, value.makespan_weight)
    elif isinstance(value, Mapping) and {*value} <= {"energy", "makespan"}:
        weights = (value.get("energy", 0.0), value.get("makespan", 0.0))
    else:
        weights = tuple(str(value).split(":"))
    try:
        energy, makespan = (time(weight) for weight in weights)
    except ValueError:
        energy = makespan = 0.0
    if energy + makespan == 0.0:
        raise ValueError(
            f"{value!r} is neither energy nor makespan nor two weights such as 1:50"
        )
    return {"energy": energy, "makespan": makespan}


def margins(value: Any) -> dict[str, float]:
    """Read margins: "obstacle=0.1,robot=0.3", or a mapping of these keys."""
    try:
        read = margins_from(value)
    except UsageError as error:
        raise ValueError(str(error).removeprefix("margins: ")) from error
    stated = read.entry.items()
    return {key: margin_m for key, margin_m in stated if margin_m is not None}


def size(value: Any) -> tuple[int, int]:
    """Read a size in pixels: "1280x720" or (1280, 720)."""
    try:
        parts = value.lower().split("x") if isinstance(value, str) else value
        width, height = (int(str(part)) for part in parts)
    except (TypeError, ValueError):
        width = height = 0
    if min(width, height) < 1:
        raise ValueError(f"{value!r} is not a size such as 1280x720")
    return width, height
