"""What a chassis is: how robots of one motion model turn set-points into motion.

A chassis handles all robots of its kind as arrays of shape (K,), in the scene's order.
It finds its parts in the compiled MJCF by name; a robot's names are `<id>/<part>`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Protocol

import numpy as np

from mrmg.errors import Fault, FileError, UsageError
from mrmg.mujoco_import import mujoco
from mrmg.scene.types import Robot


class Chassis(Protocol):
    """The robots of one motion model inside a running simulation."""

    def fifth_state(self) -> np.ndarray:
        """Return the true psi [rad] or omega [rad/s], shape (K,)."""

    def axle_speed_m_s(self) -> np.ndarray:
        """Return the speed the driven axle rolls at, shape (K,)."""

    def set_resistance(
        self,
        resistance_N: np.ndarray,
        swing_N: np.ndarray,
        believed_swing_N: np.ndarray | None = None,
    ) -> None:
        """Set the dry friction of the driven axle.

        Args:
            resistance_N: against the way of its middle, shape (K,).
            swing_N: against the way its wheels roll differently, shape (K,).
            believed_swing_N: what the drive control believes of it; None leaves what it
                believes.
        """

    def command(
        self, force_N: np.ndarray, w_from: np.ndarray, w_to: np.ndarray, steps: int
    ) -> None:
        """Prepare the controls of the coming `steps` physics steps.

        Args:
            force_N: traction force to hold at the driven axle, shape (K,).
            w_from: psi or omega asked for at the start, shape (K,).
            w_to: psi or omega asked for at the end, shape (K,).
            steps: number of physics steps.
        """

    def apply(self, step: int) -> None:
        """Give the actuators the controls of physics step `step`."""


Maker = Callable[[mujoco.MjModel, mujoco.MjData, Sequence[Robot]], Chassis]

_MAKERS = {
    "car": ("mrmg.simulation.ackermann", "AckermannChassis"),
    "unicycle": ("mrmg.simulation.differential", "DifferentialChassis"),
}


def chassis_maker(robot: Robot) -> Maker:
    """Return the constructor of the chassis that drives `robot`.

    Raises:
        UsageError: if there is none for its motion model.
    """
    name = robot.model.motion_model
    if name not in _MAKERS:
        raise UsageError(
            f"robot '{robot.id}': motion model '{name}' cannot be executed; allowed: "
            f"{', '.join(sorted(_MAKERS))}"
        )
    module, attribute = _MAKERS[name]
    maker: Maker = getattr(import_module(module), attribute)
    return maker


def part_ids(
    model: mujoco.MjModel,
    kind: mujoco.mjtObj,
    robots: Sequence[Robot],
    parts: Sequence[str],
) -> np.ndarray:
    """Return the ids of named parts of several robots, shape (K, len(parts)).

    Args:
        model: the compiled world.
        kind: joint, actuator, tendon, ...
        robots: K robots.
        parts: names as their MJCF files give them.

    Raises:
        FileError: if a robot's MJCF lacks a part.
    """
    ids = np.array(
        [
            [mujoco.mj_name2id(model, kind, f"{robot.id}/{part}") for part in parts]
            for robot in robots
        ]
    )
    for row, column in np.argwhere(ids < 0):
        noun = kind.name.removeprefix("mjOBJ_").lower()
        robot_model = robots[row].model
        message = f"has no {noun} '{parts[column]}', which a robot of its kind needs"
        raise FileError(str(robot_model.mjcf), [Fault(robot_model.name, message)])
    return ids
