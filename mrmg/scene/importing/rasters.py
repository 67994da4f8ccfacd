"""Georeferenced rasters as arrays of numbers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from mrmg.errors import Fault, SceneError
from mrmg.extras import import_extra
from mrmg.scene.importing.frames import known_crs
from mrmg.scene.importing.layers import ImportOptions

MOST_CELLS = 25_000_000
"""Cells that are read at most."""

_METRES = {"ft": 0.3048, "foot": 0.3048, "feet": 0.3048, "us-ft": 1200 / 3937}


class Raster(NamedTuple):
    """One band of a raster.

    Attributes:
        crs: its coordinate system; None for local metres.
        values: of its cells, rows from the top; NaN where it has no data.
        transform: from (column, row) to coordinates.
        notes: what was changed or assumed.
    """

    crs: str | None
    values: np.ndarray
    transform: Any
    notes: list[str]

    @property
    def corners(self) -> np.ndarray:
        """The coordinates of its corners, shape (4, 2)."""
        rows, columns = self.values.shape
        return self.at([(0, 0), (columns, 0), (columns, rows), (0, rows)])

    def at(self, cells: Any) -> np.ndarray:
        """Return the coordinates of places (column, row), shape (n, 2)."""
        column, row = np.asarray(cells, dtype=float).T
        a, b, c, d, e, f = self.transform[:6]
        return np.stack([a * column + b * row + c, d * column + e * row + f], axis=1)


def read_raster(path: Path, options: ImportOptions) -> Raster:
    """Read the first band of a raster, or the part of it that is asked for.

    Raises:
        SceneError: if it cannot be read or nothing of it is asked for.
    """
    with _opened(path) as source:
        if options.crs is not None:
            crs = known_crs(options.crs, str(path))
        else:
            crs = known_crs(source.crs.to_wkt(), str(path)) if source.crs else None
        return Raster(crs, *_window(source, options, str(path)))


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    rasterio = import_extra("rasterio", extra="geo", purpose="reads GeoTIFF")
    try:
        with rasterio.open(path) as source:
            yield source
    except rasterio.errors.RasterioError as error:
        reason = " ".join(str(error).split())
        message = f"no readable raster: {reason}"
        raise SceneError(str(path), [Fault("", message)]) from error


def _window(
    source: Any, options: ImportOptions, name: str
) -> tuple[np.ndarray, Any, list[str]]:
    """Return the first band as numbers (NaN: no data), its transform, and notes."""
    windows = import_extra("rasterio.windows", extra="geo", purpose="reads GeoTIFF")
    window = windows.Window(0, 0, source.width, source.height)
    if options.crop is not None and options.frame is None:
        asked = source.window(*options.crop).round_offsets().round_lengths()
        if not windows.intersect(window, asked):
            extent = ", ".join(f"{value:g}" for value in source.bounds)
            message = f"{options.crop} lies beside the raster, which covers {extent}"
            raise SceneError(name, [Fault("--crop", message)])
        window = window.intersection(asked)
    if window.width * window.height > MOST_CELLS:
        message = (
            f"{window.height} x {window.width} cells; at most {MOST_CELLS} are "
            "read: take a part of it by --crop X_MIN Y_MIN X_MAX Y_MAX"
        )
        raise SceneError(name, [Fault("", message)])
    band = source.read(1, window=window, masked=True)
    values = band.astype(float).filled(np.nan) * source.scales[0] + source.offsets[0]
    values[~np.isfinite(values)] = np.nan
    notes = []
    if source.count > 1:
        notes.append(f"the first of its {source.count} bands was read")
    unit = str(source.units[0] or "").lower()
    if unit in _METRES:
        values *= _METRES[unit]
        notes.append(f"heights in {unit} were turned into metres")
    if source.crs is None and options.crs is None:
        notes.append("states no coordinate system: taken as metres")
    return values, source.window_transform(window), notes
