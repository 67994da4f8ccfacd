"""How a simulated mission differs from the one that was planned for.

`DisturbanceRanges` states how far each quantity may stray, `draw` picks one
`Disturbance` from them by a seed. A disturbance is a plain value: logs keep it, so that
a log states what was simulated.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, make_dataclass, replace
from types import MappingProxyType
from typing import Any

from mrmg import seeding, storage
from mrmg.errors import UsageError
from mrmg.scene.types import Battery, Scene


@dataclass(frozen=True, slots=True)
class Span:
    """An interval that a value is drawn from, evenly; both ends equal for a fixed one.

    Attributes:
        low, high: ends, low <= high.
    """

    low: float = 0.0
    high: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotDisturbance:
    """What is different about one robot; changes are shares of the model's value."""

    __pydantic_config__ = storage.IN_SCHEMAS

    robot: str
    """Its id."""
    mass: float = 0.0
    """Change of its masses and inertias, as a share."""
    friction: float = 0.0
    """Change of its grip, of tyres and hull, as a share."""
    rolling: float = 0.0
    """Change of its rolling resistance, over that which the mass brings, as a share."""
    drive_gain: float = 0.0
    """Change of the drive's force against the one commanded, as a share."""
    steering_gain: float = 0.0
    """Change of the steering against the one commanded, as a share."""
    lag_s: float = 0.0
    """Time constant of drive and steering [s]."""
    position_noise_m: float = 0.0
    """Standard deviation of each measured coordinate [m]."""
    heading_noise_rad: float = 0.0
    """Standard deviation of the measured heading [rad]."""
    speed_noise_m_s: float = 0.0
    """Standard deviation of the measured speed [m/s]."""
    delay_s: float = 0.0
    """Age of measured positions and headings [s]."""
    start_x_m: float = 0.0
    """Offset of the start [m]."""
    start_y_m: float = 0.0
    """Offset of the start [m]."""
    start_heading_rad: float = 0.0
    """Offset of the heading at the start [rad]."""
    capacity: float = 0.0
    """Change of the battery's capacity and content, as a share."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbance:
    """How the simulated robots differ from their models."""

    __pydantic_config__ = storage.IN_SCHEMAS

    seed: int
    """Of the draw, and of the noise while driving."""
    robots: tuple[RobotDisturbance, ...]
    """By robot, in the scene's order."""

    def require_fleet(self, scene: Scene) -> None:
        """Refuse another fleet than it was drawn for; raises UsageError."""
        drawn, given = ([r.robot for r in self.robots], [r.id for r in scene.robots])
        if drawn != given:
            text = f"a disturbance of robots {drawn}, the scene has {given}"
            raise UsageError(f"{text}; draw one for these")

    def battery(self, index: int, battery: Battery) -> Battery:
        """Return the battery that a robot really has, its reserve in joules kept."""
        factor = 1.0 + self.robots[index].capacity
        return replace(
            battery,
            capacity_J=battery.capacity_J * factor,
            start_J=battery.start_J * factor,
            reserve_fraction=battery.reserve_fraction / factor,
        )

    def actual_scene(self, scene: Scene) -> Scene:
        """Return the scene with the batteries that its robots really have."""
        robots = (
            replace(robot, battery=self.battery(index, robot.battery))
            for index, robot in enumerate(scene.robots)
        )
        return replace(scene, robots=tuple(robots))


_SPANS = [(quantity.name, Span, Span()) for quantity in fields(RobotDisturbance)[1:]]
_Spans: Any = make_dataclass("_Spans", _SPANS, frozen=True, kw_only=True)


class DisturbanceRanges(_Spans):  # type: ignore[misc]
    """How far each quantity of `RobotDisturbance` may stray, in its unit: a `Span`."""

    def draw(self, seed: int, robots: Iterable[str]) -> Disturbance:
        """Return the disturbance that `seed` picks for the robots of these ids.

        Every quantity of every robot has a stream of its own: widening one range
        leaves what is drawn from the others.
        """
        return Disturbance(
            seed=seed,
            robots=tuple(
                RobotDisturbance(
                    robot=robot,
                    **{
                        item.name: _drawn(getattr(self, item.name), seed, robot, item)
                        for item in fields(self)
                    },
                )
                for robot in robots
            ),
        )


def _drawn(span: Span, seed: int, robot: str, item: Any) -> float:
    rng = seeding.stream(seed, "disturbance", robot, item.name)
    # Exact where both ends are equal, which low + (high - low) u is.
    return float(span.low + (span.high - span.low) * rng.random())


DEFAULT_RANGES = DisturbanceRanges(
    mass=Span(-0.05, 0.05),
    friction=Span(-0.20, 0.20),
    rolling=Span(-0.10, 0.10),
    lag_s=Span(0.05, 0.05),
    position_noise_m=Span(0.02, 0.02),
)
"""The disturbances a plan is expected to survive."""

FIELD_SPREADS: Mapping[str, float] = MappingProxyType(
    {
        "asphalt": 0.127,
        "flooring": 0.108,
        "ice": 0.149,
        "sandy_loam": 0.108,
        "snow": 0.315,
    }
)
"""Standard deviation of what equal motions take from run to run, by terrain.

Fitted with `mrmg calibrate husky --log` to 37 runs of a Husky A200, each predicted by
the others of its terrain (logs: LaRocque et al., arXiv 2403.16877, data CC0)."""


def field_ranges(terrain: str) -> DisturbanceRanges:
    """Return the default ranges with the spread that was found in runs on a terrain.

    It takes the place of the guessed ones of rolling and mass, all of it as rolling,
    which takes most of a mission's energy. The range has the spread's standard
    deviation: an even one of half-width h has h / sqrt(3).
    """
    reach = round(math.sqrt(3.0) * FIELD_SPREADS[terrain], 3)
    return replace(DEFAULT_RANGES, mass=Span(), rolling=Span(-reach, reach))
