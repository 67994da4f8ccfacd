"""The map from above, drawn fast: a still background and small pictures of the robots.

Seen straight from above nothing but the robots moves, so that the background is drawn
once, and again when a goal is visited; per frame only a few pixels around each robot
are drawn anew, on the same pixel grid, and those that differ from the background are
laid over it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from mrmg.viz import style
from mrmg.viz.ground_image import GroundFrame, paint_line
from mrmg.viz.tags import Label, letter_px, overlap
from mrmg.viz.world_view import WorldView, top_camera

_LEAST_TRAIL_PIXELS = 2.0
_MARGIN_M = 0.3
_DIFFERENCE = 10


class TopView:
    """Draws an orthographic view of the whole map."""

    def __init__(self, view: WorldView, frame: GroundFrame, radius_m: float) -> None:
        """Set the window on the map.

        Args:
            view: the renderer.
            frame: what the picture covers.
            radius_m: of a circle about a robot's reference point that holds the robot.
        """
        self._view, self._frame = view, frame
        self._half = math.ceil((radius_m + _MARGIN_M) * frame.pixels_per_m)
        width = style.DRIVEN.width_em * letter_px(frame.size[1])
        self._trail_width = max(width, _LEAST_TRAIL_PIXELS)
        self._still = self._background = np.empty(0)

    def draw_background(
        self,
        qpos: np.ndarray,
        trails: Mapping[str, np.ndarray],
        labels: Sequence[tuple[Label, np.ndarray]],
    ) -> None:
        """Draw everything but the robots.

        Args:
            qpos: any positions of the model.
            trails: what was driven so far [m], shape (n, 2) each, by colour.
            labels: names and their middles (column, row).
        """
        self._view.place_robots_away(qpos)
        camera = top_camera(self._frame.center_m, self._view.highest_m)
        height_m = 2.0 * self._frame.half_m[1]
        size = self._frame.size
        self._still = self._view.draw(camera, size, fovy=height_m, shadows=False)
        self._background = self._still.copy()
        for color, points in trails.items():
            self.extend_trail(points, color)
        for label, spot in labels:
            label.blit(self._background, spot)

    def extend_trail(self, points: np.ndarray, color: str) -> None:
        """Paint a driven way through points [m], shape (n, 2), onto the background."""
        pixels = self._frame.to_pixels(points)
        paint_line(self._background, pixels, self._trail_width, color)

    def draw(self, qpos: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the map with its robots, shape (height, width, 3) of bytes.

        Args:
            qpos: positions of the model.
            points: reference point of each robot [m], shape (n, 2).
        """
        picture = self._background.copy()
        self._view.place(qpos)
        for column, row in np.round(self._frame.to_pixels(points)).astype(int):
            self._draw_patch(int(column), int(row), picture)
        return picture

    def _draw_patch(self, column: int, row: int, picture: np.ndarray) -> None:
        half, size = self._half, (2 * self._half, 2 * self._half)
        at_m = self._frame.to_ground(np.array([column, row]))
        fovy = 2 * half / self._frame.pixels_per_m
        camera = top_camera(at_m, self._view.highest_m)
        patch = self._view.draw(camera, size, fovy=fovy, shadows=False)
        shown, inner = overlap(picture, patch, column - half, row - half)
        still, _ = overlap(self._still, patch, column - half, row - half)
        moved = np.abs(inner.astype(np.int16) - still).max(axis=2) > _DIFFERENCE
        shown[moved] = inner[moved]
