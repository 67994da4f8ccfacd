"""Occupancy maps of ROS and Nav2: a YAML file, and the picture that it names.

Grey values become occupancy as in Nav2's map server: `trinary`, `scale` and `raw`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Annotated, Any, Literal

import numpy as np
import shapely
from pydantic import Field
from shapely import affinity

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError
from mrmg.scene.importing.layers import Area, ImportOptions, Layer
from mrmg.scene.importing.raster_shapes import enclosing_polygons
from mrmg.scene.importing.registry import Format, Head
from mrmg.scene.loading.faults import validated
from mrmg.scene.loading.pictures import opened_picture
from mrmg.scene.loading.places import lines_of
from mrmg.scene.loading.shape_schema import Number, Positive, Strict
from mrmg.scene.loading.yaml_text import read_yaml

LETHAL, UNKNOWN = 100, -1
"""Occupancy of obstacles, and of cells that were never seen."""

MOST_CLASSES = 12
"""Multipliers that a mask of many values is rounded to, at most."""

_ASSUMED = ("mode", "negate", "occupied_thresh", "free_thresh")


class MapDocument(Strict):
    """The content of a map's YAML file."""

    model_config = {**Strict.model_config, "extra": "ignore"}

    image: Annotated[str, Field(min_length=1)]
    """PGM or PNG file"""
    resolution: Positive
    """side of a cell in m"""
    origin: Annotated[list[Number], Field(min_length=2, max_length=3)]
    """[x, y, yaw] of the lower left corner in m and rad"""
    mode: Literal["trinary", "scale", "raw"] = "trinary"
    negate: Literal[0, 1, False, True] = 0
    occupied_thresh: Annotated[float, Field(ge=0, le=1)] = 0.65
    free_thresh: Annotated[float, Field(ge=0, le=1)] = 0.25


@dataclass(frozen=True, kw_only=True)
class OccupancyGrid:
    """A map as Nav2 takes it.

    Attributes:
        document: the YAML file.
        moved: whether its picture is not where it says, but beside it.
        occupancy: 0 to 100, or `UNKNOWN`, rows from north to south.
        occupied: which cells are obstacles.
    """

    document: MapDocument
    moved: bool
    occupancy: np.ndarray
    occupied: np.ndarray

    @property
    def place(self) -> tuple[Any, ...]:
        """What grids have in common whose cells lie on each other."""
        return self.document.origin, self.document.resolution

    def placed(self, shape: Any) -> Any:
        """Return a shape of cells (column, row from the top) in metres of the map."""
        x, y, yaw = (*self.document.origin, 0.0)[:3]
        cell = self.document.resolution
        rows = self.occupancy.shape[0]
        upright = affinity.affine_transform(shape, [cell, 0, 0, -cell, 0, rows * cell])
        turned = affinity.rotate(upright, yaw, origin=(0.0, 0.0), use_radians=True)
        return affinity.translate(turned, x, y)

    def areas(self, cells: np.ndarray, tolerance: float, **entry: Any) -> list[Area]:
        """Return areas of an entry about cells; see `enclosing_polygons`."""
        shapes = enclosing_polygons(cells, tolerance)
        return [Area(self.placed(shape), entry) for shape in shapes]

    def uncovered(self, known: Sequence[Layer]) -> np.ndarray:
        """Return which cells no obstacle of known layers on the same grid covers."""
        free = np.ones(self.occupied.shape, dtype=bool)
        for place, mask in (layer.cells for layer in known if layer.cells is not None):
            if place == self.place and mask.shape == free.shape:
                free &= ~mask
        return free


def read_map(path: Path, options: ImportOptions) -> Layer:
    """Read an occupancy map: its occupied cells, and unknown ones, become obstacles."""
    grid = read_grid(path)
    unknown = grid.occupancy == UNKNOWN
    solid = grid.occupied | unknown if options.unknown == "obstacle" else grid.occupied
    obstacles = grid.areas(solid, options.tolerance)
    rows, columns = solid.shape
    extent = grid.placed(shapely.box(0, 0, columns, rows))
    bounds = extent.bounds
    beside = shapely.box(*bounds) - extent
    if beside.area > 1e-6 * extent.area:  # turned: nothing is known beside it
        obstacles += [Area(part) for part in shapely.get_parts(beside)]
    tolerance_m = options.tolerance * grid.document.resolution
    cells = counted(int(grid.occupied.sum()), "occupied cell")
    notes = [
        f"{cells} and {int(unknown.sum())} unknown (taken as {options.unknown}) became "
        f"{counted(len(obstacles), 'polygon')}, reaching at most {tolerance_m:.3g} m "
        "beyond their cells",
        *_notes(grid),
    ]
    between = (grid.occupancy > 0) & ~grid.occupied
    if between.any():
        notes.append(
            f"{counted(int(between.sum()), 'cell')} of occupancy between free and "
            "occupied taken as free"
        )
    return Layer(
        bounds=bounds,
        obstacles=obstacles,
        cells=(grid.place, solid),
        closes_unknown=bool(unknown.any()) and options.unknown == "obstacle",
        notes=notes,
    )


def read_keepout(path: Path, options: ImportOptions) -> Layer:
    """Read a keep-out mask: its occupied cells become obstacles.

    Cells that are obstacles of layers before on the same grid already stay out.
    """
    grid = read_grid(path)
    closed = grid.occupied & grid.uncovered(options.before)
    obstacles = grid.areas(closed, options.tolerance, id="keepout")
    cells = counted(int(closed.sum()), "cell")
    note = f"{cells} became {counted(len(obstacles), 'obstacle')}"
    return Layer(obstacles=obstacles, notes=[note, *_notes(grid)])


