"""How the ground slopes under the robots, along the way they head."""

from __future__ import annotations

import mujoco
import numpy as np

from mrmg.scene.types import Scene
from mrmg.world.relief import gradient_at, height_at


class Incline:
    """Slopes along the headings of a fleet, below the centres of mass."""

    def __init__(self, scene: Scene) -> None:
        """Look at the relief of `scene`."""
        self._scene = scene
        self._lead_m = np.array(
            [[robot.model.center_of_mass_m] for robot in scene.robots]
        )

    def under(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return cosine and sine of the slope along each heading, each (R,).

        The sine is positive uphill.

        Args:
            state: of the robots, shape (R, 5).
        """
        if self._scene.elevation is None:
            return np.ones(len(state)), np.zeros(len(state))
        heading = np.stack([np.cos(state[:, 2]), np.sin(state[:, 2])], axis=1)
        gradient = gradient_at(self._scene, state[:, :2] + self._lead_m * heading)
        rise = (gradient * heading).sum(axis=1)
        level = 1.0 / np.hypot(1.0, rise)
        return level, level * rise


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
