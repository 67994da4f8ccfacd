"""A number of things in a message: "1 recharge", "2 recharges"."""

from __future__ import annotations


def counted(number: int, noun: str, plural: str = "") -> str:
    """Return a number with its noun.

    Args:
        number: of them.
        noun: for one of them.
        plural: for several, where that is not the noun and an s.
    """
    return f"{number} {noun if number == 1 else plural or noun + 's'}"
