"""Coordinates of files and of the scene they become: metres, x east, y north."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from mrmg.errors import Fault, SceneError
from mrmg.extras import import_extra

LOCAL = "local"
"""Name of coordinates in metres that no file ties to the earth."""

SCALE_ERROR = 0.002
"""By how much the metres of a projection may differ from those on the ground."""

FAR_M = 100_000.0
"""Coordinates from which on the scene begins at an origin of its own, so that
single-precision numbers resolve millimetres."""


@dataclass(frozen=True)
class Frame:
    """Coordinates of a scene: those of `crs` (None: local metres) less an origin."""

    crs: str | None = None
    origin_m: tuple[float, float] = (0.0, 0.0)

    def metres(self, points: Any, crs: str | None, source: str) -> np.ndarray:
        """Return points of another coordinate system in this frame, shape (n, 2).

        Raises:
            SceneError: if a map in local metres cannot take geographic coordinates.
        """
        points = np.asarray(points, dtype=float)[:, :2]
        if self.crs is not None and crs not in (None, self.crs):
            transformer = _pyproj().Transformer.from_crs(crs, self.crs, always_xy=True)
            points = np.stack(transformer.transform(*points.T), axis=1)
        elif self.crs is None and crs is not None and not _is_metric(crs, points):
            message = (
                f"has coordinates of {crs}, and the map it goes with is in local "
                "metres; import it alone, or state --crs local if it is, too"
            )
            raise SceneError(source, [Fault("", message)])
        if not np.isfinite(points).all():
            message = f"has coordinates that are none of {crs}; state others with --crs"
            raise SceneError(source, [Fault("", message)])
        return np.asarray(points if crs is None else points - self.origin_m)

    def placed(self, shape: Any, crs: str | None, source: str) -> Any:
        """Return a shape of another coordinate system in this frame; see `metres`."""
        return shapely.transform(shape, lambda points: self.metres(points, crs, source))

    def note(self) -> str:
        """Return what a reader of the scene must know of its coordinates."""
        if self.crs is None:
            return "coordinates are metres of the map's own frame"
        x, y = self.origin_m
        less = f", less the origin ({x:.0f}, {y:.0f})" if (x, y) != (0.0, 0.0) else ""
        return f"coordinates are those of {self.crs}{less}"


def frame_of(crs: str | None, points: Any, source: str) -> Frame:
    """Return the frame of a first file: its own metres, or the UTM zone it is in.

    Args:
        crs: of the file; None for local metres.
        points: of the file, which decide where the frame begins, shape (n, 2).
        source: what error messages call the file.
    """
    points = np.asarray(points, dtype=float)[:, :2]
    if crs is None:
        return Frame()
    metric = crs if _is_metric(crs, points) else _utm(crs, points)
    low = Frame(metric).metres(points, crs, source).min(axis=0)
    if np.abs(low).max() < FAR_M:
        return Frame(metric)
    return Frame(metric, (float(np.floor(low[0])), float(np.floor(low[1]))))


def known_crs(text: str, source: str) -> str | None:
    """Return the name of a coordinate reference system; None for local metres.

    Raises:
        SceneError: if there is none of that name, or it tells no place on a map.
    """
    if text == LOCAL:
        return None
    pyproj = _pyproj()
    try:
        crs = pyproj.CRS.from_user_input(text)
    except pyproj.exceptions.CRSError as error:
        message = f"unknown coordinate system '{text[:60]}'; state one with --crs"
        raise SceneError(source, [Fault("crs", message)]) from error
    if not crs.is_geographic and not crs.is_projected:
        message = (
            f"coordinate system '{text[:60]}' is neither geographic nor projected; "
            "state one with --crs (--crs local for metres)"
        )
        raise SceneError(source, [Fault("crs", message)])
    code = crs.to_authority(min_confidence=70)
    return ":".join(code) if code else str(crs.to_wkt())


def _is_metric(crs: str, points: np.ndarray) -> bool:
    """Return whether coordinates are metres on the ground around some points."""
    pyproj = _pyproj()
    system = pyproj.CRS.from_user_input(crs)
    if not system.is_projected or system.axis_info[0].unit_conversion_factor != 1.0:
        return False
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    to_earth = pyproj.Transformer.from_crs(system, system.geodetic_crs, always_xy=True)
    there = to_earth.transform(*middle)
    if not np.isfinite(there).all():
        return True  # a grid of its own, far from where it is defined
    factors = pyproj.Proj(system).get_factors(*there)
    scales = (factors.meridional_scale, factors.parallel_scale)
    return bool(np.abs(np.subtract(scales, 1.0)).max() <= SCALE_ERROR)


def _utm(crs: str, points: np.ndarray) -> str:
    pyproj = _pyproj()
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    to_earth = pyproj.Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    longitude, latitude = to_earth.transform(*middle)
    if not -80.0 <= latitude <= 84.0:  # no zones there
        return f"+proj=aeqd +lat_0={latitude:.4f} +lon_0={longitude:.4f}"
    zone = min(60, int((longitude + 180.0) // 6.0) + 1)
    return f"EPSG:{(32600 if latitude >= 0.0 else 32700) + zone}"


def _pyproj() -> Any:
    return import_extra("pyproj", extra="geo", purpose="knows coordinate systems")
