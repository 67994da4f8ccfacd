"""Elevation models: GeoTIFF, or what else GDAL reads.

Heights become nodes in the middle of the cells. A raster in degrees, or turned, is
resampled to metres; a coordinate system that is metric already keeps its cells.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError
from mrmg.scene.importing.layers import Area, ImportOptions, Layer
from mrmg.scene.importing.raster_shapes import enclosing_polygons
from mrmg.scene.importing.rasters import Raster, outline, read_raster
from mrmg.scene.importing.registry import Format, Head
from mrmg.scene.loading.elevation import MOST_NODES

_EDGE_POINTS = 21
"""Points of each side of a raster that decide what ground it covers elsewhere."""

_EDGE_SHARE = 0.01
"""Share of a cell that may lack at the edge."""

_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")


def read_elevation(path: Path, options: ImportOptions) -> Layer:
    """Read an elevation model; cells without data become obstacles, or free ground."""
    raster = read_raster(path, options)
    source, crs, frame, heights, transform, notes = raster
    upright = transform[1] == transform[3] == 0.0
    if upright and (crs is None or frame.crs in (None, crs)):
        factor = int(np.ceil(np.sqrt(heights.size / MOST_NODES)))
        if factor > 1:
            notes.append(f"every {factor}th row and column was kept: it is too large")
            heights = heights[::factor, ::factor]
        rows, columns = heights.shape
        last = (0.5 + factor * (columns - 1), 0.5 + factor * (rows - 1))
        (left, top), (right, bottom) = raster.metres([(0.5, 0.5), last])
        bounds = np.array([left, bottom, right, top])
    elif crs is None:
        message = "is turned and states no coordinate system; resample it north up"
        raise SceneError(source, [Fault("transform", message)])
    else:
        heights, bounds = _resampled(raster)
        notes.append(f"resampled from {crs} to rows of {frame.crs or crs}")
    if min(heights.shape) < 2:
        message = f"{heights.shape[0]} x {heights.shape[1]} heights; expected 2 x 2"
        raise SceneError(source, [Fault("", message)])
    empty = np.isnan(heights)
    if empty.all():
        raise SceneError(source, [Fault("", "holds no height in this area")])
    obstacles: list[Area] = []
    if empty.any():
        heights = _filled(heights, empty)
        notes.append(
            f"{counted(int(empty.sum()), 'cell')} without data taken as "
            f"{options.unknown}, at heights between those around them"
        )
        if options.unknown == "obstacle":
            obstacles = _areas_of(empty, bounds, options.tolerance)
    rows, columns = heights.shape
    notes.append(
        f"{rows} x {columns} heights of {heights.min():.1f} to {heights.max():.1f} m; "
        "ground too steep for a robot is an obstacle for it (slope: avoid)"
    )
    return Layer(
        frame=frame,
        crs=crs,
        bounds=tuple(bounds.tolist()),
        heights=heights,
        obstacles=obstacles,
        closes_unknown=bool(obstacles),
        notes=notes,
    )


def _filled(heights: np.ndarray, empty: np.ndarray) -> np.ndarray:
    """Return heights with those of empty cells between those around them."""
    from rasterio.fill import fillnodata

    reach = float(np.hypot(*heights.shape))
    return np.asarray(fillnodata(heights, mask=~empty, max_search_distance=reach))


def _resampled(raster: Raster) -> tuple[np.ndarray, np.ndarray]:
    """Return heights at nodes of the scene, NaN beside the raster, and their bounds."""
    from affine import Affine
    from rasterio import warp

    heights, frame = raster.values, raster.frame
    sides = [np.linspace(*ends, _EDGE_POINTS) for ends in pairwise(outline(heights))]
    edge = raster.metres(np.concatenate(sides))
    low, high = edge.min(axis=0), edge.max(axis=0)
    cell = np.sqrt(shapely.Polygon(edge).area / heights.size)
    cell = max(cell, np.sqrt(np.prod(high - low) / MOST_NODES) * 1.01)
    counts = np.maximum(2, ((high - low) / cell + _EDGE_SHARE).astype(int))
    high = low + counts * cell
    origin = np.asarray(frame.origin_m)
    left, top = low[0] + origin[0], high[1] + origin[1]
    found = np.full((counts[1], counts[0]), np.nan)
    warp.reproject(
        heights,
        found,
        src_transform=Affine(*raster.transform),
        src_crs=raster.crs,
        src_nodata=np.nan,
        dst_transform=Affine(cell, 0.0, left, 0.0, -cell, top),
        dst_crs=frame.crs or raster.crs,
        dst_nodata=np.nan,
        resampling=warp.Resampling.bilinear,
    )
    return found, np.concatenate([low + cell / 2, high - cell / 2])


def _areas_of(cells: np.ndarray, bounds: np.ndarray, tolerance: float) -> list[Area]:
    """Return areas without data about cells, whose middles are nodes."""
    x_min, y_min, x_max, y_max = bounds
    rows, columns = cells.shape
    steps = np.array([x_max - x_min, y_min - y_max]) / [columns - 1, rows - 1]

    def placed(points: np.ndarray) -> np.ndarray:
        return np.asarray((points - 0.5) * steps + [x_min, y_max])

    return [
        Area(shapely.transform(shape, placed), {"id": "no_data"})
        for shape in enclosing_polygons(cells, tolerance)
    ]


def _recognises(head: Head) -> bool:
    return head.start.startswith(_TIFF) or head.start[:5].lower() == b"ncols"


FORMAT = Format(
    kind="elevation",
    title="elevation model (GeoTIFF, ESRI ASCII grid)",
    recognises=_recognises,
    read=read_elevation,
)
