"""The ways a scene states its elevation, and what can be wrong with them.

Grids are read like a map on paper, north up: the first row lies on the northern bound,
the first column on the western one.
"""

from __future__ import annotations

import base64
import binascii
import math
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from mrmg.errors import Fault, nearest
from mrmg.scene.document import PACKED_M, packed_heights
from mrmg.scene.elevation import Elevation
from mrmg.scene.loading.elevation_schema import ElevationEntry, HillEntry
from mrmg.scene.loading.faults import shown

FORMS = ("file", "grid", "hills", "packed")
"""Exactly one of these keys states how high the ground is."""

DEFAULT_CELL_M = 0.5
MOST_NODES = 1_000_000

Bounds = tuple[float, float, float, float]


def elevation_of(
    entry: ElevationEntry, bounds: Bounds, base: Path | None
) -> tuple[Elevation, dict[str, Any]] | list[Fault]:
    """Return the elevation of a scene, or what is wrong with its entry.

    Args:
        entry: the scene's `elevation`.
        bounds: of the scene.
        base: folder that a relative path of a file starts from; default the working
            directory.

    Returns:
        The elevation, and the entry for a document that needs no other file.
    """
    given = [key for key in FORMS if getattr(entry, key) is not None]
    if len(given) != 1:
        found = " and ".join(given) if given else "none"
        message = f"has {found} of {', '.join(FORMS)}; expected exactly one of them"
        return [Fault("elevation", message)]
    (form,) = given
    faults = _misplaced_options(entry, form)
    if faults:
        return faults
    heights = _heights(entry, form, bounds, base)
    if isinstance(heights, Fault):
        return [heights]
    fault = _grid_fault(heights)
    if fault:
        return [Fault(f"elevation.{form}", fault)]
    document = entry.model_dump(mode="json", exclude_none=True)
    if form == "file":
        heights, document = _packed(heights)
    southward = np.ascontiguousarray(heights[::-1], dtype=float)
    southward.setflags(write=False)
    avoids = entry.slope == "avoid"
    if avoids:
        document["slope"] = "avoid"
    elevation = Elevation(bounds=bounds, height_m=southward, avoid_steep=avoids)
    return elevation, document


def _misplaced_options(entry: ElevationEntry, form: str) -> list[Fault]:
    is_picture = form == "file" and Path(str(entry.file)).suffix.lower() == ".png"
    faults = []
    if entry.range is not None and not is_picture:
        message = "belongs to a picture; leave it out, or give file: ....png"
        faults.append(Fault("elevation.range", message))
    if entry.cell is not None and form != "hills":
        faults.append(Fault("elevation.cell", "belongs to hills; leave it out"))
    return faults


def _heights(
    entry: ElevationEntry, form: str, bounds: Bounds, base: Path | None
) -> np.ndarray | Fault:
    """Return heights [m], rows from north to south."""
    if entry.file is not None:
        return _from_file(entry.file, entry.range, base)
    if entry.packed is not None:
        return _unpacked(entry.packed.rows, entry.packed.columns, entry.packed.heights)
    if entry.grid is not None:
        lengths = {len(row) for row in entry.grid}
        if len(lengths) > 1:
            message = f"rows of {min(lengths)} to {max(lengths)} numbers; must be equal"
            return Fault("elevation.grid", message)
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


def _from_file(
    name: str, span: list[float] | None, base: Path | None
) -> np.ndarray | Fault:
    path = (base or Path.cwd()) / name
    if not path.is_file():
        folder = path.parent
        others = [item.name for item in folder.iterdir()] if folder.is_dir() else []
        guess = nearest(path.name, others)
        return Fault("elevation.file", f"got '{name}'; no such file{guess}")
    kind = path.suffix.lower()
    if kind == ".npy":
        return _from_npy(path, name)
    if kind == ".png":
        return _from_picture(path, name, span)
    message = f"got '{name}'; expected .npy (heights in m) or .png (grey values)"
    return Fault("elevation.file", message)


def _from_npy(path: Path, name: str) -> np.ndarray | Fault:
    try:
        heights = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        return Fault("elevation.file", f"'{name}' is no readable .npy file ({error})")
    if heights.dtype.kind not in "fiu":
        message = f"'{name}' holds {heights.dtype}; expected numbers, metres"
        return Fault("elevation.file", message)
    return np.asarray(heights, dtype=float)


def _from_picture(
    path: Path, name: str, span: list[float] | None
) -> np.ndarray | Fault:
    from PIL import Image, UnidentifiedImageError

    if span is None:
        message = "missing; expected [height of black in m, height of white in m]"
        return Fault("elevation.range", message)
    try:
        with Image.open(path) as picture:
            mode, grey = picture.mode, np.asarray(picture, dtype=float)
    except (OSError, UnidentifiedImageError, ValueError) as error:
        return Fault("elevation.file", f"'{name}' is no readable picture ({error})")
    white = {"L": 255.0, "I;16": 65535.0, "I": 65535.0}.get(mode)
    if white is None:
        message = (
            f"'{name}' is a picture of kind {mode}; expected plain grey, 8 or 16 bits"
        )
        return Fault("elevation.file", message)
    low, high = span
    return low + grey / white * (high - low)


def _packed(heights: np.ndarray) -> tuple[np.ndarray, dict[str, Any]]:
    """Return heights as they are kept, and the entry that keeps them."""
    steps = np.round(heights / PACKED_M).astype("<i4")
    return steps * PACKED_M, packed_heights(steps)


def _unpacked(rows: int, columns: int, text: str) -> np.ndarray | Fault:
    where = "elevation.packed.heights"
    if rows * columns > MOST_NODES:
        return Fault("elevation.packed", f"at most {MOST_NODES} heights in all")
    inflate = zlib.decompressobj()
    try:
        data = inflate.decompress(base64.b64decode(text, validate=True), 4 * MOST_NODES)
    except (binascii.Error, zlib.error) as error:
        return Fault(where, f"got {shown(text)}; not what was once packed ({error})")
    if len(data) != 4 * rows * columns:
        message = f"holds {len(data) // 4} heights; expected {rows} x {columns}"
        return Fault(where, message)
    return np.frombuffer(data, "<i4").reshape(rows, columns) * PACKED_M


def _sampled(
    hills: list[HillEntry], cell_m: float, bounds: Bounds
) -> np.ndarray | Fault:
    """Return the sum of round hills, each h cos^2(pi d / 2 R) at distance d < R."""
    x_min, y_min, x_max, y_max = bounds
    # Counted as floats, which may be as large as they like.
    across, down = (x_max - x_min) / cell_m + 1.0, (y_max - y_min) / cell_m + 1.0
    if across * down > MOST_NODES:
        return Fault(
            "elevation.hills",
            f"would have {down:.7g} x {across:.7g} heights within these bounds; "
            f"at most {MOST_NODES} in all: a larger cell makes them fewer",
        )
    columns, rows = max(2, math.ceil(across)), max(2, math.ceil(down))
    x, y = np.meshgrid(
        np.linspace(x_min, x_max, columns), np.linspace(y_max, y_min, rows)
    )
    heights = np.zeros((rows, columns))
    for hill in hills:
        apart = np.hypot(x - hill.center[0], y - hill.center[1]) / hill.radius
        heights += hill.height * np.cos(0.5 * np.pi * np.minimum(apart, 1.0)) ** 2
    return heights
