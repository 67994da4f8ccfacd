"""Georeferenced rasters as arrays of numbers."""

from __future__ import annotations

import warnings
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from mrmg.errors import Fault, SceneError
from mrmg.extras import import_extra
from mrmg.scene.importing.frames import LOCAL, Frame, frame_of, known_crs
from mrmg.scene.importing.layers import Box, ImportOptions

_NOWHERE = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
"""Transform of rasters that state none."""

_SIDE_TOLERANCE = 1e-6
"""Share of a cell by which a box may miss its side."""

MOST_CELLS = 25_000_000
"""Cells that are read at most."""

_METRES = {"ft": 0.3048, "foot": 0.3048, "feet": 0.3048, "us-ft": 1200 / 3937}


class Raster(NamedTuple):
    """One band of a raster.

    Attributes:
        source: its file, as error messages name it.
        crs: its coordinate system; None for local metres.
        frame: the coordinates of the scene.
        values: of its cells, rows from the top; NaN where it has no data.
        transform: from (column, row) to coordinates, as in GDAL: x = a column + b row
            + c, y = d column + e row + f. Rows that run west to east lead south.
        notes: what was changed or assumed.
    """

    source: str
    crs: str | None
    frame: Frame
    values: np.ndarray
    transform: tuple[float, ...]
    notes: list[str]

    def metres(self, cells: Any) -> np.ndarray:
        """Return places (column, row) in the coordinates of the scene, shape (n, 2).

        Raises:
            SceneError: if the scene cannot take coordinates of the raster.
        """
        return self.frame.metres(_at(self.transform, cells), self.crs, self.source)


def outline(cells: np.ndarray) -> list[tuple[int, int]]:
    """Return the corners (column, row) of a grid of cells, as a closed ring."""
    rows, columns = cells.shape
    return [(0, 0), (columns, 0), (columns, rows), (0, rows), (0, 0)]


def read_raster(path: Path, options: ImportOptions) -> Raster:
    """Read the first band of a raster, or the part of it that is asked for.

    Raises:
        SceneError: if it cannot be read or nothing of it is asked for.
    """
    rasterio = import_extra("rasterio", extra="geo", purpose="reads GeoTIFF")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
            with rasterio.open(path) as source:
                return _first_band(source, options, str(path))
    except rasterio.errors.RasterioError as error:
        reason = " ".join(str(error.__cause__ or error).split())
        message = f"no readable raster: {reason}"
        raise SceneError(str(path), [Fault("", message)]) from error


def _first_band(source: Any, options: ImportOptions, name: str) -> Raster:
    stated = options.crs
    if stated is None:
        stated = source.crs.to_wkt() if source.crs else LOCAL
    crs = known_crs(stated, name)
    transform, notes = tuple(source.transform[:6]), []
    if transform == _NOWHERE and source.crs is None:
        transform = (1.0, 0.0, 0.0, 0.0, -1.0, float(source.height))
        notes.append("states no place: cells of 1 m, the first row in the north")
    elif source.crs is None and options.crs is None:
        notes.append("states no coordinate system: taken as metres")
    first, end = np.zeros(2, dtype=int), np.array([source.width, source.height])
    crop = _crop_in(crs, options, name)
    if crop is not None:
        first, end = _cells_in(crop, transform, end, name)
    if np.prod(end - first) > MOST_CELLS:
        message = (
            f"{' x '.join(map(str, end - first))} cells; at most {MOST_CELLS} are "
            "read: take a part of it by --crop X_MIN Y_MIN X_MAX Y_MAX"
        )
        raise SceneError(name, [Fault("", message)])
    (left, top), (right, bottom) = first.tolist(), end.tolist()
    band = source.read(1, window=((top, bottom), (left, right)), masked=True)
    values = band.astype(float).filled(np.nan) * source.scales[0] + source.offsets[0]
    values[~np.isfinite(values)] = np.nan
    if source.count > 1:
        notes.append(f"the first of its {source.count} bands was read")
    unit = str(source.units[0] or "").lower()
    if unit in _METRES:
        values *= _METRES[unit]
        notes.append(f"heights in {unit} were turned into metres")
    a, b, _, d, e, _ = transform
    c, f = _at(transform, [first])[0]
    if b == d == 0.0:  # rows from north to south, columns from west to east
        values = values[:: 1 if e < 0.0 else -1, :: 1 if a > 0.0 else -1]
        c, f = min(c, c + a * values.shape[1]), max(f, f + e * values.shape[0])
        a, e = abs(a), -abs(e)
    transform = (a, b, c, d, e, f)
    frame = options.frame or frame_of(crs, _at(transform, outline(values)), name)
    return Raster(name, crs, frame, values, transform, notes)


def _crop_in(crs: str | None, options: ImportOptions, name: str) -> Box | None:
    """Return the box to keep, in coordinates of a raster; None to keep all."""
    if options.crop is None or not options.before:
        return options.crop
    of_first = options.before[0].crs
    if crs is None and of_first is not None:
        return None  # they do not fit, which is told of the whole raster
    box: Box = Frame(crs).placed(shapely.box(*options.crop), of_first, name).bounds
    return box


def _cells_in(
    crop: Box, transform: tuple[float, ...], size: np.ndarray, name: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return the first cell (column, row) of a box, and that after its last one."""
    matrix = np.array([transform[:3], transform[3:], (0.0, 0.0, 1.0)])
    corners = [(*corner, 1.0) for corner in product(crop[::2], crop[1::2])]
    cells = np.linalg.solve(matrix, np.transpose(corners))[:2]
    first = np.maximum(np.floor(cells.min(axis=1) + _SIDE_TOLERANCE), 0).astype(int)
    end = np.minimum(np.ceil(cells.max(axis=1) - _SIDE_TOLERANCE), size).astype(int)
    if (first >= end).any():
        whole = _at(transform, list(product((0, size[0]), (0, size[1]))))
        extent = np.concatenate([whole.min(axis=0), whole.max(axis=0)])
        words = ", ".join(f"{value:.10g}" for value in extent)
        message = f"{crop} lies beside the raster, which covers {words}"
        raise SceneError(name, [Fault("--crop", message)])
    return first, end


def _at(transform: tuple[float, ...], cells: Any) -> np.ndarray:
    column, row = np.asarray(cells, dtype=float).T
    a, b, c, d, e, f = transform
    return np.stack([a * column + b * row + c, d * column + e * row + f], axis=1)
