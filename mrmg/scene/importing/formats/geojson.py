"""GeoJSON: features of `kind` obstacle, terrain, goal, station or robot; Nav2 graphs.

Coordinates are those of the member `crs`; without it longitude and latitude, as
RFC 7946 has it, or metres where they go with a map in local metres. The points of a
Nav2 route graph become goals, those that charge become stations, and its edges lanes.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError, nearest
from mrmg.scene.importing.features import Content, crs_of, features_of, is_graph_edge
from mrmg.scene.importing.frames import Frame, frame_of
from mrmg.scene.importing.land_cover import LandCover, read_classes
from mrmg.scene.importing.layers import (
    CHARGING,
    Area,
    ImportOptions,
    Layer,
    lanes_note,
    polygons,
)
from mrmg.scene.importing.registry import Format, Head, read_json
from mrmg.scene.loading.faults import shown

KINDS = ("obstacle", "terrain", "goal", "station", "robot")
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
    content, document = Content(str(path)), read_json(path)
    features = list(features_of(document, content))
    if content.faults or not features:
        faults = content.faults or [Fault("features", "there are none")]
        raise SceneError(str(path), faults)
    crs = crs_of(document, features, options, content)
    points = np.concatenate([shapely.get_coordinates(item[2]) for item in features])
    frame = options.frame or frame_of(crs, points)
    if content.faults:
        raise SceneError(str(path), content.faults)
    placed = [
        (place, keys, _placed(shape, frame, crs, str(path)))
        for place, keys, shape in features
    ]
    if options.classes is not None and not any("kind" in keys for _, keys, _ in placed):
        return _land_cover(placed, frame, options, str(path))
    for place, keys, shape in placed:
        _add(place, keys, shape, content)
    if content.faults:
        raise SceneError(str(path), content.faults)
    return Layer(
        frame=frame,
        crs=crs,
        obstacles=content.areas["obstacle"],
        terrain=content.areas["terrain"],
        goals=content.entries["goal"],
        stations=content.entries["station"],
        robots=content.entries["robot"],
        lanes=content.lanes,
        notes=[*_counts(content), *content.notes],
    )


def _counts(content: Content) -> Iterator[str]:
    counts = {kind: len(found) for kind, found in content.areas.items()}
    counts |= {kind: len(found) for kind, found in content.entries.items()}
    yield "features: " + ", ".join(f"{n} {kind}" for kind, n in counts.items() if n)
    if content.lanes:
        yield lanes_note(len(content.lanes))


def _placed(
    shape: BaseGeometry, frame: Frame, crs: str | None, source: str
) -> BaseGeometry:
    return shapely.transform(shape, lambda p: frame.metres(p, crs, source))


def _land_cover(
    features: list[Any], frame: Frame, options: ImportOptions, source: str
) -> Layer:
    cover = LandCover(read_classes(options.classes, source))
    by_class: dict[str, list[BaseGeometry]] = {}
    unnamed = 0
    for _, keys, shape in features:
        if "class" in keys:
            by_class.setdefault(str(keys["class"]), []).append(polygons(shape))
        else:
            unnamed += 1
    for name, shapes in by_class.items():
        cover.add(name, shapes)
    notes = []
    if unnamed:
        notes = [f"{counted(unnamed, 'feature')} without 'class' left out"]
    return cover.layer(frame, None, notes)


def _add(
    place: str, keys: dict[str, Any], shape: BaseGeometry, content: Content
) -> None:
    kind = keys.get("kind")
    if kind is None and is_graph_edge(keys):
        content.lanes.append(shape)
    elif kind is None and shape.geom_type == "Point" and "id" in keys:
        node = "station" if CHARGING.search(str(keys)) else "goal"
        _add_place(node, place, keys, shape, content)
    elif kind in ("obstacle", "terrain"):
        _add_area(kind, place, keys, shape, content)
    elif kind in ("goal", "station"):
        _add_place(kind, place, keys, shape, content)
    elif kind == "robot":
        _add_robot(place, keys, shape, content)
    elif kind is None:
        note = "features without 'kind' were left out"
        if note not in content.notes:
            content.notes.append(note)
    else:
        message = f"got {shown(kind)}{nearest(str(kind), KINDS)}; of {', '.join(KINDS)}"
        content.faults.append(Fault(f"{place}.properties.kind", message))


def _add_area(
    kind: str, place: str, keys: dict[str, Any], shape: BaseGeometry, content: Content
) -> None:
    if shape.area == 0.0:
        radius_m = content.number(keys, place, "radius", WALL_WIDTH_M / 2)
        shape = shape.buffer(radius_m)
    valid = polygons(shape)
    if not valid.equals(shape):
        content.notes.append(f"{place} crossed itself: repaired")
    entry = {"id": keys["id"]} if "id" in keys else {}
    if kind == "terrain":
        if "multiplier" not in keys:
            message = "missing; expected the energy relative to plain ground"
            content.faults.append(Fault(f"{place}.properties.multiplier", message))
        entry["multiplier"] = content.number(keys, place, "multiplier", 1.0)
        if "turning" in keys:
            entry["turning_multiplier"] = content.number(keys, place, "turning", 1.0)
    else:
        if "height" in keys:
            entry["height"] = content.number(keys, place, "height", 1.0)
        if "blocks" in keys:
            entry["blocks"] = keys["blocks"]
    content.areas[kind].append(Area(valid, entry))


def _add_place(
    kind: str, place: str, keys: dict[str, Any], shape: BaseGeometry, content: Content
) -> None:
    entry: dict[str, Any] = {"id": _own_id(kind, keys, content)}
    radius_m = content.number(keys, place, "radius", PLACE_RADIUS_M)
    if shape.geom_type == "Point":
        entry["circle"] = {"center": _rounded(shape), "radius": radius_m}
    elif shape.geom_type == "Polygon":
        hull = shapely.convex_hull(shape)
        if hull.area > shape.area * (1.0 + 1e-6):
            message = "is not convex; goals and stations are points or convex polygons"
            content.faults.append(Fault(f"{place}.geometry", message))
        ring = shapely.get_coordinates(shapely.orient_polygons(hull).exterior)[:-1]
        entry["polygon"] = np.round(ring, 6).tolist()
    else:
        message = f"is a {shape.geom_type}; expected a Point or a Polygon"
        content.faults.append(Fault(f"{place}.geometry", message))
        return
    if keys.get("dwell"):
        entry["dwell"] = content.number(keys, place, "dwell", 1.0)
    content.entries[kind].append(entry)


def _add_robot(
    place: str, keys: dict[str, Any], shape: BaseGeometry, content: Content
) -> None:
    if shape.geom_type != "Point":
        message = f"is a {shape.geom_type}; expected a Point"
        content.faults.append(Fault(f"{place}.geometry", message))
        return
    own_id = _own_id("robot", keys, content)
    if "model" not in keys:
        content.notes.append(f"{own_id} states no model: {ROBOT_MODEL}")
    heading = content.number(keys, place, "heading", 0.0) if "heading" in keys else 0.0
    entry: dict[str, Any] = {
        "id": own_id,
        "model": str(keys.get("model", ROBOT_MODEL)),
        "pose": [*_rounded(shape), heading],
    }
    if "capacity_J" in keys:
        capacity_J = content.number(keys, place, "capacity_J", 1.0)
        entry["battery"] = {"capacity_J": capacity_J}
    content.entries["robot"].append(entry)


def _own_id(kind: str, keys: dict[str, Any], content: Content) -> str:
    own_id = keys.get("id")
    if own_id is None:
        return f"{kind}_{len(content.entries[kind]) + 1}"
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
