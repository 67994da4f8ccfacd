"""GeoJSON features as places, properties and geometries."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from shapely.errors import ShapelyError
from shapely.geometry.base import BaseGeometry, BaseMultipartGeometry

from mrmg.counted import counted
from mrmg.errors import Fault
from mrmg.scene.importing.frames import known_crs
from mrmg.scene.importing.layers import Area, ImportOptions
from mrmg.scene.loading.faults import shown

_GEOGRAPHIC = "EPSG:4326"


@dataclass
class Content:
    """What was found so far, in coordinates of the file until it is placed."""

    source: str
    faults: list[Fault] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    areas: dict[str, list[Area]] = field(
        default_factory=lambda: {"obstacle": [], "terrain": []}
    )
    entries: dict[str, list[dict[str, Any]]] = field(
        default_factory=lambda: {"goal": [], "station": [], "robot": []}
    )
    lanes: list[BaseGeometry] = field(default_factory=list)

    def number(
        self, keys: dict[str, Any], place: str, name: str, default: float
    ) -> float:
        """Return a positive number of the properties, or note a fault of it."""
        value = keys.get(name, default)
        good = isinstance(value, int | float) and not isinstance(value, bool)
        if not good or not np.isfinite(value) or (value <= 0.0 and name != "heading"):
            message = f"got {shown(value)}; expected a positive number"
            self.faults.append(Fault(f"{place}.properties.{name}", message))
            return default
        return float(value)


def features_of(
    document: Any, content: Content
) -> Iterator[tuple[str, dict[str, Any], BaseGeometry]]:
    """Yield place, properties and geometry of the features that are well formed.

    One of several geometries is as many features.
    """
    kind = document.get("type") if isinstance(document, dict) else None
    if kind == "FeatureCollection":
        items = document.get("features")
        if not isinstance(items, list):
            message = f"got {shown(items)}; expected a list"
            content.faults.append(Fault("features", message))
            return
    elif kind == "Feature":
        items = [document]
    else:
        message = f"got {shown(kind)}; expected FeatureCollection or Feature"
        content.faults.append(Fault("type", message))
        return
    empty = 0
    for index, item in enumerate(items):
        place = f"features.{index}"
        stated = item.get("properties", {}) if isinstance(item, dict) else None
        if not isinstance(stated, dict):
            message = f"got {shown(item)}; expected a feature"
            content.faults.append(Fault(place, message))
        elif item.get("geometry") is None:
            empty += 1
        else:
            own_id = {"id": item["id"]} if "id" in item else {}
            keys = own_id | stated
            shape = _geometry(item["geometry"], f"{place}.geometry", content)
            for part in _parts(shape) if shape is not None else ():
                yield place, keys, part
    if empty:
        content.notes.append(f"{counted(empty, 'feature')} without geometry left out")


def _geometry(value: Any, place: str, content: Content) -> BaseGeometry | None:
    try:
        shape = shapely.force_2d(shapely.geometry.shape(value))
        good = not shape.is_empty and np.isfinite(shapely.get_coordinates(shape)).all()
    except (ShapelyError, ValueError, TypeError, KeyError, AttributeError, IndexError):
        good = False
    if good:
        return shape
    content.faults.append(Fault(place, f"got {shown(value)}; expected a geometry"))
    return None


def _parts(shape: BaseGeometry) -> list[BaseGeometry]:
    """Return the points, lines and polygons of a geometry of several, at any depth."""
    if not isinstance(shape, BaseMultipartGeometry):
        return [shape]
    return [inner for part in shape.geoms for inner in _parts(part)]


def crs_of(
    document: Any, features: list[Any], options: ImportOptions, content: Content
) -> str | None:
    """Return the coordinate system of a file; None for local metres."""
    if options.crs is not None:
        return known_crs(options.crs, content.source)
    member = document.get("crs")
    if member is not None:
        try:
            return known_crs(str(member["properties"]["name"]), content.source)
        except (KeyError, TypeError):
            message = f"got {shown(member)}; expected {{properties: {{name: ...}}}}"
            content.faults.append(Fault("crs", message))
            return None
    if options.frame is not None and options.frame.crs is None:
        content.notes.append("states no crs: taken as metres of the map before it")
        return None
    if any(is_graph_edge(keys) for _, keys, _ in features):
        content.notes.append("states no crs: a route graph's are metres of its map")
        return None
    points = np.concatenate([shapely.get_coordinates(item[2]) for item in features])
    if (np.abs(points) > [180.0, 90.0]).any():
        message = (
            "states none, and has coordinates that are no longitude and latitude; "
            "add it, or state one by --crs (--crs local for metres)"
        )
        content.faults.append(Fault("crs", message))
        return None
    content.notes.append("states no crs: longitude and latitude, as in RFC 7946")
    return _GEOGRAPHIC


def is_graph_edge(keys: dict[str, Any]) -> bool:
    """Return whether a feature is an edge of a Nav2 route graph."""
    return "startid" in keys and "endid" in keys
