"""Land cover: a raster of classes, or GeoJSON polygons with a property `class`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely

from mrmg.scene.importing.formats import geojson
from mrmg.scene.importing.frames import frame_of
from mrmg.scene.importing.land_cover import LandCover, read_classes
from mrmg.scene.importing.layers import ImportOptions, Layer
from mrmg.scene.importing.raster_shapes import enclosing_polygons, polygons_of_cells
from mrmg.scene.importing.rasters import read_raster
from mrmg.scene.importing.registry import Format, Head


def read_land_cover(path: Path, options: ImportOptions) -> Layer:
    """Read classes, of a raster or of polygons: the table makes them terrain."""
    if Head(path).kind == "json":
        return geojson.read_geojson(path, options)
    table = read_classes(options.classes, str(path))
    raster = read_raster(path, options)
    crs, classes, _, notes = raster
    frame = options.frame or frame_of(crs, raster.corners)

    def placed(points: np.ndarray) -> np.ndarray:
        return frame.metres(raster.at(points), crs, str(path))

    cover = LandCover(table)
    for value in np.unique(classes[~np.isnan(classes)]):
        mask = classes == value
        shapes = (
            enclosing_polygons(mask, options.tolerance)
            if cover.is_obstacle(f"{value:g}")
            else polygons_of_cells(mask)
        )
        cover.add(f"{value:g}", [shapely.transform(s, placed) for s in shapes])
    corners = frame.metres(raster.corners, crs)
    bounds = (*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())
    return cover.layer(frame, bounds, notes)


FORMAT = Format(
    kind="land-cover",
    title="land cover of --classes (GeoTIFF or GeoJSON; never by content)",
    recognises=lambda head: False,
    read=read_land_cover,
)
