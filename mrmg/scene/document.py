"""From a scene's values back to the content of a scene file.

What is as it was loaded is put as the file put it; what was changed in memory is put in
plain terms: polygons, joules, differences from a model's `robot.yaml`.
"""

from __future__ import annotations

import base64
import copy
import math
import zlib
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

import numpy as np
import shapely

from mrmg.errors import Fault, SceneError
from mrmg.scene.elevation import Elevation
from mrmg.scene.keys import key_of
from mrmg.scene.margins import STATES_NONE
from mrmg.scene.objective import ENERGY, MAKESPAN, Objective
from mrmg.scene.region import Region
from mrmg.scene.types import (
    Battery,
    Goal,
    Obstacle,
    Robot,
    Scene,
    Station,
    TerrainArea,
)

PACKED_M = 1e-4
"""Resolution of packed heights."""

_ROUNDING_M = 1e-9
"""By how much a stored centroid may differ from one worked out anew."""

_Entry = dict[str, Any]

_PLACES = ("obstacles", "terrain", "goals", "stations")
"""Lists of a scene file, but for the robots."""


def scene_document(scene: Scene) -> _Entry:
    """Return the content of a scene file that loads as `scene`.

    Raises:
        SceneError: if the format cannot say something that was changed in memory.
    """
    try:
        return _document(scene)
    except SceneError as error:
        raise SceneError(scene.name, error.faults) from None


def _document(scene: Scene) -> _Entry:
    written = scene.written
    document: _Entry = copy.deepcopy(dict(written.document)) if written else {}
    document |= {"format": 1, "name": scene.name}
    document["bounds"] = [float(value) for value in scene.bounds]
    known = entries_by_value(written.loaded, document) if written else {}
    for section in _PLACES:
        document[section] = _entries(scene, section, document, known)
    if not (scene.holds_loaded("elevation") and scene.holds_loaded("bounds")):
        document["elevation"] = _elevation(scene)
    if not scene.holds_loaded("objective"):
        document["objective"] = _objective_entry(scene.objective)
    if not scene.holds_loaded("time_limit_s"):
        limit_s = float(scene.time_limit_s)
        document["time_limit"] = limit_s if math.isfinite(limit_s) else None
    document.setdefault("battery", {})
    changed = [robot for robot in scene.robots if id(robot) not in known]
    at_once = any(not robot.battery.takes_time_to_fill for robot in changed)
    if at_once and "charging_power" in document["battery"]:
        # A robot's own battery cannot take a charging power of the fleet's back.
        document["battery"], known = {}, {}
    stated = document.get("margins", {})
    if any(robot.margins.entry[key] is None for robot in changed for key in stated):
        # Nor can its margins.
        document["margins"], known = None, {}
    document["robots"] = _entries(scene, "robots", document, known)
    return {key: value for key, value in document.items() if value is not None}


def entries_by_value(scene: Scene, document: Mapping[str, Any]) -> dict[int, _Entry]:
    """Return how the values of a scene are written in its document, by identity."""
    return {
        id(value): {"id": value.id, **entry}
        for section in (*_PLACES, "robots")
        for value, entry in zip(getattr(scene, section), document[section], strict=True)
    }


def _entries(
    scene: Scene, section: str, document: _Entry, known: Mapping[int, _Entry]
) -> list[_Entry]:
    """Return the entries of a section: those of unchanged values as written."""
    if scene.holds_loaded(section):
        return list(document[section])
    values = getattr(scene, section)
    return [known.get(id(value)) or entry_of(value) for value in values]


def entry_of(value: Any) -> Any:
    """Return the entry of a value of `WRITTEN`, in plain terms.

    Raises:
        SceneError: if the format cannot say it.
    """
    return WRITTEN[type(value)](value)


def _entry(value: Any) -> _Entry:
    """Return the entry of a value whose fields are keys, but for those at defaults."""
    entry: _Entry = {}
    for field in fields(value):
        item = getattr(value, field.name)
        if isinstance(item, Region):
            entry |= _region(item)
        elif isinstance(item, shapely.Geometry):
            entry |= polygon_entry(item)
        elif field.name == "one_at_a_time":
            entry |= {"capacity": 1} if item else {}
        elif item is not None and item != field.default:
            entry[key_of(field.name)] = _plain(item)
    return entry


def _plain(item: Any) -> Any:
    if isinstance(item, str):
        return item
    return list(item) if isinstance(item, tuple) else float(item)


def _robot_entry(robot: Robot) -> _Entry:
    """Return the entry of a robot, independent of the fleet's battery.

    Raises:
        SceneError: if its model cannot be traced to a `robot.yaml`.
    """
    entry: _Entry = {
        "id": robot.id,
        **_model(robot),
        "pose": [float(value) for value in robot.pose],
        **_battery(robot.battery),
    }
    if robot.margins != STATES_NONE:
        stated = robot.margins.entry.items()
        entry["margins"] = {key: value for key, value in stated if value is not None}
    if robot.finish is not None:
        entry["finish"] = _entry(robot.finish)
    return entry


