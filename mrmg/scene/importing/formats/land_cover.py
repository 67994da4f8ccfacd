"""Land cover: a raster of classes, or GeoJSON polygons with a property `class`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from mrmg.scene.importing.formats import geojson
from mrmg.scene.importing.land_cover import OBSTACLE, land_cover_layer, read_classes
from mrmg.scene.importing.layers import ImportOptions, Layer
from mrmg.scene.importing.raster_shapes import enclosing_polygons
from mrmg.scene.importing.rasters import outline, read_raster
from mrmg.scene.importing.registry import Format, Head


def read_land_cover(path: Path, options: ImportOptions) -> Layer:
    """Read classes, of a raster or of polygons: the table makes them terrain."""
    if Head(path).kind == "json":
        return geojson.read_geojson(path, options)
    table = read_classes(options.classes, str(path))
    raster = read_raster(path, options)
    classes = raster.values

    def shapes_by_class() -> Iterator[tuple[str, list[BaseGeometry]]]:
        for value in np.unique(classes[~np.isnan(classes)]):
            name = f"{value:g}"
            # What is terrain must not grow over its neighbours.
            tolerance = options.tolerance if table.get(name) == OBSTACLE else 0.0
            shapes = enclosing_polygons(classes == value, tolerance)
            yield name, [shapely.transform(shape, raster.metres) for shape in shapes]

    bounds = shapely.MultiPoint(raster.metres(outline(classes))).bounds
    return land_cover_layer(
        table, shapes_by_class(), raster.frame, raster.crs, bounds, raster.notes
    )


FORMAT = Format(
    kind="land-cover",
    title="land cover of --classes (GeoTIFF or GeoJSON; never by content)",
    recognises=lambda head: False,
    read=read_land_cover,
)
