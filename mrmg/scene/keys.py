"""The keys of files for values whose names carry their units."""

from __future__ import annotations

import re

_UNIT = re.compile(r"_(m_s2|m_s|m|kg_m2|kg|W|J|Ohm|Nm_A|V_s|A|s|rad)$")


def key_of(name: str) -> str:
    """Return the key that files have for a value: its name without the unit."""
    return _UNIT.sub("", name)
