"""What a scene file probably means otherwise than it states."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mrmg.errors import Fault, SceneError
from mrmg.scene.loading.places import composed, id_at, line_at, value_at
from mrmg.scene.loading.reading import scene_path
from mrmg.scene.loading.shape_schema import MOST
from mrmg.scene.loading.yaml_text import read_yaml

LARGEST_TURN_RAD = 2.0 * math.pi
"""Angles beyond a whole turn were probably meant in degrees."""

_ANGLES = {
    "robots": ((("pose", 2), "heading"), (("finish", "heading"), "finish heading")),
    "goals": ((("heading",), "heading"),),
    "obstacles": ((("box", "yaw"), "yaw"),),
    "terrain": ((("box", "yaw"), "yaw"),),
}
"""Where the entries of each section have angles, and what messages call them."""


def heading_hints(source: str | Path) -> list[Fault]:
    """Return the headings of a scene file that look like degrees, with their lines.

    Args:
        source: as `load_scene` takes it; faults of the file are not reported here.
    """
    try:
        path = scene_path(source)
        document = read_yaml(path, source=str(source))
    except SceneError:
        return []
    suspicious = [
        found
        for found in _angles(document)
        if LARGEST_TURN_RAD < abs(found[-1]) <= MOST  # larger ones are faults
    ]
    root = composed(path) if suspicious else None  # lines take long to find
    return [
        Fault(
            entry,
            f"{name} {angle:g} rad looks like degrees; {angle:g} deg is "
            f"{math.radians(angle):.4f} rad",
            id=id_at(document, entry),
            line=line_at(root, f"{entry}.{key}"),
        )
        for entry, key, name, angle in suspicious
    ]


def _angles(document: Any) -> Iterator[tuple[str, str, str, float]]:
    """Yield the angles of a document: path of entry, path in it, name, value."""
    for section, places in _ANGLES.items():
        entries = value_at(document, section)
        for index in range(len(entries) if isinstance(entries, list) else 0):
            for keys, name in places:
                value = value_at(entries[index], *keys)
                if isinstance(value, int | float):
                    entry = f"{section}.{index}"
                    yield entry, ".".join(map(str, keys)), name, value
