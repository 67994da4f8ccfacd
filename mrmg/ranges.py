"""Ranges that numbers must be in, and how they are named to a user."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any

from mrmg.errors import UsageError


@dataclass(frozen=True, slots=True)
class Range:
    """Numbers that are allowed.

    Attributes:
        low, high: its ends; only finite numbers are in it.
        ends: "[" or "(", and "]" or ")": whether low and high are in it.
        whole: whether only whole numbers are.
        optional: whether None is, too.
    """

    low: float = 0.0
    high: float = math.inf
    ends: str = "[]"
    whole: bool = False
    optional: bool = False

    def __contains__(self, value: object) -> bool:
        if value is None:
            return self.optional
        kind = Integral if self.whole else Real
        if isinstance(value, bool) or not isinstance(value, kind):
            return False
        number: Any = value  # not as a float, which not every whole number fits in
        above = number > self.low if self.ends[0] == "(" else number >= self.low
        below = number < self.high if self.ends[1] == ")" else number <= self.high
        return bool(above and below and number < math.inf)

    def __str__(self) -> str:
        least = "above" if self.ends[0] == "(" else "of at least"
        most = "below" if self.ends[1] == ")" else "at most"
        words = f"{'whole ' * self.whole}number {least} {self.low:g}"
        if self.high < math.inf:
            words += f" and {most} {self.high:g}"
        elif words == "number above 0":
            words = "positive number"
        return f"a {words}{', or None' * self.optional}"


def require_range(name: str, value: object, allowed: Range) -> None:
    """Refuse a value out of its range.

    Raises:
        UsageError: naming it, and what is allowed.
    """
    if value not in allowed:
        raise UsageError(f"{name} = {value!r:.60} must be {allowed}")


def require_ranges(values: object, ranges: Mapping[str, Range], what: str) -> None:
    """Refuse values with attributes out of their ranges.

    Args:
        values: has the attributes.
        ranges: of the attributes, by name.
        what: the values are, for the message.

    Raises:
        UsageError: naming each of them, and what is allowed.
    """
    wrong = [
        f"{name} = {getattr(values, name)!r:.60} must be {allowed}"
        for name, allowed in ranges.items()
        if getattr(values, name) not in allowed
    ]
    if wrong:
        raise UsageError(f"{what}: {'; '.join(wrong)}")
