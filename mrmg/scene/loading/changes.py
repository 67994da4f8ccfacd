"""Scenes with some values changed, under the checks that a scene file goes through."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from mrmg.errors import Fault, SceneError
from mrmg.scene.document import WRITTEN, entries_by_value, entry_of
from mrmg.scene.loading.faults import unknown_robot
from mrmg.scene.loading.reading import scene_from_document
from mrmg.scene.loading.schema import BatteryEntry, RobotEntry, SceneDocument
from mrmg.scene.types import Scene

_Entry = dict[str, Any]


def changed_scene(
    scene: Scene, changes: Mapping[str, Any], *, trust_code: bool = False
) -> Scene:
    """Return a scene with some of its file's keys changed; see `Scene.with_`.

    Raises:
        SceneError: naming every fault, unknown keys among them.
    """
    source = f"{scene.name} with {', '.join(changes) or 'no change'}"
    before = scene.document
    given = _plain(changes, entries_by_value(scene, before))
    document = before | given
    if given.get("battery") is not None:
        document["battery"] = _merged_battery(before["battery"], given["battery"])
        if "robots" not in given:
            document["robots"] = [
                _without_own(robot, given["battery"]) for robot in before["robots"]
            ]
    return _checked(scene, document, source, trust_code)


def changed_robot(
    scene: Scene,
    robot_id: str,
    changes: Mapping[str, Any],
    *,
    trust_code: bool = False,
) -> Scene:
    """Return a scene with one robot changed; see `Scene.with_robot`.

    Raises:
        SceneError: naming every fault; an unknown robot and unknown keys, too.
    """
    source = f"{scene.name} with {robot_id}'s {', '.join(changes) or 'nothing'}"
    names = [robot.id for robot in scene.robots]
    if robot_id not in names:
        raise SceneError(source, [Fault("robots", unknown_robot(robot_id, names))])
    place = names.index(robot_id)
    document = scene.document
    entry = document["robots"][place]
    given = _plain(changes, {})
    if isinstance(given.get("battery"), dict):
        own = entry.get("battery", {})
        given["battery"] = _merged_battery(own, given["battery"])
    document["robots"][place] = _without_none(entry | given, RobotEntry)
    return _checked(scene, document, source, trust_code)


def _checked(scene: Scene, document: _Entry, source: str, trust_code: bool) -> Scene:
    """Return the scene of a document; it may run the code that `scene` runs."""
    robots = document.get("robots")
    known = [robot["model"] for robot in scene.document["robots"]]
    same = isinstance(robots, list) and all(
        isinstance(robot, dict) and robot.get("model") in known for robot in robots
    )
    return scene_from_document(
        _without_none(document, SceneDocument),
        source=source,
        base=scene.written.base if scene.written else None,
        trust_code=trust_code or (scene.has_custom_motion and same),
    )


def _plain(value: Any, written: Mapping[int, _Entry]) -> Any:
    """Return a value as a scene file has it; `written` are the scene's own."""
    if id(value) in written:
        return written[id(value)]
    if type(value) in WRITTEN:
        return entry_of(value)
    if isinstance(value, Mapping):
        return {key: _plain(item, written) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item, written) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist(), written)
    if isinstance(value, Path):
        return str(value)
    # Scenes have inf for no limit, files leave it out.
    return None if isinstance(value, float) and math.isinf(value) else value


def _merged_battery(battery: _Entry, given: Any) -> Any:
    """Return a battery's entry with what is given in place of what it named."""
    if not isinstance(given, dict):
        return given  # and the loader reports what is wrong
    return _without_none(_kept(battery, given) | given, BatteryEntry)


def _kept(battery: _Entry, given: _Entry) -> _Entry:
    """Return what of a battery's entry another one does not name, in whatever unit."""
    replaced = set(given)
    if any(key.startswith("capacity_") for key in given):
        replaced |= {key for key in battery if key.startswith("capacity_")}
    return {key: item for key, item in battery.items() if key not in replaced}


def _without_own(robot: _Entry, given: Any) -> _Entry:
    """Return a robot's entry without what the fleet's battery is given now."""
    if not isinstance(given, dict) or "battery" not in robot:
        return robot
    return {**robot, "battery": _kept(robot["battery"], given)}


def _without_none(entry: _Entry, model: type[BaseModel]) -> _Entry:
    """Return an entry without the keys that are taken back; unknown ones stay."""
    known = model.model_fields
    return {
        key: value
        for key, value in entry.items()
        if value is not None or key not in known
    }
