"""How the ground slopes under the robots, along the way they head."""

from __future__ import annotations

import math

import numpy as np

from mrmg.mujoco_import import mujoco
from mrmg.scene.types import Scene
from mrmg.world.elevation import gradient_at, height_at


class SlopesUnderfoot:
    """Slopes along the headings of a fleet, below the centres of mass."""

    def __init__(self, scene: Scene) -> None:
        """Look at the elevation of `scene`."""
        self._relief = scene.elevation
        self._lead_m = [robot.model.center_of_mass_m for robot in scene.robots]
        self._flat = np.ones(len(scene.robots)), np.zeros(len(scene.robots))

    def under(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return cosine and sine of the slope along each heading, each (R,).

        The sine is positive uphill.

        Args:
            state: of the robots, shape (R, 5).
        """
        if self._relief is None:
            return self._flat
        level, slope = [], []
        for (x, y, heading, _, _), lead_m in zip(
            state.tolist(), self._lead_m, strict=True
        ):
            cos, sin = math.cos(heading), math.sin(heading)
            slope_x, slope_y = self._relief.slope_at(x + lead_m * cos, y + lead_m * sin)
            rise = slope_x * cos + slope_y * sin
            level.append(1.0 / math.hypot(1.0, rise))
            slope.append(rise * level[-1])
        return np.array(level), np.array(slope)


def standing_pose(
    scene: Scene, x: float, y: float, yaw: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return position [m] and orientation (w, x, y, z) of a robot on the ground.

    Its up is the ground's normal, and its forward axis shows the yaw on the map.
    """
    if scene.elevation is None:
        turn = np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])
        return np.array([x, y, 0.0]), turn
    place = np.array([[x, y]])
    slope_x, slope_y = gradient_at(scene, place)[0]
    heading = np.array([np.cos(yaw), np.sin(yaw)])
    forward = _unit(np.array([*heading, heading @ (slope_x, slope_y)]))
    up = _unit(np.array([-slope_x, -slope_y, 1.0]))
    axes = np.stack([forward, np.cross(up, forward), up], axis=1)
    orientation = np.empty(4)
    mujoco.mju_mat2Quat(orientation, axes.ravel())
    return np.array([x, y, height_at(scene, place)[0]]), orientation


def _unit(vector: np.ndarray) -> np.ndarray:
    return np.asarray(vector / np.linalg.norm(vector))
