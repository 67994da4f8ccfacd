"""What a robot needs to be driven in MuJoCo: an MJCF file with the parts named here."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from mrmg.errors import UsageError
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Robot

ROOT, CHASSIS, HULL = "root", "chassis", "hull"
"""Free joint at the reference point, its body, and the geom that touches obstacles."""

FLOOR_BIT, HULL_BIT, OBSTACLE_BIT = 1, 2, 4
"""Collision bits: what touches the floor, other robots' hulls, obstacles and walls has
them in its `conaffinity`."""

NUMERICS = ("rolling_coefficient", "turning_coefficient")
"""Custom numerics: what the simulated tyres lose."""


@dataclass(frozen=True, slots=True)
class DrivenParts:
    """Names that a chassis looks up in an MJCF; of pairs the left one comes first.

    Attributes:
        spin: hinge joints of the driven wheels.
        steer: hinge joints of the steered wheels.
        servos: position servos of the steered wheels.
        motors: actuators of the wheels that are commanded as forces.
        tendons: way rolled by the axle's middle, and by right wheel less left wheel.
    """

    spin: tuple[str, str]
    motors: tuple[str, ...]
    steer: tuple[str, ...] = ()
    servos: tuple[str, ...] = ()
    tendons: tuple[str, ...] = ()


PARTS = {
    "car": DrivenParts(
        spin=("spin_rl", "spin_rr"),
        motors=("drive",),
        steer=("steer_fl", "steer_fr"),
        servos=("steer_l", "steer_r"),
    ),
    "unicycle": DrivenParts(
        spin=("spin_l", "spin_r"),
        motors=("drive_l", "drive_r"),
        tendons=("axle", "swing"),
    ),
}
"""By motion model."""


def why_not_driven(model: RobotModel) -> str | None:
    """Return what keeps a model from being driven; None if nothing does."""
    if model.motion_model not in PARTS:
        return "a motion of its own"
    return "no MJCF file" if model.mjcf is None else None


def require_drivable(robots: Iterable[Robot]) -> None:
    """Refuse robots that can only be planned for.

    Raises:
        UsageError: naming the first of them.
    """
    for robot in robots:
        reason = why_not_driven(robot.model)
        if reason is not None:
            raise UsageError(
                f"{robot.id}: model '{robot.model.name}' has {reason}; its missions "
                "can be planned for and verified, but not driven in MuJoCo: use 'mrmg "
                "plan' and 'mrmg verify'"
            )