def read_mask(path: Path, options: ImportOptions) -> Layer:
    """Read a speed or cost mask: its values become multipliers of terrain.

    A value v of 1 to 99 leaves 100 - v % of the speed, and multiplies by
    100 / (100 - v); ground of value 100 is closed. Cells that are obstacles of layers
    before on the same grid stay out.
    """
    grid = read_grid(path)
    free = grid.uncovered(options.before)
    full = grid.occupancy == LETHAL  # raw values are no matter of occupied_thresh
    value = np.where(free & ~full, np.maximum(grid.occupancy, 0), 0)
    values = np.unique(value[value > 0])
    if len(values) > MOST_CLASSES:
        steps = np.linspace(0, LETHAL, MOST_CLASSES + 1)
        middle = 0.5 * (steps[1:] + steps[:-1])
        value = np.where(value > 0, middle[np.digitize(value, steps[1:-1])], 0.0)
    terrain = [
        area
        for v in np.unique(value[value > 0])
        for area in grid.areas(
            value == v, 0.0, multiplier=round(100.0 / (100.0 - float(v)), 3)
        )
    ]
    closed = grid.areas(full & free, options.tolerance, id="closed")
    notes = [
        f"{counted(len(values), 'value')} of 1 to 99 became "
        f"{counted(len(terrain), 'terrain area')} of multiplier 100 / (100 - value); "
        f"{counted(len(closed), 'area')} of value 100 obstacles"
    ]
    if len(values) > MOST_CLASSES:
        notes.append(f"its {len(values)} values were rounded to {MOST_CLASSES}")
    return Layer(obstacles=closed, terrain=terrain, notes=[*notes, *_notes(grid)])


def _notes(grid: OccupancyGrid) -> list[str]:
    document = grid.document
    lacking = [key for key in _ASSUMED if key not in document.model_fields_set]
    assumed = ", ".join(f"{key} {getattr(document, key)}" for key in lacking)
    notes = [f"states not all of its keys; assumed: {assumed}"] if lacking else []
    if grid.moved:
        notes.append(f"'{document.image}' is not there; took the file beside the YAML")
    return notes


def read_grid(path: Path) -> OccupancyGrid:
    """Read a map's YAML file and its picture.

    Raises:
        SceneError: naming every fault.
    """
    with lines_of(path):
        content = read_yaml(path, source=str(path))
        document = validated(MapDocument, content, str(path))
        if document.mode != "raw" and document.free_thresh > document.occupied_thresh:
            message = f"got {document.free_thresh}; must not exceed occupied_thresh"
            raise SceneError(str(path), [Fault("free_thresh", message)])
        image = _image_file(path, document)
        shade, opaque = _picture(path, document, image)
    occupancy, occupied = _occupancy(document, shade, opaque)
    return OccupancyGrid(
        document=document,
        moved=image != path.parent / document.image,
        occupancy=occupancy,
        occupied=occupied,
    )


def _image_file(path: Path, document: MapDocument) -> Path:
    """Return a map's picture: where it says, or that of the same name beside the map.

    Maps that were moved often state a path of the machine they come from.
    """
    stated = path.parent / document.image
    beside = path.parent / PureWindowsPath(document.image).name
    return stated if os.path.exists(stated) or not os.path.isfile(beside) else beside


def _picture(
    path: Path, document: MapDocument, file: Path
) -> tuple[np.ndarray, np.ndarray]:
    """Return brightness in [0, 1] and where the picture is opaque, as (h, w)."""
    try:
        with opened_picture(file) as picture:
            # Grey with alpha as colours with alpha: its mean counts alpha, too.
            if picture.mode in ("P", "PA", "1", "LA", "La"):
                clear = "A" in picture.getbands() or "transparency" in picture.info
                data = np.asarray(picture.convert("RGBA" if clear else "RGB"))
            else:
                data = np.asarray(picture)
            white = 65535.0 if picture.mode.startswith("I") else 255.0
    except ValueError as error:
        reason = "no readable picture" if os.path.exists(file) else "no such file"
        message = f"'{document.image}': {reason}; expected a PGM or PNG beside the YAML"
        raise SceneError(str(path), [Fault("image", message)]) from error
    data = np.atleast_3d(data.astype(float) / white)
    if data.shape[2] not in (2, 4):
        return data.mean(axis=2), np.ones(data.shape[:2], dtype=bool)
    # As the map server has it.
    colours = data if document.mode == "trinary" else data[..., :-1]
    return colours.mean(axis=2), data[..., -1] >= 1.0


def _occupancy(
    document: MapDocument, shade: np.ndarray, opaque: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    if document.mode == "raw":
        value = np.rint(255.0 * shade)
        occupancy = np.where(value <= LETHAL, value, UNKNOWN).astype(int)
        return occupancy, occupancy >= 100.0 * document.occupied_thresh
    low, high = document.free_thresh, document.occupied_thresh
    # Rounded: 1 - 254 / 255 must not pass a threshold of 0.004 by a bit.
    share = np.round(shade if document.negate else 1.0 - shade, 12)
    occupied, free = share > high, share < low
    between = np.full(shade.shape, UNKNOWN, dtype=float)
    if document.mode == "scale" and high > low:
        between = np.where(opaque, np.rint((share - low) / (high - low) * 100), UNKNOWN)
        occupied, free = occupied & opaque, free & opaque
    occupancy = np.where(occupied, LETHAL, np.where(free, 0, between)).astype(int)
    return occupancy, occupancy == LETHAL


def _recognises(head: Head) -> bool:
    keys = head.mapping if head.kind == "yaml" else {}
    return "image" in keys or ("resolution" in keys and "origin" in keys)


FORMAT = Format(
    kind="nav2-map",
    title="ROS or Nav2 occupancy map (YAML with PGM or PNG)",
    recognises=_recognises,
    read=read_map,
)
