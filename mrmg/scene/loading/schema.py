"""Scene format 1: what a scene file may say.

A scene is one YAML file (scalars as in YAML 1.2; metres, radians, joules):

    format: 1
    name: depot                       # default: the file's name
    bounds: [0, 0, 100, 100]          # x_min, y_min, x_max, y_max; robots stay inside
    obstacles:                        # one of polygon (with holes), box, circle each
      - {id: hall, polygon: [[10, 10], [30, 10], [30, 20]], holes: [], height: 1.0}
      - {box: {center: [50, 50], size: [8, 4], yaw: 0.3}, blocks: [r1]}
      - {circle: {center: [70, 30], radius: 3}}
    terrain:                          # where areas overlap, the later entry counts
      - {id: mud, polygon: [[0, 0], [20, 0], [20, 20]], multiplier: 2.5,
         turning_multiplier: 1.5}  # of turning resistance; 1 where it is left out
    elevation: {hills: [{center: [60, 60], height: 4, radius: 25}]}   # default: flat
    goals:                            # convex: circle or polygon; each visited once
      - {id: g1, circle: {center: [20, 30], radius: 1.5}}
      - {id: g2, circle: {center: [60, 30], radius: 1.5}, dwell: 20}
      - {id: g3, circle: {center: [60, 50], radius: 1.5}, heading: 1.57}
    stations:                         # convex; entering one fills the battery
      - {id: s1, polygon: [[40, 40], [43, 40], [43, 43], [40, 43]]}
    battery: {capacity_m: 240, reserve: 0.05}
    margins: {obstacle: 0.2, robot: 0.4}   # m; default: from the models
    objective: energy                 # or makespan, or {energy: w, makespan: w}
    time_limit: 300                   # s; default: none
    robots:
      - {id: r1, model: car, pose: [5, 5, 0]}
      - {id: r2, model: ../my_robot, pose: [5, 9, 0], start_energy: 0.8,
         battery: {capacity_Wh: 12}}

Details:

- Shapes: a polygon needs at least three corners in either orientation and must not
  cross itself; it is closed implicitly. A box is [length, width] about its centre,
  turned by yaw. A circle becomes the regular polygon of 32 sides around it, so that no
  robot is let into it; circles of goals and stations stay exact.
- `elevation` is one of `hills` (round, height and radius in m; they add up, negative
  ones are hollows; sampled every `cell` metres, default 0.5), `grid` (rows of heights
  in m) or `file`: an .npy file of heights in m, or a grey .png whose
  `range: [low, high]` states the heights in m of black and white; relative to the scene
  file. Grids are read like a map, the first row in the north, and reach from bound to
  bound; between their nodes the ground is bilinear. Saved scenes hold a file's heights
  as `packed`. Ground too steep for a robot makes the scene invalid where the robot
  could get there; with `slope: avoid` it is an obstacle for that robot, with up to half
  a cell around it.
- Ids are letters, digits, `_`, `.` and `-`, unique in the whole file (they name bodies,
  arrays and tour targets); an obstacle or terrain area without one is named after its
  place in the list, `obstacle_0`, `terrain_0`. Maps show an obstacle's own id on it,
  where it has room.
- `blocks` lists the robots an obstacle stops; without it, it stops all.
- A capacity is given in one of J, Wh or metres of plain ground (`capacity_m`: the way a
  full battery drives straight on at constant speed). A robot's own `battery` replaces
  what it names; without any capacity the model's standard battery counts.
- A goal or station with `dwell` (s) counts as visited when the reference point of one
  robot has been in its region for that long without a break, one target at a time;
  at most 86400 s, a day, in which `charging_power` must fill a battery, too.
- A goal with `heading` (rad; within `heading_tolerance`, default 0.2) counts as visited
  while the robot's yaw is that, too, for all of its `dwell`.
- A station with `capacity: 1` is for one robot at a time: at no time are the reference
  points of two robots in its region, not even of one that only passes through. Without
  it any number of robots may be there.
- `charging_power` of a battery (W) is what stations fill it with, as long as the robot
  is at the station of its tour; what the robot itself draws meanwhile goes off. It may
  leave before the battery is full. Without it a battery is full on arrival.
- `start_energy` is a share of the capacity (0..1), or one of {J: }, {Wh: }, {m: }.
- `rolling_factor` multiplies the rolling resistance a robot is reckoned with, as one
  measures it of a loaded or worn one; metres in `battery` stay those of the model.
- `margins` are the distances in m that plans keep from obstacles and bounds, and
  between robots (of two robots the larger one counts); a robot's own replace what they
  name. Where none is stated, in `robot.yaml` neither, they follow from the tracking
  error that the model has shown in MuJoCo. Where only a smaller margin opens a passage,
  that one is used there.
- `finish` is where a robot must be at rest when the mission ends: `start` (within 1 m
  of where it started), or one of circle, polygon, with `heading` (and
  `heading_tolerance`, default 0.2) if it matters.
- `model` is the name of a shipped model, or a folder (with a `/` in it), relative to
  the scene file, that holds a `robot.yaml`; or either with values other than in its
  `robot.yaml`: `{like: car, rolling_coefficient: 0.08}`.
- `energy: paper` (here or in `robot.yaml`) charges only distance times terrain and
  turning, the cost of the published method; `full`, the default, counts everything.
- `objective` sets which plan is better: that with less `energy` of the whole fleet (J,
  the default), that with the smaller `makespan`, the time at which the last robot has
  come to rest (s), or that with the smaller sum of both, each times its weight:
  `{energy: 1, makespan: 50}` has a second count as much as 50 J. Batteries must keep
  their reserves in any case.
- `time_limit` (s) is the largest makespan allowed.
- A map without robots, goals or stations is valid; nothing can be planned on it.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema
from pydantic_core import PydanticCustomError

from mrmg import shipped
from mrmg.energy.model import EnergyPreset
from mrmg.scene.loading.elevation import ElevationEntry
from mrmg.scene.loading.margins_schema import MarginsEntry
from mrmg.scene.loading.shape_schema import (
    CircleEntry,
    Coordinate,
    Identifier,
    Length,
    NamedWithUnits,
    NotNegative,
    Number,
    OneOf,
    Positive,
    Ring,
    ShapedEntry,
    Strict,
)
from mrmg.scene.region import HEADING_TOLERANCE_RAD

SCENE_FORMAT = 1

LONGEST_STAY_S = 86400.0
"""Longest dwell time, and time that filling a battery may take [s]: plans have a state
for each tenth of a second of them."""

Stay = Annotated[float, Field(ge=0, le=LONGEST_STAY_S, allow_inf_nan=False)]


class ObstacleEntry(ShapedEntry):
    """Ground that robots must keep off."""

    id: Identifier | None = None
    """name, unique in the whole file"""
    height_m: Length = 1.0
    """height in m"""
    blocks: Annotated[list[Identifier], Field(min_length=1)] | None = None
    """at least one id of a robot"""


class TerrainEntry(ShapedEntry):
    """Ground that costs more energy, or less."""

    id: Identifier | None = None
    """name, unique in the whole file"""
    multiplier: Positive
    """energy relative to plain ground"""
    turning_multiplier: Positive = 1.0
    """resistance to turning relative to plain ground"""
    energy_spread: NotNegative = 0.0
    """standard deviation of a run's energy from run to run, as a share"""


