"""Land-cover classes as terrain, through a table of the user's."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, RootModel
from shapely.geometry.base import BaseGeometry

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError, UsageError
from mrmg.scene.importing.frames import Frame
from mrmg.scene.importing.layers import Area, Box, Layer
from mrmg.scene.loading.faults import validated
from mrmg.scene.loading.places import lines_of
from mrmg.scene.loading.shape_schema import Positive, Strict
from mrmg.scene.loading.yaml_text import read_yaml

OBSTACLE = "obstacle"
"""What the table states of classes that robots must keep off."""


class ClassEntry(Strict):
    """What a class is as terrain: keys of its entry in a scene."""

    multiplier: Positive = 1.0
    turning_multiplier: Annotated[Positive | None, Field(alias="turning")] = None


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
    document = read_yaml(path, source=str(path))
    with lines_of(path):
        if not isinstance(document, dict) or not document:
            message = "expected lines 'class: {multiplier: 1.5}' or 'class: obstacle'"
            raise SceneError(str(path), [Fault("", message)])
        return validated(ClassTable, document, str(path)).root


def land_cover_layer(
    table: dict[str, Any],
    shapes_by_class: Iterable[tuple[str, Sequence[BaseGeometry]]],
    frame: Frame,
    crs: str | None,
    bounds: Box | None,
    notes: Sequence[str],
) -> Layer:
    """Return classes as terrain and obstacles; what the table lacks is plain ground.

    Args:
        table: of classes, as `read_classes` returns it.
        shapes_by_class: names and shapes, in metres of the frame.
        frame: of the layer.
        crs: coordinate system of the file; None for local metres.
        bounds: of the layer.
        notes: on the file.
    """
    terrain: list[Area] = []
    obstacles: list[Area] = []
    unknown = []
    for name, shapes in shapes_by_class:
        entry, keys = table.get(name), {"id": f"class_{name}"}
        if entry is None:
            unknown.append(f"class {name} is not in the table: plain ground")
        elif entry == OBSTACLE:
            obstacles += [Area(shape, keys) for shape in shapes]
        else:
            keys |= entry.model_dump(exclude_none=True)
            terrain += [Area(shape, keys) for shape in shapes]
    areas = counted(len(terrain), "terrain area")
    return Layer(
        frame=frame,
        crs=crs,
        bounds=bounds,
        obstacles=obstacles,
        terrain=terrain,
        notes=[*notes, f"{areas}, {counted(len(obstacles), 'obstacle')}", *unknown],
    )
