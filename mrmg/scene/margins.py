"""Margins: the distances that plans keep from obstacles and between robots.

The default follows from the tracking error that a robot's model has shown in MuJoCo
under default disturbances (`tracking_error` in `robot.yaml`, which states the source):
`ERRORS_KEPT` times that, as errors grow with what nobody modelled. Of a model that
nobody drove it is reckoned from its top speed. Where only a smaller margin opens a
passage, that margin is used there, down to the certified minimum, which holds the
tracking error without disturbances (`mrmg.planning.problem.openings`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from mrmg import storage
from mrmg.errors import UsageError

if TYPE_CHECKING:
    from mrmg.scene.robot_model import RobotModel
    from mrmg.scene.types import Robot

ERRORS_KEPT = 10.0
"""Default margin from obstacles as a multiple of the disturbed tracking error."""

LEAST_DEFAULT_M = 0.05
"""Least default margin from obstacles [m]: 2.5 standard deviations of the noise of
positions under default disturbances."""

MOST_DEFAULT_M = 0.25
"""Largest default margin from obstacles; what cars have always kept [m]."""

BETWEEN_STEPS_S = 0.015
"""Time at top speed that margins at time steps leave for turning in between [s]."""

NOMINAL_S, DISTURBED_S = 0.013, 0.0225
"""Tracking errors of a model that nobody drove, as time at its top speed [s]: as of the
shipped car, 0.026 and 0.045 m at 2 m/s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Margins:
    """Margins as a file or a user states them; None where it does not.

    Attributes:
        obstacle_m: distance kept from obstacles and bounds.
        robot_m: distance kept from other robots; of two robots the larger one counts.
    """

    obstacle_m: float | None = None
    robot_m: float | None = None

    @property
    def entry(self) -> dict[str, float | None]:
        """The margins by their keys in files."""
        return {"obstacle": self.obstacle_m, "robot": self.robot_m}

    def over(self, other: Margins) -> Margins:
        """Return these margins, with another's where these state none."""
        stated = {key: m for key, m in asdict(self).items() if m is not None}
        return replace(other, **stated)


STATES_NONE = Margins()


@dataclass(frozen=True, slots=True, kw_only=True)
class NarrowPassage:
    """Where a robot keeps less than its margin from obstacles."""

    __pydantic_config__ = storage.IN_SCHEMAS

    robot: str
    """Its id."""
    start_s: float
    """When it begins [s]."""
    end_s: float
    """When it ends [s]."""
    x_m: float
    """Reference point where the distance is least [m]."""
    y_m: float
    """Likewise."""
    margin_m: float
    """Distance kept from obstacles at the time steps [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackingError:
    """The largest tracking errors that a model has shown in MuJoCo [m].

    Attributes:
        nominal_m: as modelled: the certified minimum of margins from obstacles.
        disturbed_m: under default disturbances.
    """

    nominal_m: float
    disturbed_m: float

    @property
    def entry(self) -> dict[str, float]:
        """The errors by their keys in files."""
        return {"nominal": self.nominal_m, "disturbed": self.disturbed_m}


LARGEST_M = {"obstacle": 1.0, "robot": 2.0}
"""Largest margins that can be asked for, by their keys in files [m]."""


def margins_from(value: Any) -> Margins:
    """Return margins from a text such as "obstacle=0.1,robot=0.3", or a mapping.

    Raises:
        UsageError: stating what is allowed.
    """
    if isinstance(value, Margins):
        return value
    try:
        pairs = (
            [part.split("=") for part in value.split(",")]
            if isinstance(value, str)
            else list(value.items())
        )
        stated = {key.strip(): float(number) for key, number in pairs}
        each_once = len(stated) == len(pairs)
    except (AttributeError, TypeError, ValueError):
        stated, each_once = {}, False
    fine = all(0.0 <= stated[key] <= LARGEST_M.get(key, -1.0) for key in stated)
    if not stated or not each_once or not fine:
        raise UsageError(
            f"margins: {value!r} are no margins such as obstacle=0.1,robot=0.3: each "
            f"once, in m, at most {LARGEST_M['obstacle']:g} from obstacles and "
            f"{LARGEST_M['robot']:g} between robots"
        )
    return Margins(obstacle_m=stated.get("obstacle"), robot_m=stated.get("robot"))


def tracking_error(model: RobotModel) -> TrackingError:
    """Return the tracking error of a model: as shown in MuJoCo, or by its speed."""
    if model.tracking_error is not None:
        return model.tracking_error
    return TrackingError(
        nominal_m=NOMINAL_S * model.top_speed_m_s,
        disturbed_m=DISTURBED_S * model.top_speed_m_s,
    )


def certified_minimum_m(model: RobotModel) -> float:
    """Return the least distance from obstacles that a passage is driven with."""
    nominal_m = tracking_error(model).nominal_m
    return max(nominal_m, BETWEEN_STEPS_S * model.top_speed_m_s)


def default_margins(model: RobotModel) -> Margins:
    """Return the margins of a robot for which nobody states any."""
    wanted_m = round(ERRORS_KEPT * tracking_error(model).disturbed_m, 3)
    obstacle_m = min(max(wanted_m, LEAST_DEFAULT_M), MOST_DEFAULT_M)
    return Margins(obstacle_m=obstacle_m, robot_m=2.0 * obstacle_m)


def kept_margins(robot: Robot) -> Margins:
    """Return the margins of a robot: as stated for it, by its model, or by default."""
    stated = robot.margins.over(robot.model.margins)
    return stated.over(default_margins(robot.model))


def source_of_margins(model: RobotModel, obstacle_m: float) -> str:
    """Return in words where a robot's margin from obstacles comes from.

    Args:
        model: of the robot.
        obstacle_m: the margin.
    """
    if obstacle_m != default_margins(model).obstacle_m:
        return "as stated"
    error = f"tracking error of {tracking_error(model).disturbed_m:.3f} m"
    shown = f"that {model.name} has shown in MuJoCo under default disturbances"
    if model.tracking_error is None:
        shown = f"assumed for {model.name} by its top speed, as nobody measured it"
    limits = f"{LEAST_DEFAULT_M:g} to {MOST_DEFAULT_M:g} m"
    return f"by default: {ERRORS_KEPT:g} times the {error} {shown}, within {limits}"


def sentences_on_margins(
    robots: Sequence[Robot], kept: Mapping[str, tuple[float, float]]
) -> list[str]:
    """Return which robots keep which margins, and why, one sentence for equal ones.

    Args:
        robots: of the scene.
        kept: distances from obstacles and from other robots by the robots' ids [m].
    """
    found: dict[str, list[str]] = {}
    for robot in robots:
        if robot.id in kept:
            obstacle_m, robot_m = kept[robot.id]
            margins = (
                f"{obstacle_m:g} m from obstacles, {robot_m:g} m from other robots"
            )
            source = source_of_margins(robot.model, obstacle_m)
            found.setdefault(f"{margins} ({source})", []).append(robot.id)
    return [f"{', '.join(ids)}: {text}" for text, ids in found.items()]