class RegionEntry(OneOf, NamedWithUnits):
    """A goal or station: exactly one of circle, polygon; convex."""

    one_of = ("circle", "polygon")

    id: Identifier
    """name, unique in the whole file"""
    circle: CircleEntry | None = None
    """a disc: its center [x, y] and its radius in m"""
    polygon: Ring | None = None
    """at least 3 corners [x, y] in m"""
    dwell_s: Stay | None = None
    """time in s that a visit takes"""


class GoalEntry(RegionEntry):
    """A goal, perhaps with a heading."""

    heading_rad: Number | None = None
    """yaw in rad"""
    heading_tolerance_rad: Positive | None = None
    """in rad; default 0.2"""


class StationEntry(RegionEntry):
    """A station."""

    capacity: Literal[1] | None = None
    """1: for one robot at a time"""


class BatteryEntry(Strict):
    """At most one capacity, and the reserve."""

    capacity_J: Positive | None = None
    """capacity in J"""
    capacity_Wh: Positive | None = None
    """capacity in Wh"""
    capacity_m: Positive | None = None
    """capacity in metres of plain ground"""
    reserve: Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)] | None = None
    """share of the capacity that must always remain, in [0, 1)"""
    charging_power: Positive | None = None
    """power in W with which stations fill it"""


class StartEnergyEntry(OneOf):
    """Exactly one of the four."""

    one_of = ("fraction", "J", "Wh", "m")
    none_of = "no amount"

    fraction: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] | None = None
    """share of the capacity, in [0, 1]"""
    J: Positive | None = None
    """energy in J"""
    Wh: Positive | None = None
    """energy in Wh"""
    m: Positive | None = None
    """metres of plain ground"""


