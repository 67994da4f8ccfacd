"""Entries that are well-formed each by themselves become one consistent scene.

Faults of meaning (an id given twice, a robot on an obstacle) are looked for among all
well-formed entries, also when others are malformed: a user sees everything at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import shapely

from mrmg import storage
from mrmg.errors import Fault, SceneError, UsageError
from mrmg.scene.document import elevation_entry
from mrmg.scene.elevation import Elevation
from mrmg.scene.loading.batteries import battery_of, require_one_capacity
from mrmg.scene.loading.elevation import ElevationEntry, elevation_of
from mrmg.scene.loading.faults import EntryError, parsed, unknown_robot
from mrmg.scene.loading.geometry import region_of, shape_of
from mrmg.scene.loading.margins_schema import MarginsEntry
from mrmg.scene.loading.models import load_model, model_folder, with_reference
from mrmg.scene.loading.schema import (
    SECTIONS,
    BatteryEntry,
    BlendEntry,
    FinishEntry,
    GoalEntry,
    ObstacleEntry,
    RegionEntry,
    RobotEntry,
    SceneDocument,
    StationEntry,
    TerrainEntry,
)
from mrmg.scene.loading.shape_schema import (
    LARGEST_M,
    CircleEntry,
    ShapedEntry,
    values_of,
)
from mrmg.scene.loading.starts import crowded_robots, misplaced_robots
from mrmg.scene.objective import ENERGY, MAKESPAN, Objective
from mrmg.scene.region import Region
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.slopes import avoided_ground, slope_faults
from mrmg.scene.types import Finish, Goal, Obstacle, Robot, Scene, Station, TerrainArea
from mrmg.scene.written import WrittenScene

HOME_RADIUS_M = 1.0
"""How near a robot that must return ends to its start."""

RESERVED_IDS = ("bounds", "floor", "world")
"""Names that logs and the simulated world use for other things."""

_Part = TypeVar("_Part")
_Shaped = TypeVar("_Shaped", Obstacle, TerrainArea)


class Assembly:
    """Collects the parts of a scene and their faults."""

    def __init__(
        self, document: dict[str, Any], base: Path | None, *, trust_code: bool = False
    ) -> None:
        """Read all well-formed entries of `document`; see `scene_from_document`."""
        self._trust_code = trust_code
        self.faults: list[Fault] = []
        self._document = document
        self._base = base
        self._models: dict[str, tuple[RobotModel, dict[str, Any]] | None] = {}
        self._parameters: dict[str, dict[str, Any]] = {}
        self._poses: dict[str, str] = {}
        self._require_unique_ids()
        items = self._items("robots")
        self._robot_ids = [str(i.get("id")) for i in items if isinstance(i, dict)]
        self._fleet_battery = self._battery()
        margins = parsed(MarginsEntry, document.get("margins")) or MarginsEntry()
        self._fleet_margins = margins.margins
        self.bounds = self._bounds()
        self.obstacles = self._parts("obstacles", self._obstacle)
        self.terrain = self._parts("terrain", _terrain_area)
        walls = [wall.shape for wall in self.obstacles if wall.blocks is None]
        self._blocked = shapely.disjoint_subset_union_all(walls)
        self.robots = self._parts("robots", self._robot)
        self.elevation = self._elevation()
        self.goals = self._parts("goals", self._goal)
        self.stations = self._parts("stations", self._station)
        self.objective = self._objective()
        steep = avoided_ground(self.elevation, self.robots, self.terrain)
        barriers = [*self.obstacles, *steep]
        poses = self._poses
        self.faults += misplaced_robots(self.robots, poses, self.bounds, barriers)
        self.faults += crowded_robots(self.robots, poses, self.stations)

    def scene(self, checked: SceneDocument) -> Scene:
        """Return the scene; call it only when there are no faults.

        Args:
            checked: the document.
        """
        document = checked.model_dump(mode="json", exclude_none=True, by_alias=True)
        for entry, robot in zip(document["robots"], self.robots, strict=True):
            assert robot.model.origin is not None
            reference = robot.model.origin.reference
            entry["model"] = with_reference(entry["model"], reference)
        if self.elevation is not None and "file" in document["elevation"]:
            document["elevation"] = elevation_entry(self.elevation)
        # Older versions took digests of documents with the models' parameters in place.
        robots = [
            {**robot, "model": self._parameters[robot["id"]]}
            for robot in document["robots"]
        ]
        content = {**document, "robots": robots}
        assert self.bounds is not None
        loaded = Scene(
            name=document["name"],
            bounds=self.bounds,
            obstacles=tuple(self.obstacles),
            terrain=tuple(self.terrain),
            goals=tuple(self.goals),
            stations=tuple(self.stations),
            robots=tuple(self.robots),
            elevation=self.elevation,
            objective=self.objective,
            time_limit_s=document.get("time_limit", math.inf),
        )
        legacy = storage.digest(storage.canonical_json(content))
        written = WrittenScene(
            document=document, loaded=loaded, legacy_digest=legacy, base=self._base
        )
        return replace(loaded, written=written)

    def _fault(self, path: str, message: str) -> None:
        self.faults.append(Fault(path, message))

    @contextmanager
    def _faults_noted(self) -> Iterator[None]:
        """Note the faults of an entry that cannot be used, and leave it out."""
        try:
            yield
        except EntryError as error:
            self.faults += error.faults

    def _parts(self, section: str, build: Callable[[Any, str], _Part]) -> list[_Part]:
        """Return what is built of the well-formed entries of one list.

        Args:
            section: key of the list.
            build: takes an entry and its path.
        """
        parts = []
        for index, item in enumerate(self._items(section)):
            entry = parsed(SECTIONS[section], item)
            if entry is not None:
                with self._faults_noted():
                    parts.append(build(entry, f"{section}.{index}"))
        return parts

    def _items(self, section: str) -> list[Any]:
        raw = self._document.get(section)
        return raw if isinstance(raw, list) else []

    def _require_unique_ids(self) -> None:
        """Note a fault for each id that is reserved or in use."""
        seen: dict[str, str] = {}
        for section in SECTIONS:
            for index, item in enumerate(self._items(section)):
                path = f"{section}.{index}"
                given = item.get("id") if isinstance(item, dict) else None
                name = _default_id(path) if given is None else str(given)
                where = path if given is None else f"{path}.id"
                if name in RESERVED_IDS:
                    self._fault(where, f"the id '{name}' is reserved; choose another")
                elif name in seen:
                    message = f"the id '{name}' is already used by {seen[name]}"
                    self._fault(where, message)
                seen.setdefault(name, path)

    def _bounds(self) -> tuple[float, float, float, float] | None:
        raw = self._document.get("bounds")
        header = parsed(SceneDocument, {"format": 1, "name": "map", "bounds": raw})
        if header is None:
            return None
        x_min, y_min, x_max, y_max = header.bounds
        if x_min >= x_max or y_min >= y_max:
            wanted = "x_min < x_max and y_min < y_max"
        elif max(x_max - x_min, y_max - y_min) > LARGEST_M:
            wanted = f"sides of at most {LARGEST_M:.0f} m"
        else:
            return x_min, y_min, x_max, y_max
        self._fault("bounds", f"got {raw}; expected {wanted}")
        return None

    def _battery(self) -> BatteryEntry | None:
        """Return the fleet's battery; None where it has several capacities."""
        stated = parsed(BatteryEntry, self._document.get("battery", {}))
        fleet = stated or BatteryEntry()
        with self._faults_noted():
            require_one_capacity(fleet, "battery")
            return fleet
        return None

    def _robot(self, entry: RobotEntry, path: str) -> Robot:
        self._poses.setdefault(entry.id, f"{path}.pose")
        model, self._parameters[entry.id] = self._model(entry.model, f"{path}.model")
        if entry.energy is not None:
            model = replace(model, energy_preset=entry.energy)
        if self._fleet_battery is None:
            raise EntryError
        battery = battery_of(entry, self._fleet_battery, model, path)
        finish = None
        with self._faults_noted():
            finish = self._finish(entry, f"{path}.finish")
        if entry.rolling_factor is not None:
            rolling = model.rolling_coefficient * entry.rolling_factor
            model = replace(model, rolling_coefficient=rolling)
        own = entry.margins or MarginsEntry()
        x, y, yaw = entry.pose
        return Robot(
            id=entry.id,
            model=model,
            pose=(x, y, yaw),
            battery=battery,
            finish=finish,
            margins=own.margins.over(self._fleet_margins),
        )

    def _finish(self, entry: RobotEntry, path: str) -> Finish | None:
        wanted = entry.finish
        if wanted is None:
            return None
        if wanted == "start":
            circle = CircleEntry(center=entry.pose[:2], radius=HOME_RADIUS_M)
            wanted = FinishEntry(circle=circle)
            region = region_of(wanted, path)
        else:
            region = self._region(wanted, path)
        return Finish(
            region=region,
            heading_rad=wanted.heading_rad,
            heading_tolerance_rad=wanted.heading_tolerance_rad,
        )

    def _model(self, wanted: Any, path: str) -> tuple[RobotModel, dict[str, Any]]:
        """Return the model that a robot names, and its parameters.

        Raises:
            EntryError: if it cannot be used. Its faults are those of the first robot
                of that kind alone.
        """
        changes = dict(wanted) if isinstance(wanted, dict) else {}
        reference: str = changes.pop("like", wanted)
        try:
            folder = model_folder(reference, self._base)
        except UsageError as error:
            raise EntryError(Fault(path, str(error))) from error
        kind = f"{folder} {changes}"
        if kind not in self._models:
            self._models[kind] = None
            try:
                self._models[kind] = load_model(
                    folder,
                    source=f"{reference}/robot.yaml",
                    changes=changes,
                    trust_code=self._trust_code,
                )
            except SceneError as error:
                texts = [f"{error.source}: {fault}" for fault in error.faults]
                raise EntryError(*(Fault(path, text) for text in texts)) from error
        loaded = self._models[kind]
        if loaded is None:
            raise EntryError
        return loaded

    def _obstacle(self, entry: ObstacleEntry, path: str) -> Obstacle:
        for place, name in enumerate(entry.blocks or []):
            if name not in self._robot_ids:
                message = unknown_robot(name, self._robot_ids)
                self._fault(f"{path}.blocks.{place}", message)
        return _shaped(Obstacle, entry, path)

    def _elevation(self) -> Elevation | None:
        entry = parsed(ElevationEntry, self._document.get("elevation"))
        if entry is None or self.bounds is None:
            return None
        with self._faults_noted():
            elevation = elevation_of(entry, self.bounds, self._base)
            if not elevation.avoid_steep:
                ground = (self.obstacles, self.terrain)
                self.faults += slope_faults(elevation, self.robots, *ground)
            return elevation
        return None

    def _objective(self) -> Objective:
        wanted = self._document.get("objective")
        blend = parsed(BlendEntry, wanted)
        if blend is None:
            return MAKESPAN if wanted == "makespan" else ENERGY
        if not blend.energy and not blend.makespan:
            message = "both weights are 0; give at least one that is positive"
            self._fault("objective", message)
        return Objective(energy_weight=blend.energy, makespan_weight=blend.makespan)

    def _goal(self, entry: GoalEntry, path: str) -> Goal:
        return Goal(region=self._region(entry, path), **values_of(Goal, entry))

    def _station(self, entry: StationEntry, path: str) -> Station:
        return Station(
            region=self._region(entry, path),
            one_at_a_time=entry.capacity == 1,
            **values_of(Station, entry),
        )

    def _region(self, entry: RegionEntry | FinishEntry, path: str) -> Region:
        region = region_of(entry, path)
        if self.bounds and not region.shape.intersects(shapely.box(*self.bounds)):
            self._fault(path, f"lies outside the bounds {list(self.bounds)}")
        elif self._blocked.covers(region.shape):
            names = [
                wall.id
                for wall in self.obstacles
                if wall.blocks is None and wall.shape.intersects(region.shape)
            ]
            self._fault(path, f"lies wholly inside {', '.join(names)}")
        return region


def _terrain_area(entry: TerrainEntry, path: str) -> TerrainArea:
    return _shaped(TerrainArea, entry, path)


def _shaped(kind: type[_Shaped], entry: ShapedEntry, path: str) -> _Shaped:
    """Return the obstacle or terrain area of an entry."""
    own = {"id": _default_id(path), **values_of(kind, entry)}
    return kind(shape=shape_of(entry, path), **own)


def _default_id(path: str) -> str:
    """Return the id of an obstacle or terrain area that has none of its own."""
    section, _, index = path.partition(".")
    return f"{section.removesuffix('s')}_{index}"
