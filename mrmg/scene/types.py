"""The problem statement as immutable values; SI units throughout."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, ClassVar

from shapely.geometry import Polygon

from mrmg.errors import of_robot
from mrmg.scene.content import content, content_digest, contents, require_finite
from mrmg.scene.elevation import Elevation
from mrmg.scene.margins import STATES_NONE, Margins
from mrmg.scene.objective import ENERGY, Objective
from mrmg.scene.region import HEADING_TOLERANCE_RAD, Region
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.written import WrittenScene


@dataclass(frozen=True, kw_only=True)
class Obstacle:
    """Ground no robot may touch, or only some robots may.

    Attributes:
        id: unique name.
        shape: outline with holes [m].
        height_m: height of the obstacle in the simulated world; 0 for ground that is
            too steep.
        blocks: ids of the robots it stops; None stops all.
    """

    id: str
    shape: Polygon
    height_m: float
    blocks: tuple[str, ...] | None = None

    @property
    def is_steep_ground(self) -> bool:
        """Whether it is ground that robots cannot climb, and no thing on the ground."""
        return self.height_m == 0.0

    def stops(self, robot_id: str) -> bool:
        """Return whether `robot_id` must keep off this obstacle."""
        return self.blocks is None or robot_id in self.blocks


@dataclass(frozen=True, kw_only=True)
class TerrainArea:
    """Ground that resists rolling and turning more than plain ground, or less.

    Attributes:
        id: unique name.
        shape: where it is [m].
        multiplier: rolling resistance over that of plain ground.
        turning_multiplier: turning resistance over that of plain ground; measured
            terrains need it, as the two are not in proportion.
        energy_spread: standard deviation of what different runs of equal motion take
            on it, relative to their mean; 0 where nobody measured it.
    """

    id: str
    shape: Polygon
    multiplier: float
    turning_multiplier: float = 1.0
    energy_spread: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A region that some robot's reference point must enter once.

    Attributes:
        kind: "goal".
        id: unique name.
        region: where it is.
        dwell_s: how long the robot must stay there without a break.
        heading_rad: its yaw there; None for any.
        heading_tolerance_rad: allowed deviation from the heading.
    """

    kind: ClassVar[str] = "goal"
    id: str
    region: Region
    dwell_s: float = 0.0
    heading_rad: float | None = None
    heading_tolerance_rad: float = HEADING_TOLERANCE_RAD


@dataclass(frozen=True, kw_only=True)
class Station:
    """A region in which a robot's battery is filled.

    Attributes:
        kind: "station".
        id: unique name.
        region: where it is.
        dwell_s: how long a robot must stay there without a break for a visit.
        one_at_a_time: whether the reference points of two robots must never be there.
    """

    kind: ClassVar[str] = "station"
    id: str
    region: Region
    dwell_s: float = 0.0
    one_at_a_time: bool = False


@dataclass(frozen=True, kw_only=True)
class Battery:
    """Energy store of one robot.

    Attributes:
        capacity_J: energy when full.
        start_J: energy at the start of the mission.
        reserve_fraction: share of the capacity that must always remain.
        charging_power_W: with which stations fill it; inf for at once.
    """

    capacity_J: float
    start_J: float
    reserve_fraction: float
    charging_power_W: float = math.inf

    @property
    def reserve_J(self) -> float:
        """Energy that must always remain."""
        return self.capacity_J * self.reserve_fraction

    @property
    def takes_time_to_fill(self) -> bool:
        """Whether robots must stay at stations to recharge."""
        return math.isfinite(self.charging_power_W)


@dataclass(frozen=True, kw_only=True)
class Finish:
    """Where a robot must be at rest when the mission ends.

    Attributes:
        region: must hold the reference point.
        heading_rad: its yaw there; None for any.
        heading_tolerance_rad: allowed deviation from the heading.
    """

    region: Region
    heading_rad: float | None
    heading_tolerance_rad: float


