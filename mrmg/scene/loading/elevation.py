"""The ways a scene states its elevation, and what can be wrong with them.

Grids are read like a map on paper, north up: the first row lies on the northern bound,
the first column on the western one.
"""

from __future__ import annotations

import base64
import math
import os
import zlib
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from mrmg import storage
from mrmg.errors import Fault, nearest
from mrmg.scene.document import PACKED_M
from mrmg.scene.elevation import Elevation
from mrmg.scene.loading.faults import EntryError, shown
from mrmg.scene.loading.pictures import opened_picture
from mrmg.scene.loading.shape_schema import Height, Length, OneOf, Point, Strict

DEFAULT_CELL_M = 0.5
MOST_NODES = 1_000_000

Bounds = tuple[float, float, float, float]


class HillEntry(Strict):
    """A round hill; hollow if its height is negative."""

    center: Point
    height: Height
    """height of the top in m"""
    radius: Length
    """radius of the foot in m"""


class PackedEntry(Strict):
    """Heights as saved scenes hold them: a compressed grid."""

    rows: Annotated[int, Field(ge=2)]
    """from north to south"""
    columns: Annotated[int, Field(ge=2)]
    """from west to east"""
    heights: str
    """tenths of mm, int32, zlib, base64"""


class ElevationEntry(OneOf):
    """The elevation: exactly one of file, grid, hills, packed."""

    one_of = ("file", "grid", "hills", "packed")
    none_of = "no heights"

    file: Annotated[str, Field(min_length=1)] | None = None
    """path of an .npy or .png file"""
    range: Annotated[list[Height], Field(min_length=2, max_length=2)] | None = None
    """[height of black in m, height of white in m]"""
    grid: Annotated[list[list[Height]], Field(min_length=2)] | None = None
    """rows of heights in m, from north to south"""
    hills: Annotated[list[HillEntry], Field(min_length=1)] | None = None
    """round hills, which add up; heights and radii in m"""
    cell: Length | None = None
    """distance of the samples of hills in m"""
    packed: PackedEntry | None = None
    """heights as saved scenes hold them"""
    slope: Literal["refuse", "avoid"] | None = None
    """ground too steep for a robot: refuse the scene (default), or avoid it, as an
    obstacle for that robot"""


def elevation_of(entry: ElevationEntry, bounds: Bounds, base: Path | None) -> Elevation:
    """Return the elevation of a scene.

    Args:
        entry: the scene's `elevation`.
        bounds: of the scene.
        base: folder that a relative path of a file starts from; default the working
            directory.

    Raises:
        EntryError: naming what is wrong with the entry.
    """
    form = entry.given("elevation")
    faults = _misplaced_options(entry, form)
    if faults:
        raise EntryError(*faults)
    heights = _heights(entry, bounds, base)
    fault = _grid_fault(heights)
    if fault:
        raise EntryError(Fault(f"elevation.{form}", fault))
    if form == "file":  # what saved scenes hold of it
        heights = np.round(heights / PACKED_M) * PACKED_M
    southward = np.ascontiguousarray(heights[::-1], dtype=float)
    southward.setflags(write=False)
    avoids = entry.slope == "avoid"
    return Elevation(bounds=bounds, height_m=southward, avoid_steep=avoids)


def _misplaced_options(entry: ElevationEntry, form: str) -> list[Fault]:
    is_picture = form == "file" and Path(str(entry.file)).suffix.lower() == ".png"
    faults = []
    if entry.range is not None and not is_picture:
        message = "belongs to a picture; leave it out, or give file: ....png"
        faults.append(Fault("elevation.range", message))
    if entry.cell is not None and form != "hills":
        faults.append(Fault("elevation.cell", "belongs to hills; leave it out"))
    return faults


def _heights(entry: ElevationEntry, bounds: Bounds, base: Path | None) -> np.ndarray:
    """Return heights [m], rows from north to south."""
    if entry.file is not None:
        return _from_file(entry.file, entry.range, base)
    if entry.packed is not None:
        return _unpacked(entry.packed.rows, entry.packed.columns, entry.packed.heights)
    if entry.grid is not None:
        lengths = {len(row) for row in entry.grid}
        if len(lengths) > 1:
            message = f"rows of {min(lengths)} to {max(lengths)} numbers; must be equal"
            raise EntryError(Fault("elevation.grid", message))
        return np.array(entry.grid)
    assert entry.hills is not None
    return _sampled(entry.hills, entry.cell or DEFAULT_CELL_M, bounds)


