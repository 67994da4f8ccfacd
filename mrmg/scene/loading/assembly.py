"""Entries that are well-formed each by themselves become one consistent scene.

Faults of meaning (an id given twice, a robot on an obstacle) are looked for among all
well-formed entries, also when others are malformed: a user sees everything at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import shapely
from shapely.geometry import Polygon

from mrmg import storage
from mrmg.errors import Fault, SceneError, nearest
from mrmg.scene.elevation import Elevation
from mrmg.scene.loading.batteries import battery_of
from mrmg.scene.loading.elevation import elevation_of
from mrmg.scene.loading.elevation_schema import ElevationEntry
from mrmg.scene.loading.faults import parsed
from mrmg.scene.loading.geometry import region_of, shape_of
from mrmg.scene.loading.margins_schema import MarginsEntry
from mrmg.scene.loading.models import load_model, model_folder
from mrmg.scene.loading.schema import (
    SECTIONS,
    BatteryEntry,
    BlendEntry,
    FinishEntry,
    SceneDocument,
)
from mrmg.scene.loading.shape_schema import LARGEST_M, CircleEntry
from mrmg.scene.loading.starts import crowded_robots, misplaced_robots
from mrmg.scene.objective import ENERGY, MAKESPAN, Objective
from mrmg.scene.region import HEADING_TOLERANCE_RAD, Region
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.slopes import slope_faults, steep_ground
from mrmg.scene.types import Finish, Goal, Obstacle, Robot, Scene, Station, TerrainArea
from mrmg.scene.written import WrittenScene

HOME_RADIUS_M = 1.0
"""How near a robot that must return ends to its start."""

RESERVED_IDS = ("bounds", "floor", "world")
"""Names that logs and the simulated world use for other things."""


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
        self._models: dict[str, tuple[RobotModel, dict[str, Any]]] = {}
        self._loaded: dict[str, tuple[RobotModel, dict[str, Any]] | None] = {}
        self._references: dict[str, Any] = {}
        self._elevation_document: dict[str, Any] = {}
        self._steep: list[tuple[Polygon, tuple[str, ...]]] = []
        self.ids = self._unique_ids()
        self.bounds = self._bounds()
        self.robots = list(self._robots())
        self.obstacles = list(self._obstacles())
        self.terrain = list(self._terrain())
        self.elevation = self._elevation()
        self.goals = [
            Goal(
                id=entry.id,
                region=region,
                dwell_s=entry.dwell or 0.0,
                heading_rad=entry.heading,
                heading_tolerance_rad=entry.heading_tolerance or HEADING_TOLERANCE_RAD,
            )
            for entry, region in self._regions("goals")
        ]
        self.stations = [
            Station(
                id=entry.id,
                region=region,
                dwell_s=entry.dwell or 0.0,
                one_at_a_time=entry.capacity == 1,
            )
            for entry, region in self._regions("stations")
        ]
        self.objective = self._objective()
        self.faults += self._faults_of_starts()

    def _faults_of_starts(self) -> list[Fault]:
        places = {robot: f"{path}.pose" for robot, path in self.ids.items()}
        return [
            *misplaced_robots(
                self.robots, places, self.bounds, self.obstacles, self._steep
            ),
            *crowded_robots(self.robots, places, self.stations),
        ]

    def scene(self) -> Scene:
        """Return the scene; call it only when there are no faults."""
        document = SceneDocument.model_validate(self._document).model_dump(
            mode="json", exclude_none=True
        )
        for robot in document["robots"]:
            robot["model"] = self._references[robot["id"]]
        if self.elevation is not None:
            document["elevation"] = self._elevation_document
        # Older versions took digests of documents with the models' parameters in place.
        parameters = {robot.id: self._models[robot.id][1] for robot in self.robots}
        robots = [
            {**robot, "model": parameters[robot["id"]]} for robot in document["robots"]
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

    def _entries(self, section: str) -> Iterator[tuple[int, str, Any]]:
        """Yield (index, path, entry) of the well-formed entries of one list."""
        for index, item in enumerate(self._items(section)):
            entry = parsed(SECTIONS[section], item)
            if entry is not None:
                yield index, f"{section}.{index}", entry

    def _items(self, section: str) -> list[Any]:
        raw = self._document.get(section)
        return raw if isinstance(raw, list) else []

    def _unique_ids(self) -> dict[str, str]:
        """Return the path of every id; a second use of one is a fault."""
        seen: dict[str, str] = {}
        for section in SECTIONS:
            for index, item in enumerate(self._items(section)):
                path = f"{section}.{index}"
                given = item.get("id") if isinstance(item, dict) else None
                name = _default_id(section, index) if given is None else str(given)
                where = path if given is None else f"{path}.id"
                if name in RESERVED_IDS:
                    self._fault(where, f"the id '{name}' is reserved; choose another")
                elif name in seen:
                    message = f"the id '{name}' is already used by {seen[name]}"
                    self._fault(where, message)
                seen.setdefault(name, path)
        return seen

    def _bounds(self) -> tuple[float, float, float, float] | None:
        raw = self._document.get("bounds")
        header = parsed(SceneDocument, {"format": 1, "name": "map", "bounds": raw})
        if not isinstance(header, SceneDocument):
            return None
        x_min, y_min, x_max, y_max = header.bounds
        if x_min >= x_max or y_min >= y_max:
            message = f"got {raw}; expected x_min < x_max and y_min < y_max"
            self._fault("bounds", message)
            return None
        if max(x_max - x_min, y_max - y_min) > LARGEST_M:
            message = f"got {raw}; expected sides of at most {LARGEST_M:.0f} m"
            self._fault("bounds", message)
            return None
        return x_min, y_min, x_max, y_max

    def _robots(self) -> Iterator[Robot]:
        fleet = self._document.get("battery", {})
        default = parsed(BatteryEntry, fleet) or BatteryEntry()
        stated = parsed(MarginsEntry, self._document.get("margins")) or MarginsEntry()
        for _, path, entry in self._entries("robots"):
            model = self._model(entry.id, entry.model, path)
            if model is None:
                continue
            if entry.energy is not None:
                model = replace(model, energy_preset=entry.energy)
            battery = battery_of(entry, default, model, path)
            if isinstance(battery, list):
                self.faults += battery
                continue
            finish = self._finish(entry, model, f"{path}.finish")
            x, y, yaw = entry.pose
            if entry.rolling_factor is not None:
                rolling = model.rolling_coefficient * entry.rolling_factor
                model = replace(model, rolling_coefficient=rolling)
            yield Robot(
                id=entry.id,
                model=model,
                pose=(x, y, yaw),
                battery=battery,
                finish=finish,
                margins=(entry.margins or MarginsEntry()).margins.over(stated.margins),
            )

    def _finish(self, entry: Any, model: RobotModel, path: str) -> Finish | None:
        if entry.finish is None:
            return None
        wanted = entry.finish
        if wanted == "start":
            circle = CircleEntry(center=list(entry.pose[:2]), radius=HOME_RADIUS_M)
            wanted = FinishEntry(circle=circle)
        region = region_of(wanted, path)
        if isinstance(region, list):
            self.faults += region
            return None
        return Finish(
            region=region,
            heading_rad=wanted.heading,
            heading_tolerance_rad=wanted.heading_tolerance,
        )

    def _model(self, robot_id: str, wanted: Any, path: str) -> RobotModel | None:
        changes = dict(wanted) if isinstance(wanted, dict) else {}
        reference: str = changes.pop("like", wanted)
        folder = model_folder(reference, self._base)
        if isinstance(folder, str):
            self._fault(f"{path}.model", folder)
            return None
        kind = f"{folder} {changes}"
        if kind not in self._loaded:
            # Once for all robots of a kind: its faults are reported once, too.
            try:
                self._loaded[kind] = load_model(
                    folder,
                    source=f"{reference}/robot.yaml",
                    changes=changes,
                    trust_code=self._trust_code,
                )
            except SceneError as error:
                self._loaded[kind] = None
                for fault in error.faults:
                    self._fault(f"{path}.model", f"{error.source}: {fault}")
        loaded = self._loaded[kind]
        if loaded is None:
            return None
        self._models[robot_id] = loaded
        found = str(folder) if "/" in reference else reference
        self._references[robot_id] = {"like": found, **changes} if changes else found
        return self._models[robot_id][0]

    def _obstacles(self) -> Iterator[Obstacle]:
        items = self._items("robots")
        robots = [str(item.get("id")) for item in items if isinstance(item, dict)]
        for index, path, entry in self._entries("obstacles"):
            for place, name in enumerate(entry.blocks or []):
                if name not in robots:
                    known = ", ".join(robots) if robots else "none"
                    self._fault(
                        f"{path}.blocks.{place}",
                        f"no robot '{name}'{nearest(name, robots)}; robots: {known}",
                    )
            shape = self._shape(entry, path)
            if shape is not None:
                yield Obstacle(
                    id=entry.id or _default_id("obstacles", index),
                    shape=shape,
                    height_m=entry.height,
                    blocks=None if entry.blocks is None else tuple(entry.blocks),
                )

    def _terrain(self) -> Iterator[TerrainArea]:
        for index, path, entry in self._entries("terrain"):
            shape = self._shape(entry, path)
            if shape is not None:
                yield TerrainArea(
                    id=entry.id or _default_id("terrain", index),
                    shape=shape,
                    multiplier=entry.multiplier,
                    turning_multiplier=entry.turning_multiplier,
                    energy_spread=entry.energy_spread,
                )

    def _elevation(self) -> Elevation | None:
        entry = parsed(ElevationEntry, self._document.get("elevation"))
        if entry is None or self.bounds is None:
            return None
        found = elevation_of(entry, self.bounds, self._base)
        if isinstance(found, list):
            self.faults += found
            return None
        elevation, self._elevation_document = found
        if elevation.avoid_steep:
            self._steep = steep_ground(elevation, self.robots, self.terrain)
        else:
            ground = (self.obstacles, self.terrain)
            self.faults += slope_faults(elevation, self.robots, *ground)
        return elevation

    def _objective(self) -> Objective:
        wanted = self._document.get("objective")
        blend = parsed(BlendEntry, wanted)
        if blend is None:
            return MAKESPAN if wanted == "makespan" else ENERGY
        if not blend.energy and not blend.makespan:
            message = "both weights are 0; give at least one that is positive"
            self._fault("objective", message)
        return Objective(energy_weight=blend.energy, makespan_weight=blend.makespan)

    def _shape(self, entry: Any, path: str) -> Polygon | None:
        shape = shape_of(entry, path)
        if isinstance(shape, list):
            self.faults += shape
            return None
        return shape

    def _regions(self, section: str) -> Iterator[tuple[Any, Region]]:
        walls = [wall.shape for wall in self.obstacles if wall.blocks is None]
        blocked = shapely.disjoint_subset_union_all(walls)
        for _, path, entry in self._entries(section):
            region = region_of(entry, path)
            if isinstance(region, list):
                self.faults += region
                continue
            if self.bounds and not region.shape.intersects(shapely.box(*self.bounds)):
                self._fault(path, f"lies outside the bounds {list(self.bounds)}")
            elif blocked.covers(region.shape):
                names = [
                    wall.id
                    for wall in self.obstacles
                    if wall.blocks is None and wall.shape.intersects(region.shape)
                ]
                self._fault(path, f"lies wholly inside {', '.join(names)}")
            yield entry, region


def _default_id(section: str, index: int) -> str:
    return f"{section.removesuffix('s')}_{index}"
