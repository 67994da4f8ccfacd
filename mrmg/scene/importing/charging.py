"""Which parts of route graphs and layouts charge, by their keys and words."""

from __future__ import annotations

import re
from typing import Any

_CHARGING = re.compile("(?<!dis)charg", re.IGNORECASE)
"""What names of charging actions and places have in them, as startCharging."""

_NO = ("", "false", "no", "none", "off", "0", "0.0")


def charges(stated: Any) -> bool:
    """Return whether keys or words of a part of a file name charging.

    A key whose value is false, no or 0 does not.
    """
    parts = [stated]
    while parts:  # files may be nested more deeply than functions can be
        part = parts.pop()
        if isinstance(part, list):
            parts += part
        elif isinstance(part, str) and _CHARGING.search(part):
            return True
        # Pairs of a list are spelt as {key: ..., value: ...}.
        elif isinstance(part, dict) and not _is_no(part.get("value", True)):
            parts += part.values()
            named = [part[key] for key in part if _CHARGING.search(str(key))]
            if not all(map(_is_no, named)):
                return True
    return False


def _is_no(value: Any) -> bool:
    return not isinstance(value, dict | list) and str(value).strip().lower() in _NO
