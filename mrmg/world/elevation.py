"""How high the ground lies at a place, and how it slopes; 0 where a scene is flat."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene


def height_at(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return the height [m] at each point, shape (n, 2) -> (n,)."""
    points = np.atleast_2d(points)
    if scene.elevation is None:
        return np.zeros(len(points))
    return scene.elevation.height_at(points)


def highest_m(scene: Scene) -> float:
    """Return the height of the highest ground [m]."""
    elevation = scene.elevation
    return 0.0 if elevation is None else float(elevation.height_m.max())


def lifted(scene: Scene, points: np.ndarray, lift_m: float) -> np.ndarray:
    """Return points `lift_m` above the ground, shape (n, 2) -> (n, 3)."""
    points = np.atleast_2d(points)
    return np.column_stack([points, height_at(scene, points) + lift_m])


def ground_mesh(
    scene: Scene, low: Sequence[float], high: Sequence[float], cell_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the ground of a rectangle as a mesh of triangles.

    Args:
        scene: gives the heights.
        low: corner of the rectangle with the least coordinates [m].
        high: corner with the largest ones [m].
        cell_m: longest side of its cells, of two triangles each.

    Returns:
        Nodes, row by row, shape (n, 3), and the nodes of each triangle, shape (m, 3).
    """
    x, y = (
        np.linspace(start, end, int(np.ceil((end - start) / cell_m)) + 1)
        for start, end in zip(low, high, strict=True)
    )
    nodes = lifted(scene, np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2), 0.0)
    grid = np.arange(len(nodes)).reshape(len(y), len(x))
    a, b = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel()
    c, d = grid[1:, :-1].ravel(), grid[1:, 1:].ravel()
    return nodes, np.stack([a, b, d, a, d, c], axis=1).reshape(-1, 3)


def load_points(model: RobotModel, state: np.ndarray) -> np.ndarray:
    """Return the points below a robot's centre of mass, (n, >= 3) -> (n, 2).

    What it climbs is the ground there, not at its reference point.
    """
    x, y, theta = state[:, 0], state[:, 1], state[:, 2]
    lead_m = model.center_of_mass_m
    return np.stack([x + lead_m * np.cos(theta), y + lead_m * np.sin(theta)], axis=-1)


def gradient_at(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return the slope (dh/dx, dh/dy) at each point, shape (n, 2) -> (n, 2)."""
    points = np.atleast_2d(points)
    if scene.elevation is None:
        return np.zeros((len(points), 2))
    return scene.elevation.gradient_at(points)


def ground_poses(scene: Scene, poses: np.ndarray) -> np.ndarray:
    """Return poses on the ground, shape (n, 3) -> (n, 7), of (x, y, yaw) on the map.

    Each is a position (x, y, z) and an orientation (w, x, y, z): up is the ground's
    normal, and the forward axis shows the yaw on the map.
    """
    points, yaw = poses[:, :2], poses[:, 2]
    place = lifted(scene, points, 0.0)
    if scene.elevation is None:
        level = np.zeros(len(poses))
        half = 0.5 * yaw
        return np.column_stack([place, np.cos(half), level, level, np.sin(half)])
    slope = gradient_at(scene, points)
    heading = np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
    forward = np.column_stack([heading, (heading * slope).sum(axis=1)])
    up = np.column_stack([-slope, np.ones(len(slope))])
    axes = np.stack([forward, np.cross(up, forward), up], axis=2)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    from scipy.spatial.transform import Rotation  # heavy, and planning needs it not

    turn = Rotation.from_matrix(axes).as_quat(scalar_first=True)
    return np.column_stack([place, turn])