class BlendEntry(Strict):
    """Weights of energy and makespan; one of them at least is positive."""

    energy: NotNegative
    """weight of each J"""
    makespan: NotNegative
    """weight of each s"""


def _share_to_mapping(value: Any) -> Any:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return {"fraction": value} if is_number else value


_SHARE = {"type": "number", "minimum": 0, "maximum": 1}
StartEnergy = Annotated[
    StartEnergyEntry,
    BeforeValidator(_share_to_mapping),
    WithJsonSchema({"anyOf": [_SHARE, StartEnergyEntry.model_json_schema()]}),
]


class FinishEntry(OneOf, NamedWithUnits):
    """Exactly one of circle, polygon; convex; perhaps with a heading."""

    one_of = ("circle", "polygon")

    circle: CircleEntry | None = None
    """a disc: its center [x, y] and its radius in m"""
    polygon: Ring | None = None
    """at least 3 corners [x, y] in m"""
    heading_rad: Number | None = None
    """yaw in rad"""
    heading_tolerance_rad: Positive = HEADING_TOLERANCE_RAD
    """in rad"""


_MODEL = (
    "the name of a shipped model, a folder relative to the scene, or {like: one of "
    "both, and values in place of its robot.yaml's}"
)


def _model_reference(value: Any) -> Any:
    name = value.get("like") if isinstance(value, dict) else value
    if not isinstance(name, str) or not name:
        raise PydanticCustomError("model_reference", _MODEL)
    return value


_MODEL_NAME = {
    "type": "string",
    "minLength": 1,
    "description": "name of a shipped model, or folder of one relative to the scene",
    "examples": shipped.model_names(),
}
_MODEL_LIKE = {
    "type": "object",
    "properties": {"like": _MODEL_NAME},
    "required": ["like"],
    "description": "a model with values in place of its robot.yaml's",
}
Model = Annotated[
    Any,
    BeforeValidator(_model_reference),
    WithJsonSchema({"anyOf": [_MODEL_NAME, _MODEL_LIKE]}),
]


class RobotEntry(Strict):
    """One robot of the fleet."""

    id: Identifier
    """name, unique in the whole file"""
    model: Model = Field(description=_MODEL)
    pose: Annotated[list[Number], Field(min_length=3, max_length=3)]
    """[x in m, y in m, yaw in rad]"""
    start_energy: StartEnergy = StartEnergyEntry(fraction=1.0)
    """a share of the capacity, 0..1"""
    battery: BatteryEntry | None = None
    """its own battery; replaces what it names"""
    energy: EnergyPreset | None = None
    """which parts of the energy model count"""
    rolling_factor: Positive | None = None
    """rolling resistance to reckon with, relative to the model"""
    margins: MarginsEntry | None = None
    """its own margins; replace what they name"""
    finish: Literal["start"] | FinishEntry | None = None
    """start, or a circle or polygon to end in"""


class SceneDocument(Strict):
    """A whole scene file."""

    format: Literal[1]
    """format: 1"""
    name: Annotated[str, Field(min_length=1, max_length=200)]
    """what the scene is called; default: the file's name"""
    bounds: Annotated[list[Coordinate], Field(min_length=4, max_length=4)]
    """[x_min, y_min, x_max, y_max] in m"""
    obstacles: list[ObstacleEntry] = []
    """ground that robots keep off; polygon, box or circle"""
    terrain: list[TerrainEntry] = []
    """ground that costs more; the later of two counts"""
    elevation: ElevationEntry | None = None
    """heights of the ground in m; default: flat"""
    goals: list[GoalEntry] = []
    """convex regions, each to be visited by some robot"""
    stations: list[StationEntry] = []
    """convex regions in which batteries are charged"""
    battery: BatteryEntry = BatteryEntry()
    """capacity and reserve of every robot"""
    margins: MarginsEntry | None = None
    """distances in m that plans keep; default: by model"""
    objective: Literal["energy", "makespan"] | BlendEntry | None = None
    """energy, makespan, or {energy: w, makespan: w}"""
    time_limit: Positive | None = None
    """largest makespan in s"""
    robots: list[RobotEntry] = []
    """the fleet; where each robot starts, and what it is"""


SECTIONS: dict[str, type[Strict]] = {
    "obstacles": ObstacleEntry,
    "terrain": TerrainEntry,
    "goals": GoalEntry,
    "stations": StationEntry,
    "robots": RobotEntry,
}
"""The lists of a scene file and the model of their entries."""
