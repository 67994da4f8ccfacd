"""Land-cover classes as terrain, through a table of the user's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import RootModel, ValidationError
from shapely.geometry.base import BaseGeometry

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError, UsageError
from mrmg.scene.importing.frames import Frame
from mrmg.scene.importing.layers import Area, Box, Layer
from mrmg.scene.loading.faults import faults_of
from mrmg.scene.loading.places import lines_of
from mrmg.scene.loading.shape_schema import Positive, Strict
from mrmg.scene.loading.yaml_text import parse_yaml, read_text

OBSTACLE = "obstacle"
"""What the table states of classes that robots must keep off."""


class ClassEntry(Strict):
    """What a class is as terrain."""

    multiplier: Positive = 1.0
    turning: Positive | None = None


class ClassTable(RootModel[dict[str, ClassEntry | Literal["obstacle"]]]):
    """Classes by their number or name."""


def read_classes(path: Path | None, source: str) -> dict[str, Any]:
    """Read the table `class: {multiplier, turning}`, or `class: obstacle`.

    Raises:
        UsageError: if there is none.
        SceneError: naming every fault of it.
    """
    if path is None:
        message = (
            f"{source} is land cover: state what its classes are by --classes FILE"
        )
        raise UsageError(f"{message}, lines as '30: {{multiplier: 1.5}}'")
    text = read_text(path, source=str(path))
    with lines_of(path):
        document = parse_yaml(text, source=str(path), keys_as_text=True)
        if not isinstance(document, dict) or not document:
            message = "expected lines 'class: {multiplier: 1.5}' or 'class: obstacle'"
            raise SceneError(str(path), [Fault("", message)])
        try:
            return ClassTable.model_validate(document).root
        except ValidationError as error:
            raise SceneError(str(path), faults_of(error, ClassEntry)) from error


class LandCover:
    """Shapes of classes, gathered one class after the other."""

    def __init__(self, table: dict[str, Any]) -> None:
        """Begin without shapes."""
        self._table = table
        self._terrain: list[Area] = []
        self._obstacles: list[Area] = []
        self._notes: list[str] = []

    def is_obstacle(self, name: str) -> bool:
        """Return whether robots must keep off a class."""
        return bool(self._table.get(name) == OBSTACLE)

    def add(self, name: str, shapes: Sequence[BaseGeometry]) -> None:
        """Add the shapes of a class; one that the table lacks is plain ground."""
        entry = self._table.get(name)
        areas = self._obstacles if entry == OBSTACLE else self._terrain
        if entry is None:
            self._notes.append(f"class {name} is not in the table: plain ground")
            return
        keys: dict[str, Any] = {"id": f"class_{name}"}
        if entry != OBSTACLE:
            keys["multiplier"] = entry.multiplier
            if entry.turning is not None:
                keys["turning_multiplier"] = entry.turning
        areas += [Area(shape, keys) for shape in shapes]

    def layer(self, frame: Frame, bounds: Box | None, notes: Sequence[str]) -> Layer:
        """Return what was added."""
        areas = counted(len(self._terrain), "terrain area")
        count = f"{areas}, {counted(len(self._obstacles), 'obstacle')}"
        return Layer(
            frame=frame,
            bounds=bounds,
            obstacles=self._obstacles,
            terrain=self._terrain,
            notes=[*notes, count, *self._notes],
        )