@dataclass(frozen=True, kw_only=True)
class Robot:
    """One robot of the fleet: a model, where it starts and with what energy.

    Attributes:
        id: unique name.
        model: its kind.
        pose: start (x [m], y [m], yaw [rad]) of the reference point, at rest.
        battery: its energy store.
        finish: where it must end; None for anywhere.
        margins: distances that plans keep, as its entry or the fleet's states them.
    """

    id: str
    model: RobotModel
    pose: tuple[float, float, float]
    battery: Battery
    finish: Finish | None = None
    margins: Margins = STATES_NONE


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """A mission: map, terrain, goals, stations and the fleet.

    Scenes are equal when all that counts for planning and driving is: they have the
    same digest then.

    Attributes:
        name: short name.
        bounds: (x_min, y_min, x_max, y_max) [m].
        obstacles, terrain, goals, stations, robots: in the order of the file; where
            terrain areas overlap, the later one counts.
        elevation: heights of the ground; None is flat ground at height 0.
        objective: what its plans are judged by.
        time_limit_s: by when all robots must be at rest, everything done; inf for any
            time.
        written: how the file put it; None for a scene made in memory.
    """

    name: str
    bounds: tuple[float, float, float, float]
    obstacles: tuple[Obstacle, ...]
    terrain: tuple[TerrainArea, ...]
    goals: tuple[Goal, ...]
    stations: tuple[Station, ...]
    robots: tuple[Robot, ...]
    elevation: Elevation | None = None
    objective: Objective = ENERGY
    time_limit_s: float = math.inf
    written: WrittenScene | None = field(default=None, repr=False)

    @staticmethod
    def around(model: RobotModel, half_m: float) -> Scene:
        """Return plain ground that reaches so far from one robot, `r1`, at (0, 0)."""
        full_J = model.battery_capacity_J
        battery = Battery(capacity_J=full_J, start_J=full_J, reserve_fraction=0.0)
        robot = Robot(id="r1", model=model, pose=(0.0, 0.0, 0.0), battery=battery)
        return Scene(
            name=model.name,
            bounds=(-half_m, -half_m, half_m, half_m),
            obstacles=(),
            terrain=(),
            goals=(),
            stations=(),
            robots=(robot,),
        )

    @cached_property
    def digest(self) -> str:
        """Fingerprint of the content, models and their files included.

        Raises:
            SceneError: if a number was changed in memory to one that is not finite.
        """
        known = self.content()
        require_finite(self.name, known)
        return content_digest(known)

    @cached_property
    def barriers(self) -> tuple[Obstacle, ...]:
        """The obstacles, and with `slope: avoid` the ground too steep for robots."""
        from mrmg.scene.slopes import avoided_ground

        steep = avoided_ground(self.elevation, self.robots, self.terrain)
        return self.obstacles + steep

    @property
    def document(self) -> dict[str, Any]:
        """The scene as a scene file's content, as plain data.

        `scene.loading.scene_from_document` turns it back into an equal scene. What is
        as it was loaded is as it was written.

        Raises:
            SceneError: if a scene file cannot say what was changed in memory.
        """
        from mrmg.scene.document import scene_document

        return scene_document(self)

    def with_(self, *, trust_code: bool = False, **changes: Any) -> Scene:
        """Return this scene with some keys of its file changed, checked as a file is.

        `scene.with_(battery={"capacity_m": 300}, time_limit=200)`. Values are as in
        scene files, or values of another scene's fields; lists may mix both:
        `scene.with_(goals=[*scene.goals, {"id": "g9", "circle": {...}}])`. None takes
        a key back to its default. A `battery` holds for the whole fleet: it replaces
        what it names of the fleet's and of every robot's own, and nothing else.

        Args:
            trust_code: whether robot models may bring Python code; those that this
                scene has already may.
            changes: name, bounds, obstacles, terrain, elevation, goals, stations,
                battery, margins, objective, time_limit, robots.

        Raises:
            SceneError: naming every fault, unknown keys among them.
        """
        from mrmg.scene.loading.changes import changed_scene

        return changed_scene(self, changes, trust_code=trust_code)

    def with_robot(
        self, robot_id: str, *, trust_code: bool = False, **changes: Any
    ) -> Scene:
        """Return this scene with one robot changed, checked as a file is.

        `scene.with_robot("r1", battery={"capacity_Wh": 12}, pose=[5, 5, 0])`. Values
        are those of the robot's entry in a scene file; of its battery what is named.

        Raises:
            SceneError: naming every fault; an unknown robot and unknown keys, too.
        """
        from mrmg.scene.loading.changes import changed_robot

        return changed_robot(self, robot_id, changes, trust_code=trust_code)

    def content(self) -> dict[str, Any]:
        """Return what counts for the digest."""
        return contents(self, without=("written",))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def is_named(self, digest: str) -> bool:
        """Return whether a digest is this scene's, by this version or an older one."""
        if digest == self.digest:
            return True
        legacy = self.written is not None and digest == self.written.legacy_digest
        return legacy and self.is_as_loaded

    @property
    def is_as_loaded(self) -> bool:
        """Whether nothing was changed in memory since a file or document was loaded."""
        names = {item.name for item in fields(self)} - {"written"}
        return all(self.holds_loaded(name) for name in names)

    def holds_loaded(self, name: str) -> bool:
        """Return whether a field holds what it was loaded as."""
        if self.written is None:
            return False
        now, then = getattr(self, name), getattr(self.written.loaded, name)
        return now is then or bool(content(now) == content(then))

    @property
    def has_custom_motion(self) -> bool:
        """Whether a robot moves by Python code of its model, which was trusted."""
        return any(robot.model.has_custom_motion for robot in self.robots)

    @property
    def has_destinations(self) -> bool:
        """Whether there is a goal or a finish to drive to."""
        return bool(self.goals) or any(robot.finish for robot in self.robots)

    def robot(self, robot_id: str) -> Robot:
        """Return the robot of that id; raises UsageError if there is none."""
        return of_robot(robot_id, {robot.id: robot for robot in self.robots})

    def targets(self) -> tuple[Goal | Station, ...]:
        """Return all goals, then all stations: the numbering the planner uses."""
        return (*self.goals, *self.stations)
