"""Heights of the ground on a grid over a scene's bounds, bilinear between nodes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True, eq=False, kw_only=True)
class Elevation:
    """The elevation of a scene.

    Attributes:
        bounds: (x_min, y_min, x_max, y_max) [m]; the outermost nodes lie on them.
        height_m: of the nodes, rows from south to north, columns from west to east,
            read-only, shape (ny, nx), both at least 2.
        avoid_steep: whether ground too steep for a robot is an obstacle for it; else
            such ground is a fault of the scene.
    """

    bounds: tuple[float, float, float, float]
    height_m: np.ndarray
    avoid_steep: bool = False

    @cached_property
    def cell_m(self) -> tuple[float, float]:
        """Extent (x, y) of a cell between nodes [m]."""
        x_min, y_min, x_max, y_max = self.bounds
        rows, columns = self.height_m.shape
        return (x_max - x_min) / (columns - 1), (y_max - y_min) / (rows - 1)

    @cached_property
    def nodes_m(self) -> tuple[np.ndarray, np.ndarray]:
        """The x of the columns and the y of the rows of nodes [m]."""
        x_min, y_min, x_max, y_max = self.bounds
        rows, columns = self.height_m.shape
        return np.linspace(x_min, x_max, columns), np.linspace(y_min, y_max, rows)

    def height_at(self, points: np.ndarray) -> np.ndarray:
        """Return the height [m] at each point, shape (n, 2) -> (n,).

        Outside the bounds it is that of the nearest point of the bounds.
        """
        low, high, v, _ = self._about(points)
        return np.asarray(low * (1.0 - v) + high * v)

    def gradient_at(self, points: np.ndarray) -> np.ndarray:
        """Return the slope (dh/dx, dh/dy) at each point, shape (n, 2) -> (n, 2).

        On a line between cells it is that of the cell to the north or east.
        """
        low, high, v, (south, north) = self._about(points)
        dx, dy = self.cell_m
        rise = (1.0 - v) * south + v * north
        return np.stack([rise / dx, (high - low) / dy], axis=-1)

    def slope_at(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the slope (dh/dx, dh/dy) at one point; sooner than `gradient_at`."""
        height = self._rows_m
        x_min, y_min, _, _ = self.bounds
        dx, dy = self.cell_m
        fx = max(0.0, min(len(height[0]) - 1.0, (x_m - x_min) / dx))
        fy = max(0.0, min(len(height) - 1.0, (y_m - y_min) / dy))
        column, row = min(int(fx), len(height[0]) - 2), min(int(fy), len(height) - 2)
        u, v = fx - column, fy - row
        a, b = height[row][column : column + 2]
        c, d = height[row + 1][column : column + 2]
        rise = (1.0 - v) * (b - a) + v * (d - c)
        return rise / dx, (c * (1.0 - u) + d * u - a * (1.0 - u) - b * u) / dy

    def span_within(
        self, box: tuple[float, float, float, float]
    ) -> tuple[float, float]:
        """Return least and greatest height in a box (x_min, y_min, x_max, y_max) [m].

        Bilinear ground has its extremes at corners: of the box, and of the cells that
        it cuts.
        """
        x_lines, y_lines = self.nodes_m
        x, y = _cuts(x_lines, box[0], box[2]), _cuts(y_lines, box[1], box[3])
        height = self.height_at(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))
        return float(height.min()), float(height.max())

    def steepest(self) -> np.ndarray:
        """Return the largest slope in each cell, shape (ny - 1, nx - 1).

        Each partial derivative lies between its values on two opposite sides.
        """
        dx, dy = self.cell_m
        across = np.abs(np.diff(self.height_m, axis=1)) / dx
        along = np.abs(np.diff(self.height_m, axis=0)) / dy
        return np.hypot(
            np.maximum(across[:-1], across[1:]),
            np.maximum(along[:, :-1], along[:, 1:]),
        )

    def bends(self) -> np.ndarray:
        """Return how much the slope changes at each node, at its most, shape (ny, nx).

        It changes between the cells to both sides, or the nearest metre of them.
        """
        bend = np.zeros(self.height_m.shape)
        for axis, cell_m in zip((1, 0), self.cell_m, strict=True):
            reach = max(1, round(1.0 / cell_m))
            height = np.moveaxis(self.height_m, axis, 0)
            change = height[: -2 * reach] - 2.0 * height[reach:-reach]
            change = np.abs(change + height[2 * reach :]) / (reach * cell_m)
            inner = np.moveaxis(bend, axis, 0)[reach:-reach]
            np.maximum(inner, change, out=inner)
        return bend

    def cell_centres(self) -> np.ndarray:
        """Return the middle of each cell [m], shape (ny - 1, nx - 1, 2)."""
        x, y = (0.5 * (nodes[1:] + nodes[:-1]) for nodes in self.nodes_m)
        return np.stack(np.meshgrid(x, y), axis=-1)

    @cached_property
    def _rows_m(self) -> list[list[float]]:
        """The heights as plain numbers, which are sooner at hand one by one."""
        rows: list[list[float]] = self.height_m.tolist()
        return rows

    def _about(
        self, points: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Return heights south and north of points, the share of the north, and rises.

        The rises are the differences of height across the cell on its south and north
        sides.
        """
        points = np.atleast_2d(points)
        x_min, y_min, _, _ = self.bounds
        rows, columns = self.height_m.shape
        dx, dy = self.cell_m
        fx = np.clip((points[:, 0] - x_min) / dx, 0.0, columns - 1.0)
        fy = np.clip((points[:, 1] - y_min) / dy, 0.0, rows - 1.0)
        column = np.minimum(fx.astype(int), columns - 2)
        row = np.minimum(fy.astype(int), rows - 2)
        u, v = fx - column, fy - row
        height = self.height_m
        a, b = height[row, column], height[row, column + 1]
        c, d = height[row + 1, column], height[row + 1, column + 1]
        low, high = a * (1.0 - u) + b * u, c * (1.0 - u) + d * u
        return low, high, v, (b - a, d - c)


def _cuts(lines: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return an interval's ends and the lines between them."""
    return np.concatenate([[low], lines[(lines > low) & (lines < high)], [high]])