def _grid_fault(heights: np.ndarray) -> str | None:
    if heights.ndim != 2 or min(heights.shape) < 2:
        shape = " x ".join(str(n) for n in heights.shape) or "single number"
        return f"is {shape}; expected at least 2 x 2 heights"
    if heights.size > MOST_NODES:
        rows, columns = heights.shape
        return f"has {rows} x {columns} heights; at most {MOST_NODES} in all"
    if not np.isfinite(heights).all():
        row, column = np.argwhere(~np.isfinite(heights))[0]
        value = heights[row, column]
        return f"is {value} at row {row}, column {column}; expected finite heights"
    return None


def _from_file(name: str, span: list[float] | None, base: Path | None) -> np.ndarray:
    path = (base or Path.cwd()) / name
    if not os.path.isfile(path):  # also where no file can have such a name
        folder = path.parent
        others = os.listdir(folder) if os.path.isdir(folder) else []
        guess = nearest(path.name, others)
        message = f"got '{name}'; no such file{guess}"
        raise EntryError(Fault("elevation.file", message))
    kind = path.suffix.lower()
    if kind == ".npy":
        return _from_npy(path, name)
    if kind == ".png":
        return _from_picture(path, name, span)
    message = f"got '{name}'; expected .npy (heights in m) or .png (grey values)"
    raise EntryError(Fault("elevation.file", message))


def _from_npy(path: Path, name: str) -> np.ndarray:
    try:
        heights = storage.array_of(path.read_bytes())
    except Exception as error:  # it raises anything, of tokens and of memory, too
        reason = str(error).partition("\n")[0]
        message = f"'{name}' is no readable .npy file ({reason})"
        raise EntryError(Fault("elevation.file", message)) from error
    if heights.dtype.kind not in "fiu":
        message = f"'{name}' holds {heights.dtype}; expected numbers, metres"
        raise EntryError(Fault("elevation.file", message))
    return np.asarray(heights, dtype=float)


def _from_picture(path: Path, name: str, span: list[float] | None) -> np.ndarray:
    if span is None:
        message = "missing; expected [height of black in m, height of white in m]"
        raise EntryError(Fault("elevation.range", message))
    try:
        with opened_picture(path) as picture:
            mode, grey = picture.mode, np.asarray(picture, dtype=float)
    except ValueError as error:
        message = f"'{name}' is no readable picture ({error})"
        raise EntryError(Fault("elevation.file", message)) from error
    white = {"L": 255.0, "I;16": 65535.0, "I": 65535.0}.get(mode)
    if white is None:
        message = (
            f"'{name}' is a picture of kind {mode}; expected plain grey, 8 or 16 bits"
        )
        raise EntryError(Fault("elevation.file", message))
    low, high = span
    return low + grey / white * (high - low)


def _unpacked(rows: int, columns: int, text: str) -> np.ndarray:
    where = "elevation.packed.heights"
    inflate = zlib.decompressobj()
    try:
        data = inflate.decompress(base64.b64decode(text, validate=True), 4 * MOST_NODES)
    except (ValueError, zlib.error) as error:
        message = f"got {shown(text)}; not what was once packed ({error})"
        raise EntryError(Fault(where, message)) from error
    if len(data) != 4 * rows * columns:
        expected = f"{rows} x {columns}, at most {MOST_NODES} in all"
        message = f"holds {len(data) // 4} heights; expected {expected}"
        raise EntryError(Fault(where, message))
    return np.frombuffer(data, "<i4").reshape(rows, columns) * PACKED_M


def _sampled(hills: list[HillEntry], cell_m: float, bounds: Bounds) -> np.ndarray:
    """Return the sum of round hills, each h cos^2(pi d / 2 R) at distance d < R."""
    x_min, y_min, x_max, y_max = bounds
    # Counted as floats, which may be as large as they like.
    across, down = (x_max - x_min) / cell_m + 1.0, (y_max - y_min) / cell_m + 1.0
    if across * down > MOST_NODES:
        message = (
            f"would have {down:.7g} x {across:.7g} heights within these bounds; "
            f"at most {MOST_NODES} in all: a larger cell makes them fewer"
        )
        raise EntryError(Fault("elevation.hills", message))
    columns, rows = max(2, math.ceil(across)), max(2, math.ceil(down))
    x, y = np.meshgrid(
        np.linspace(x_min, x_max, columns), np.linspace(y_max, y_min, rows)
    )
    heights = np.zeros((rows, columns))
    for hill in hills:
        apart = np.hypot(x - hill.center[0], y - hill.center[1]) / hill.radius
        heights += hill.height * np.cos(0.5 * np.pi * np.minimum(apart, 1.0)) ** 2
    return heights
