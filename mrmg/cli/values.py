"""Reading the values of command line arguments."""

from __future__ import annotations

import argparse
import math


def seed(text: str) -> int:
    """Read a seed: a whole number of at least 0."""
    return _whole(text, at_least=0)


def count(text: str) -> int:
    """Read a number of things: a whole number of at least 1."""
    return _whole(text, at_least=1)


def fps(text: str) -> int:
    """Read a number of frames per second."""
    return _whole(text, at_least=1)


def _whole(text: str, *, at_least: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = at_least - 1
    if value < at_least:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a whole number of at least {at_least}"
        )
    return value


def positive(text: str) -> float:
    """Read a positive number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number")
    return value


def time(text: str) -> float:
    """Read a time: a number of at least 0."""
    return 0.0 if text.strip() in {"0", "0.0"} else positive(text)


def share(text: str) -> float:
    """Read a share: a number of at least 0 and less than 1."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < 1.0:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a share: a number of at least 0 and less than 1"
        )
    return value


def objective(text: str) -> str | dict[str, float]:
    """Read an objective: a name, or weights of energy and makespan such as 1:50."""
    if text in ("energy", "makespan"):
        return text
    try:
        energy, makespan = (time(part) for part in text.split(":"))
    except (ValueError, argparse.ArgumentTypeError):
        energy = makespan = 0.0
    if energy + makespan == 0.0:
        raise argparse.ArgumentTypeError(
            f"{text!r} is neither energy nor makespan nor two weights such as 1:50"
        )
    return {"energy": energy, "makespan": makespan}


def size(text: str) -> tuple[int, int]:
    """Read a size in pixels such as 1280x720."""
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        width = height = 0
    if min(width, height) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 1280x720")
    return width, height
