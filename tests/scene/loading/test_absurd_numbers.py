"""Numbers that no map has are refused by name, or the world is still built."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import mrmg
from mrmg.errors import FileError
from mrmg.runs.pipeline import rehearse
from mrmg.scene.loading import scene_from_document
from mrmg.viz.overview import draw_overview

HILLS = mrmg.load_scene("hills").document
ABSURD = (1e300, 1e18, 1e8, -1e8, 1e5, 1e-300)


def numbers(item: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield where numbers stand in a document."""
    if isinstance(item, dict | list):
        # One corner of a polygon stands for the others.
        inner = item.items() if isinstance(item, dict) else enumerate(item[:3])
        for key, value in inner:
            yield from numbers(value, (*path, key))
    elif isinstance(item, int | float) and not isinstance(item, bool):
        yield path


def with_number(path: tuple[Any, ...], value: float) -> dict[str, Any]:
    """Return the document with another number at a place."""
    document = copy.deepcopy(dict(HILLS))
    inner: Any = document
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return document


@pytest.mark.slow
@pytest.mark.parametrize("value", ABSURD)
@pytest.mark.parametrize("section", ["bounds", "elevation", "obstacles"])
def test_absurd_numbers(
    section: str, value: float, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    drawn = set()
    for path in numbers(HILLS[section], (section,)):
        try:
            scene = scene_from_document(with_number(path, value), source="absurd")
            rehearse(scene)
        except FileError as error:
            assert all(fault.message for fault in error.faults), path
        else:
            # One number of each kind is drawn with, which takes longest.
            kind = tuple(key for key in path if isinstance(key, str))
            if value == 1e8 and kind not in drawn:
                drawn.add(kind)
                draw_overview(scene, path=tmp_path / "map.png")
    assert capfd.readouterr() == ("", "")
