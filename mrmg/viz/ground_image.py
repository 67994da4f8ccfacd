"""The ground of the video: terrain and planned paths painted on one image.

All that lies flat is a texture of the floor, which costs nothing to draw, and driven
trails are painted into it as the mission goes on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image, ImageDraw

from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.viz import scene_drawing, style
from mrmg.viz.activities import thinned
from mrmg.viz.map_labels import MapLabel, map_labels
from mrmg.world.elevation import ground_mesh

_DPI = 100
_SPACING_M = 0.3
_SUPERSAMPLING = 4
_LETTER_PIXELS = 40.0
PAINTED = ("terrain", "height")
"""Kinds of names that lie on the ground; others are laid over the picture."""
_RELIEF_CELL_M = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundFrame:
    """The rectangle of ground an image covers.

    Attributes:
        center_m: of the rectangle, shape (2,).
        half_m: half its extents, shape (2,).
        pixels: longer side of the image.
    """

    center_m: np.ndarray
    half_m: np.ndarray
    pixels: int = 2048

    @property
    def pixels_per_m(self) -> float:
        """Resolution of the image."""
        return float(self.pixels / (2.0 * self.half_m.max()))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the image [pixels]."""
        width, height = np.round(2.0 * self.half_m * self.pixels_per_m).astype(int)
        return int(width), int(height)

    def to_pixels(self, points: np.ndarray) -> np.ndarray:
        """Return image coordinates (column, row) of points [m], shape (..., 2)."""
        return np.asarray((points - self._corner_m) * (1.0, -1.0) * self.pixels_per_m)

    def to_ground(self, pixels: np.ndarray) -> np.ndarray:
        """Return the points [m] at image coordinates (column, row), shape (..., 2)."""
        return np.asarray(self._corner_m + pixels * (1.0, -1.0) / self.pixels_per_m)

    @property
    def _corner_m(self) -> np.ndarray:
        """The upper left one, shape (2,)."""
        return np.asarray(self.center_m + self.half_m * (-1.0, 1.0))


def paint_ground(
    scene: Scene, plan: Plan | None, frame: GroundFrame, em_m: float | None = None
) -> np.ndarray:
    """Return the ground from above, north up, shape (height, width, 3) of bytes.

    Args:
        scene: the map.
        plan: adds planned paths.
        frame: what the picture covers.
        em_m: size of the letters on the ground; None for one that suits the map.
    """
    if em_m is None:
        em_m = _LETTER_PIXELS / frame.pixels_per_m
    width, height = frame.size
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    low, high = frame.center_m - frame.half_m, frame.center_m + frame.half_m
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    figure.set_facecolor("#DADCD6")
    scene_drawing.draw_ground(axes, scene, hatched=False)
    letter_points = _points(em_m * frame.pixels_per_m)
    if plan is not None:
        _paint_paths(axes, scene, plan, letter_points)
    _paint_rims(axes, scene)
    painted = [
        label for label in video_labels(scene, plan, em_m) if label.kind in PAINTED
    ]
    scene_drawing.draw_labels(axes, scene, painted, letter_points)
    canvas.draw()  # type: ignore[no-untyped-call]
    pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
    return np.array(pixels[:, :, :3])


def video_labels(scene: Scene, plan: Plan | None, em_m: float) -> tuple[MapLabel, ...]:
    """Return the names on the map of a video; those of robots go with the robots."""
    kinds = ("goal", "station", "obstacle", *PAINTED)
    return map_labels(scene, plan, em_m=em_m, kinds=kinds)


def painted_elevation(
    scene: Scene, plan: Plan | None, frame: GroundFrame
) -> trimesh.Trimesh:
    """Return the ground as a mesh whose corners have the colours of its image."""
    image = paint_ground(scene, plan, frame)
    low, high = frame.center_m - frame.half_m, frame.center_m + frame.half_m
    nodes, faces = ground_mesh(scene, low, high, _RELIEF_CELL_M)
    pixel = np.floor(frame.to_pixels(nodes[:, :2])).astype(int)
    limit = np.array([image.shape[1], image.shape[0]]) - 1
    column, row = np.clip(pixel, 0, limit).T
    return trimesh.Trimesh(
        vertices=nodes,
        faces=faces,
        vertex_colors=image[row, column],
        process=False,
    )


def paint_trail(
    ground: np.ndarray, frame: GroundFrame, points: np.ndarray, color: str
) -> None:
    """Paint a driven trail onto a ground image.

    Args:
        ground: pixels of the frame's size, changed in place.
        frame: what the image covers.
        points: of the trail [m], shape (n, 2); fewer than two leave the image as it is.
        color: `#RRGGBB`.
    """
    if len(points) > 1:
        # Pieces shorter than the line is wide would leave ragged edges.
        pixels = frame.to_pixels(thinned(points, _SPACING_M))
        paint_line(ground, pixels, style.DRIVEN.width_em * _LETTER_PIXELS, color)


def paint_line(image: np.ndarray, pixels: np.ndarray, width: float, color: str) -> None:
    """Paint a line with smooth edges into an image.

    Args:
        image: shape (height, width, 3) of bytes, changed in place.
        pixels: corners of the line as (column, row), shape (n, 2).
        width: of the line [pixels].
        color: `#RRGGBB`.
    """
    size, reach = (image.shape[1], image.shape[0]), math.ceil(width)
    low = np.floor(pixels.min(axis=0)).astype(int) - reach
    high = np.ceil(pixels.max(axis=0)).astype(int) + reach
    left, top = np.clip(low, 0, size)
    right, bottom = np.clip(high, 0, size)
    if left < right and top < bottom:
        patch = image[top:bottom, left:right]
        cover = _line_cover(pixels - (left, top), (right - left, bottom - top), width)
        paint = np.array(style.rgb(color)) - patch.astype(float)
        patch[:] = np.round(patch + cover[:, :, None] * paint)


def _line_cover(pixels: np.ndarray, size: tuple[int, int], width: float) -> np.ndarray:
    """Return how much of each pixel a line covers, 0..1, shape (height, width)."""
    fine = _SUPERSAMPLING
    image = Image.new("L", (int(size[0]) * fine, int(size[1]) * fine))
    pen = ImageDraw.Draw(image)
    corners = [(float(x), float(y)) for x, y in pixels * fine]
    pen.line(corners, fill=255, width=round(width * fine), joint="curve")
    radius = 0.5 * width * fine
    for x, y in (corners[0], corners[-1]):
        pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=255)
    return np.asarray(image.reduce(fine)) / 255.0


def _paint_paths(axes: Axes, scene: Scene, plan: Plan, letter_points: float) -> None:
    colors = style.scene_robot_colors(scene)
    for trajectory in plan.trajectories:
        color, look = colors[trajectory.robot], style.PLANNED
        scene_drawing.draw_path(axes, trajectory.state, color, look, letter_points)


def _paint_rims(axes: Axes, scene: Scene) -> None:
    for target in scene.targets():
        _, rim = style.target_colors(target)
        look = {"facecolor": "none", "edgecolor": rim, "linewidth": _points(5.0)}
        scene_drawing.add_shape(axes, target.region.shape, zorder=5, **look)


def _points(pixels: float) -> float:
    return pixels * 72.0 / _DPI