def elevation_entry(elevation: Elevation) -> _Entry:
    """Return the entry of an elevation: packed where that is exact."""
    southward = np.asarray(elevation.height_m, dtype=float)[::-1]
    steps = np.round(southward / PACKED_M)
    small = float(np.abs(steps).max(initial=0.0)) < 2**31
    slope = {"slope": "avoid"} if elevation.avoid_steep else {}
    if not small or not np.array_equal(steps * PACKED_M, southward):
        return {"grid": southward.tolist(), **slope}
    return {**packed_heights(steps.astype("<i4")), **slope}


def packed_heights(steps: np.ndarray) -> _Entry:
    """Return the entry of heights in steps of `PACKED_M`, rows from north to south."""
    text = base64.b64encode(zlib.compress(steps.tobytes(), 9)).decode("ascii")
    rows, columns = steps.shape
    return {"packed": {"rows": rows, "columns": columns, "heights": text}}


def _objective_entry(objective: Objective) -> str | _Entry:
    if objective in (ENERGY, MAKESPAN):
        return objective.name
    return {
        "energy": float(objective.energy_weight),
        "makespan": float(objective.makespan_weight),
    }


def _elevation(scene: Scene) -> _Entry | None:
    if scene.elevation is None:
        return None
    if tuple(scene.elevation.bounds) != tuple(scene.bounds):
        message = (
            f"spans {list(scene.elevation.bounds)}, the scene {list(scene.bounds)}; "
            "change both with scene.with_(bounds=..., elevation=...)"
        )
        raise SceneError(scene.name, [Fault("elevation", message)])
    return elevation_entry(scene.elevation)


def polygon_entry(shape: Any) -> _Entry:
    """Return the entry of a polygon's rings.

    Raises:
        SceneError: if it is none.
    """
    if not isinstance(shape, shapely.Polygon) or shape.is_empty:
        message = f"got a {shape.geom_type}; expected one polygon, not empty, an entry"
        raise SceneError("scene", [Fault("polygon", message)])
    rings = [_points(ring.coords[:-1]) for ring in (shape.exterior, *shape.interiors)]
    return {"polygon": rings[0], **({"holes": rings[1:]} if rings[1:] else {})}


def _points(points: Any) -> list[list[float]]:
    return [[float(x), float(y)] for x, y, *_ in points]


def _region(region: Region) -> _Entry:
    if len(region.corners):
        off_m = (
            np.array(shapely.Polygon(region.corners).centroid.coords) - region.center
        )
        if region.radius_m or np.abs(off_m).max() > _ROUNDING_M:
            message = (
                "a region with corners has radius 0 and its centroid for a centre; "
                f"got radius {region.radius_m:g} m and {np.asarray(region.center)}"
            )
            raise SceneError("scene", [Fault("region", message)])
        return {"polygon": _points(region.corners)}
    (center,) = _points([region.center])
    return {"circle": {"center": center, "radius": float(region.radius_m)}}


def _battery(battery: Battery) -> _Entry:
    capacity_J, start_J = float(battery.capacity_J), float(battery.start_J)
    own = {"capacity_J": capacity_J, "reserve": float(battery.reserve_fraction)}
    if battery.takes_time_to_fill:
        own["charging_power"] = float(battery.charging_power_W)
    share = start_J / capacity_J
    exact = share * capacity_J == start_J
    start = {"fraction": share} if exact else {"J": start_J}
    return {"start_energy": start, "battery": own}


def _model(robot: Robot) -> _Entry:
    """Return what identifies a robot's model: its origin, and what differs from it."""
    from mrmg.scene.loading.models import model_parameters

    model, origin = robot.model, robot.model.origin
    if origin is None or (model.mjcf, model.motion_model) != (
        origin.model.mjcf,
        origin.model.motion_model,
    ):
        message = (
            f"{robot.id}'s model '{model.name}', or which files it has, was made in "
            "memory; give it a folder with robot.yaml and MJCF, and name that folder"
        )
        raise SceneError("scene", [Fault(f"robots.{robot.id}.model", message)])
    entry: _Entry = {"model": origin.reference}
    changes = _differences(model_parameters(origin.model), model_parameters(model))
    if "energy" in changes:
        entry["energy"] = changes.pop("energy")
    base, own = origin.model.rolling_coefficient, model.rolling_coefficient
    if "rolling_coefficient" in changes and base * (own / base) == own:
        entry["rolling_factor"] = own / base
        del changes["rolling_coefficient"]
    if changes:
        entry["model"] = {"like": origin.reference, **changes}
    return entry


def _differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> _Entry:
    """Return what `after` states otherwise than `before`, part by part."""
    found: _Entry = {}
    for key, value in after.items():
        if isinstance(value, dict) and isinstance(before[key], dict):
            inner = _differences(before[key], value)
            if inner:
                found[key] = inner
        elif value != before[key]:
            found[key] = value
    return found


WRITTEN: dict[type, Callable[[Any], Any]] = {
    Elevation: elevation_entry,
    Goal: _entry,
    Objective: _objective_entry,
    Obstacle: _entry,
    Robot: _robot_entry,
    Station: _entry,
    TerrainArea: _entry,
}
"""What makes the entry of a value, by its type."""
