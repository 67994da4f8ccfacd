"""Two figures in a message, with digits enough that their comparison can be seen."""

from __future__ import annotations

_MOST_DIGITS = 12


def compared(value: float, limit: float, digits: int = 0) -> tuple[str, str]:
    """Return two figures as texts that differ where the figures do.

    "rises by 6.04 % where it climbs 6.00 %", not "by 6 % where it climbs 6 %".

    Args:
        value: what was found.
        limit: what it is compared with.
        digits: least number of digits after the decimal point.
    """
    texts = f"{value:.{digits}f}", f"{limit:.{digits}f}"
    differ = float(texts[0]) != float(texts[1])
    if differ or value == limit or digits >= _MOST_DIGITS:
        return texts
    return compared(value, limit, digits + 1)
