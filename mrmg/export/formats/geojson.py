"""The scene and the paths of its robots as GeoJSON features, in metres of the scene.

Features have a `kind`, obstacle, terrain, goal, station or robot, as `mrmg scene
import` reads them; paths have none, but the `robot` whose they are, the `motion`,
planned or driven, and for each point time [s] and content of the battery [J].
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from mrmg import storage
from mrmg.export.mission import Course, Mission, path_indices
from mrmg.export.table import Files, Format
from mrmg.scene.types import Scene

_OF_A_VISIT = ("robot", "time_s", "energy_J")
_LOCAL_METRES = {"type": "name", "properties": {"name": "local"}}


def files(mission: Mission, versions: tuple[str, ...] = ()) -> Files:
    """Return the collection of features."""
    collection = {
        "type": "FeatureCollection",
        "name": mission.scene.name,
        "crs": _LOCAL_METRES,
        "features": [
            *_areas(mission.scene),
            *_places(mission),
            *_robots(mission.scene),
            *(_path(course, mission.motion) for course in mission.courses),
        ],
    }
    return {"mission.geojson": storage.canonical_json(collection).encode()}


def _areas(scene: Scene) -> Iterator[dict[str, Any]]:
    for obstacle in scene.obstacles:
        keys = {"kind": "obstacle", "id": obstacle.id, "height": obstacle.height_m}
        some = {} if obstacle.blocks is None else {"blocks": list(obstacle.blocks)}
        yield _feature(obstacle.shape, **keys, **some)
    for area in scene.terrain:
        yield _feature(
            area.shape,
            kind="terrain",
            id=area.id,
            multiplier=area.multiplier,
            turning=area.turning_multiplier,
        )


def _places(mission: Mission) -> Iterator[dict[str, Any]]:
    """Yield goals and stations with their visits."""
    visits: dict[str, list[dict[str, Any]]] = {}
    for course in mission.courses:
        for visit in course.visits:
            made = {name: getattr(visit, name) for name in _OF_A_VISIT}
            visits.setdefault(visit.target, []).append(made)
    for target in mission.scene.targets():
        keys = {
            "kind": target.kind,
            "id": target.id,
            "dwell": target.dwell_s,
            "visits": visits.get(target.id, []),
        }
        region = target.region
        if len(region.corners):
            yield _feature(region.shape, **keys)
        else:
            disc = {"radius": region.radius_m}
            yield _feature(shapely.Point(region.center), **keys, **disc)


def _robots(scene: Scene) -> Iterator[dict[str, Any]]:
    for robot in scene.robots:
        x_m, y_m, heading_rad = robot.pose
        origin = robot.model.origin
        yield _feature(
            shapely.Point(x_m, y_m),
            kind="robot",
            id=robot.id,
            model=origin.reference if origin else robot.model.name,
            heading=heading_rad,
            capacity_J=robot.battery.capacity_J,
        )


def _path(course: Course, motion: str) -> dict[str, Any]:
    at = path_indices(course.time_s, course.state)
    at = np.resize(at, max(2, len(at)))  # a line has two points at least
    return _feature(
        shapely.LineString(course.state[at, :2]),
        robot=course.robot,
        motion=motion,
        tour=list(course.tour),
        time_s=np.round(course.time_s[at], 3).tolist(),
        energy_J=np.round(course.energy_J[at], 1).tolist(),
    )


def _feature(shape: BaseGeometry, **properties: Any) -> dict[str, Any]:
    return {
        "type": "Feature",
        "geometry": shapely.geometry.mapping(shape),
        "properties": properties,
    }


FORMAT = Format(suffix=".geojson", files=files)
