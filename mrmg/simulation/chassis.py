"""What all chassis have: how robots of one motion model turn set-points into motion.

A chassis handles all robots of its kind as arrays of shape (K,), in the scene's order;
`Fleet` says what its methods take. It finds its parts in the compiled MJCF by name; a
robot's names are `<id>/<part>`. That the parts are there is checked as a robot's model
is loaded.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import DrivenParts
from mrmg.scene.types import Robot


class Chassis:
    """The robots of one motion model inside a running simulation, each on two wheels.

    Further wheels roll along; these two, left and right, are driven.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        robots: Sequence[Robot],
        parts: DrivenParts,
    ) -> None:
        """Find the driven wheels of `robots`, which have these parts."""
        self._model, self._data = model, data
        self._wheels_v = model.jnt_dofadr[part_ids(model.joint, robots, parts.spin)]
        self._radius_m = np.array([robot.model.wheel_radius_m for robot in robots])

    def apply(self, step: int) -> None:
        """Give the actuators the controls of a physics step; held ones need nothing."""

    def axle_speed_m_s(self) -> np.ndarray:
        """Return the speed the axle rolls at, shape (K,)."""
        return np.asarray(self._wheel_speed_m_s().mean(axis=1))

    def _wheel_speed_m_s(self) -> np.ndarray:
        """Return the speed each driven wheel rolls at, left and right, shape (K, 2)."""
        return np.asarray(self._data.qvel[self._wheels_v] * self._radius_m[:, None])


def part_ids(
    find: Callable[[str], Any], robots: Sequence[Robot], parts: Sequence[str]
) -> np.ndarray:
    """Return the ids of named parts of several robots, shape (K, len(parts)).

    Args:
        find: looks up such parts in the compiled world by name: `model.joint`,
            `model.actuator`, `model.tendon`, ...
        robots: K robots.
        parts: names as their MJCF files give them.
    """
    return np.array(
        [[find(f"{robot.id}/{part}").id for part in parts] for robot in robots]
    )
