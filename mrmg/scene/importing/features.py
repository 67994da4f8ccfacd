"""The features of a GeoJSON file, and its coordinate system."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from shapely.errors import ShapelyError
from shapely.geometry.base import BaseGeometry, BaseMultipartGeometry

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError
from mrmg.scene.importing.frames import known_crs
from mrmg.scene.importing.layers import ImportOptions
from mrmg.scene.loading.faults import shown
from mrmg.storage import UNREADABLE

_GEOGRAPHIC = "EPSG:4326"


@dataclass(frozen=True)
class Findings:
    """Faults of the features of a file, and notes on them, as they are found."""

    source: str
    faults: list[Fault] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Feature:
    """A feature that is well formed.

    Attributes:
        place: in the file, such as "features.3".
        keys: its properties, and its id.
        shape: point, line or polygon; in coordinates of the file until it is placed.
        findings: of the file.
    """

    place: str
    keys: dict[str, Any]
    shape: BaseGeometry
    findings: Findings

    def fault(self, path: str, message: str) -> None:
        """Note a fault of the feature."""
        self.findings.faults.append(Fault(f"{self.place}.{path}", message))

    def number(self, name: str, default: float) -> float:
        """Return a number of the properties, or note a fault of it.

        All but headings are positive.
        """
        value, wanted = self.keys.get(name, default), "a positive number"
        least = 0.0
        if name == "heading":
            least, wanted = -sys.float_info.max, "a number"
        good = isinstance(value, int | float) and not isinstance(value, bool)
        # Whole numbers may be beyond all of floating point.
        if not good or not least < value <= sys.float_info.max:
            message = f"got {shown(value)}; expected {wanted}"
            self.fault(f"properties.{name}", message)
            return default
        return float(value)

    @property
    def is_graph_edge(self) -> bool:
        """Whether it is an edge of a Nav2 route graph."""
        return "startid" in self.keys and "endid" in self.keys


def features_of(document: Any, findings: Findings) -> Iterator[Feature]:
    """Yield the features that are well formed.

    One of several geometries is as many features.

    Raises:
        SceneError: if the document holds no features.
    """
    kind = document.get("type") if isinstance(document, dict) else None
    if kind == "FeatureCollection":
        items = document.get("features")
        if not isinstance(items, list):
            message = f"got {shown(items)}; expected a list"
            raise SceneError(findings.source, [Fault("features", message)])
    elif kind == "Feature":
        items = [document]
    else:
        message = f"got {shown(kind)}; expected FeatureCollection or Feature"
        raise SceneError(findings.source, [Fault("type", message)])
    empty = 0
    for index, item in enumerate(items):
        place = f"features.{index}"
        stated = item.get("properties", {}) if isinstance(item, dict) else None
        if not isinstance(stated, dict):
            message = f"got {shown(item)}; expected a feature"
            findings.faults.append(Fault(place, message))
        elif item.get("geometry") is None:
            empty += 1
        else:
            own_id = {"id": item["id"]} if "id" in item else {}
            for part in _geometries(item["geometry"], f"{place}.geometry", findings):
                yield Feature(place, own_id | stated, part, findings)
    if empty:
        findings.notes.append(f"{counted(empty, 'feature')} without geometry left out")


def _geometries(value: Any, place: str, findings: Findings) -> list[BaseGeometry]:
    """Return the points, lines and polygons of a geometry, at any depth."""
    try:
        shape = shapely.force_2d(shapely.geometry.shape(value))
        good = not shape.is_empty and np.isfinite(shapely.get_coordinates(shape)).all()
    except (ShapelyError, *UNREADABLE):
        good = False
    if good:
        return _parts(shape)
    findings.faults.append(Fault(place, f"got {shown(value)}; expected a geometry"))
    return []


def _parts(shape: BaseGeometry) -> list[BaseGeometry]:
    if not isinstance(shape, BaseMultipartGeometry):
        return [shape]
    return [inner for part in shape.geoms for inner in _parts(part)]


def crs_of(
    document: Any,
    features: Sequence[Feature],
    options: ImportOptions,
    findings: Findings,
) -> str | None:
    """Return the coordinate system of a file; None for local metres.

    Raises:
        SceneError: if it states none that is known, and needs one.
    """
    source, notes, member = findings.source, findings.notes, document.get("crs")
    if options.crs is not None:
        return known_crs(options.crs, source)
    if member is not None:
        try:
            name = str(member["properties"]["name"])
        except (KeyError, TypeError):
            message = f"got {shown(member)}; expected {{properties: {{name: ...}}}}"
            raise SceneError(source, [Fault("crs", message)]) from None
        return known_crs(name, source)
    if options.frame is not None and options.frame.crs is None:
        notes.append("states no crs: taken as metres of the map before it")
        return None
    if any(feature.is_graph_edge for feature in features):
        notes.append("states no crs: a route graph's are metres of its map")
        return None
    points = shapely.get_coordinates([feature.shape for feature in features])
    if (np.abs(points) > [180.0, 90.0]).any():
        message = (
            "states none, and has coordinates that are no longitude and latitude; "
            "add it, or state one by --crs (--crs local for metres)"
        )
        raise SceneError(source, [Fault("crs", message)])
    notes.append("states no crs: longitude and latitude, as in RFC 7946")
    return _GEOGRAPHIC
