"""GeoJSON: features of `kind` obstacle, terrain, goal, station or robot; Nav2 graphs.

Coordinates are those of the member `crs`; without it longitude and latitude, as
RFC 7946 has it, or metres where they go with a map in local metres. The points of a
Nav2 route graph become goals, those that charge become stations, and its edges lanes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError, nearest
from mrmg.scene.importing.charging import charges
from mrmg.scene.importing.features import Feature, Findings, crs_of, features_of
from mrmg.scene.importing.frames import Frame, frame_of
from mrmg.scene.importing.land_cover import land_cover_layer, read_classes
from mrmg.scene.importing.layers import (
    Area,
    ImportOptions,
    Layer,
    lanes_note,
    polygons,
    solid,
)
from mrmg.scene.importing.registry import Format, Head, read_json
from mrmg.scene.loading.faults import shown

KINDS = ("obstacle", "terrain", "goal", "station", "robot")

_KIND = f"a property 'kind' ({', '.join(KINDS)})"

PLACE_RADIUS_M = 0.5
"""Radius of goals and stations that state none."""

WALL_WIDTH_M = 0.1
"""Width of obstacles that are lines, or points without a radius."""

ROBOT_MODEL = "diffdrive"
"""Model of robots that state none."""


def read_geojson(path: Path, options: ImportOptions) -> Layer:
    """Read a GeoJSON file as a layer of a scene.

    Raises:
        SceneError: naming every feature that cannot be used.
    """
    findings, document = Findings(str(path)), read_json(path)
    features = list(features_of(document, findings))
    if findings.faults or not features:
        faults = findings.faults or [Fault("features", "there are none")]
        raise SceneError(str(path), faults)
    crs = crs_of(document, features, options, findings)
    points = shapely.get_coordinates([feature.shape for feature in features])
    frame = options.frame or frame_of(crs, points, str(path))
    features = [
        replace(feature, shape=frame.placed(feature.shape, crs, str(path)))
        for feature in features
    ]
    if options.classes is not None and not any("kind" in f.keys for f in features):
        return _land_cover(features, frame, crs, options, str(path))
    found: dict[str, list[Any]] = {kind: [] for kind in (*KINDS, "lane")}
    for feature in features:
        _add(feature, found)
    if findings.faults:
        raise SceneError(str(path), findings.faults)
    if not any(found.values()):
        message = f"none has {_KIND}"
        raise SceneError(str(path), [Fault("features", message)])
    counts = [f"{len(found[kind])} {kind}" for kind in KINDS if found[kind]]
    lanes = [lanes_note(len(found["lane"]))] if found["lane"] else []
    return Layer(
        frame=frame,
        crs=crs,
        obstacles=found["obstacle"],
        terrain=found["terrain"],
        goals=found["goal"],
        stations=found["station"],
        robots=found["robot"],
        lanes=found["lane"],
        notes=[f"features: {', '.join(counts)}", *lanes, *findings.notes],
    )


def _land_cover(
    features: Sequence[Feature],
    frame: Frame,
    crs: str | None,
    options: ImportOptions,
    source: str,
) -> Layer:
    table = read_classes(options.classes, source)
    by_class: dict[str, list[BaseGeometry]] = {}
    named = [feature for feature in features if "class" in feature.keys]
    for feature in named:
        shapes = by_class.setdefault(str(feature.keys["class"]), [])
        shapes.append(polygons(feature.shape))
    unnamed, notes = len(features) - len(named), []
    if unnamed:
        notes = [f"{counted(unnamed, 'feature')} without 'class' left out"]
    return land_cover_layer(table, by_class.items(), frame, crs, None, notes)


def _add(feature: Feature, found: dict[str, list[Any]]) -> None:
    """Add a feature to those of its kind; note a fault if there is none."""
    keys, notes = feature.keys, feature.findings.notes
    kind = keys.get("kind")
    if kind is None and feature.is_graph_edge:
        found["lane"].append(feature.shape)
        return
    if kind is None and feature.shape.geom_type == "Point" and "id" in keys:
        kind = "station" if charges(keys) else "goal"
    if kind in ("obstacle", "terrain"):
        found[kind].append(_area(kind, feature))
    elif kind in KINDS:
        own_id = _own_id(feature, f"{kind}_{len(found[kind]) + 1}")
        entry = _robot(feature, own_id) if kind == "robot" else _region(feature)
        found[kind].append({"id": own_id, **entry})
    elif kind is None:
        note = f"features without {_KIND} were left out"
        if note not in notes:
            notes.append(note)
    else:
        message = f"got {shown(kind)}{nearest(str(kind), KINDS)}; of {', '.join(KINDS)}"
        feature.fault("properties.kind", message)


def _area(kind: str, feature: Feature) -> Area:
    keys, shape = feature.keys, feature.shape
    # A radius is that of points and lines; areas may state one that means nothing.
    thin = shape.geom_type != "Polygon"
    half_m = feature.number("radius", WALL_WIDTH_M / 2) if thin else WALL_WIDTH_M / 2
    valid = polygons(solid(shape, half_m))
    if valid.is_empty:
        feature.fault("geometry", "has no area: its holes leave nothing of it")
    elif not shape.is_valid:
        feature.findings.notes.append(f"{feature.place} crossed itself: repaired")
    entry = {"id": keys["id"]} if "id" in keys else {}
    if kind == "terrain":
        if "multiplier" not in keys:
            message = "missing; expected the energy relative to plain ground"
            feature.fault("properties.multiplier", message)
        entry["multiplier"] = feature.number("multiplier", 1.0)
        if "turning" in keys:
            entry["turning_multiplier"] = feature.number("turning", 1.0)
    else:
        if "height" in keys:
            entry["height"] = feature.number("height", 1.0)
        if "blocks" in keys:
            entry["blocks"] = keys["blocks"]
    return Area(valid, entry)


def _region(feature: Feature) -> dict[str, Any]:
    """Return the keys of a goal or station."""
    shape, radius_m = feature.shape, feature.number("radius", PLACE_RADIUS_M)
    if shape.geom_type == "Point":
        region = {"circle": {"center": _rounded(shape), "radius": radius_m}}
    elif shape.geom_type == "Polygon":
        hull = shapely.convex_hull(shape)
        if hull.area == 0.0:
            feature.fault("geometry", "has no area")
            return {}
        if hull.area > shape.area * (1.0 + 1e-6):
            message = "is not convex; goals and stations are points or convex polygons"
            feature.fault("geometry", message)
        ring = shapely.get_coordinates(shapely.orient_polygons(hull).exterior)[:-1]
        region = {"polygon": np.round(ring, 6).tolist()}
    else:
        message = f"is a {shape.geom_type}; expected a Point or a Polygon"
        feature.fault("geometry", message)
        return {}
    dwell = feature.keys.get("dwell")
    return region | ({"dwell": feature.number("dwell", 1.0)} if dwell else {})


def _robot(feature: Feature, own_id: str) -> dict[str, Any]:
    """Return the keys of a robot."""
    keys, shape = feature.keys, feature.shape
    if shape.geom_type != "Point":
        feature.fault("geometry", f"is a {shape.geom_type}; expected a Point")
        return {}
    if "model" not in keys:
        feature.findings.notes.append(f"{own_id} states no model: {ROBOT_MODEL}")
    entry: dict[str, Any] = {
        "model": str(keys.get("model", ROBOT_MODEL)),
        "pose": [*_rounded(shape), feature.number("heading", 0.0)],
    }
    if "capacity_J" in keys:
        entry["battery"] = {"capacity_J": feature.number("capacity_J", 1.0)}
    return entry


def _own_id(feature: Feature, default: str) -> str:
    own_id = feature.keys.get("id", default)
    # A route graph numbers its nodes; names of a scene do not begin with numbers alone.
    return f"node_{own_id}" if isinstance(own_id, int) else str(own_id)


def _rounded(point: BaseGeometry) -> list[float]:
    return [round(point.x, 6) + 0.0, round(point.y, 6) + 0.0]


def _recognises(head: Head) -> bool:
    return (
        head.kind == "json" and "type" in head.mapping and "layouts" not in head.mapping
    )


FORMAT = Format(
    kind="geojson",
    title="GeoJSON features, or a Nav2 route graph",
    recognises=_recognises,
    read=read_geojson,
)
