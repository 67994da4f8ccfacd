"""The map of a scene, drawn with matplotlib on given axes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from shapely import Polygon, box
from shapely.geometry.base import BaseGeometry

from mrmg.scene.types import Robot, Scene, Station
from mrmg.viz import style
from mrmg.viz.contours import draw_contours
from mrmg.viz.figures import new_figure
from mrmg.viz.map_labels import BOLD, MapLabel
from mrmg.viz.map_shapes import wanted_headings

_MAP_INCHES = 8.6
_LEGEND_INCHES = 2.6
LETTER_POINTS = 10.0
"""Size of the names on maps: one em."""
HALO = [withStroke(linewidth=2.5, foreground="white")]
"""What keeps text readable on anything."""
_MARKERS = {"goal": "o", "station": "s"}
LABEL_COLORS = {
    "goal": style.INK,
    "station": style.STATION_EDGE,
    "breakdown": style.RESERVE,
    "terrain": style.INK,
    "obstacle": style.ON_OBSTACLE,
    "height": style.CONTOUR,
}
"""Of all kinds but those of robots, which have their robot's."""


def new_map_figure(scene: Scene) -> tuple[Figure, Axes]:
    """Return a figure shaped like the scene, with room for a legend on the right.

    Args:
        scene: gives the bounds; the axes show them with equal scales, in metres.
    """
    x_min, y_min, x_max, y_max = scene.bounds
    ratio = (y_max - y_min) / (x_max - x_min)
    width_in = _MAP_INCHES / max(1.0, ratio)
    height_in = min(max(width_in * ratio, 2.4), _MAP_INCHES)
    figure = new_figure(width_in + _LEGEND_INCHES + 0.9, height_in + 0.9)
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    margin = 0.01 * max(x_max - x_min, y_max - y_min)
    axes.set_xlim(x_min - margin, x_max + margin)
    axes.set_ylim(y_min - margin, y_max + margin)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.tick_params(colors=style.MUTED, labelsize=9)
    axes.spines[:].set_visible(False)
    return figure, axes


def letter_m(axes: Axes, points: float = LETTER_POINTS) -> float:
    """Return the size of letters on the ground [m].

    Args:
        axes: in metres; all that decides their place in the figure is there.
        points: size of the letters.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()
    pixels_per_m = axes.transData.get_matrix()[0, 0]
    return float(points / 72.0 * figure.dpi / pixels_per_m)


def draw_labels(
    axes: Axes,
    scene: Scene,
    labels: Iterable[MapLabel],
    points: float = LETTER_POINTS,
) -> None:
    """Write the names on a map.

    Args:
        axes: where to draw, in metres.
        scene: gives the robots' colours.
        labels: with their places.
        points: size of one em.
    """
    robots = style.scene_robot_colors(scene)
    for label in labels:
        color = LABEL_COLORS.get(label.kind) or robots[label.of]
        look: dict[str, Any] = {"color": color, "path_effects": HALO}
        if label.kind == "stop":
            bbox = {"boxstyle": "round,pad=0.12", "fc": color, "ec": "white"}
            look = {"color": "white", "bbox": bbox}
        elif label.kind == "obstacle":
            look = {"color": color}
        axes.text(
            label.x_m,
            label.y_m,
            label.text,
            fontsize=points * label.size_em,
            fontweight="bold" if label.kind in BOLD else "normal",
            ha="center",
            va="center",
            zorder=9,
            **look,
        ).set_in_layout(False)


def draw_ground(axes: Axes, scene: Scene, *, hatched: bool = True) -> None:
    """Draw bounds, terrain classes, contour lines and obstacles.

    Args:
        axes: where to draw, in metres.
        scene: what to draw.
        hatched: hatch the terrain classes.
    """
    bounds = box(*scene.bounds)
    add_shape(
        axes, bounds, facecolor=style.GROUND, edgecolor=style.OBSTACLE_EDGE, zorder=0
    )
    classes = style.terrain_classes(scene)
    for rank, area in enumerate(scene.terrain):
        look = classes[area.multiplier]
        add_shape(
            axes,
            area.shape.intersection(bounds),
            facecolor=look.color,
            edgecolor="#00000030",
            linewidth=0.4,
            hatch=look.hatch if hatched else None,
            zorder=1 + 0.001 * rank,
        )
    for obstacle in scene.barriers:
        partial = obstacle.blocks is not None
        add_shape(
            axes,
            obstacle.shape,
            facecolor=style.obstacle_color(obstacle),
            edgecolor=style.OBSTACLE_EDGE,
            linewidth=0.7,
            linestyle="--" if partial else "-",
            zorder=3,
        )
    draw_contours(axes, scene)


def draw_targets(
    axes: Axes,
    scene: Scene,
    colors: Mapping[str, str],
    points: float = LETTER_POINTS,
) -> None:
    """Draw goals, stations with squares, and where and how robots must end.

    Args:
        axes: where to draw, in metres.
        scene: what to draw.
        colors: of visited goals, by id.
        points: size of the letters, which that of rims and squares goes with.
    """
    for target in scene.targets():
        fill, edge = style.target_colors(target)
        fill = colors.get(target.id, fill)
        area = {"facecolor": fill, "edgecolor": edge, "linewidth": 0.13 * points}
        add_shape(axes, target.region.shape, zorder=5, **area)
        if isinstance(target, Station):
            look = marker("s", 0.6 * points, fill, edge)
            rim = 0.1 * points
            axes.plot(*target.region.center, markeredgewidth=rim, zorder=6, **look)
    robots = style.scene_robot_colors(scene)
    for robot in scene.robots:
        if robot.finish:
            look = {"edgecolor": robots[robot.id], "linestyle": (0, (2, 1.5))}
            add_shape(axes, robot.finish.region.shape, fill=False, zorder=5, **look)
    for _, arrow, _ in wanted_headings(scene):
        add_shape(axes, arrow, facecolor=style.GOAL_EDGE, linewidth=0.0, zorder=5)


def draw_footprint(
    axes: Axes, robot: Robot, pose: tuple[float, float, float], color: str
) -> None:
    """Draw a robot's outline at a pose (x [m], y [m], yaw [rad])."""
    add_shape(
        axes,
        Polygon(robot.model.footprint_at(pose)),
        facecolor=color,
        edgecolor="white",
        linewidth=0.9,
        zorder=7,
    )


def draw_path(
    axes: Axes,
    state: np.ndarray,
    color: str,
    look: style.LineLook,
    points: float = LETTER_POINTS,
) -> None:
    """Draw a way through the places of states (x [m], y [m], ...) with round ends."""
    stroke = look.stroke(points) | {"solid_capstyle": "round", "zorder": 4.2}
    axes.plot(state[:, 0], state[:, 1], color=color, **stroke)


def map_legend(scene: Scene) -> list[Patch | Line2D]:
    """Return legend handles for all kinds of things the scene holds."""
    return [_handle(entry) for entry in style.map_key(scene)]


def _handle(entry: style.KeyEntry) -> Patch | Line2D:
    if entry.look == "line":
        return Line2D([], [], color=entry.color, label=entry.label)
    if entry.look == "area":
        return Patch(
            facecolor=entry.color,
            edgecolor=entry.edge,
            hatch=entry.hatch or None,
            linestyle="--" if entry.dashed else "-",
            label=entry.label,
        )
    look = marker(_MARKERS[entry.look], 9.0, entry.color, entry.edge)
    return marker_handle(entry.label, **look)


def marker(shape: Any, size: float, face: str, edge: str) -> dict[str, Any]:
    """Return the look of a marker, as of matplotlib's `Line2D`; `shape`, too."""
    return {
        "marker": shape,
        "markersize": size,
        "markerfacecolor": face,
        "markeredgecolor": edge,
    }


def marker_handle(label: str, **look: Any) -> Line2D:
    """Return the legend's handle of a marker; `look` as of matplotlib's `Line2D`."""
    return Line2D([], [], linestyle="none", label=label, **look)


def add_legend(axes: Axes, handles: list[Patch | Line2D]) -> None:
    """Put a legend to the right of the axes."""
    axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        borderaxespad=0.0,
        frameon=False,
        fontsize=10,
        handlelength=1.6,
        labelspacing=0.65,
    )


def add_shape(axes: Axes, shape: BaseGeometry, **look: object) -> None:
    """Draw the polygons of a geometry; `look` as of matplotlib's `PathPatch`."""
    for polygon in polygons_of(shape):
        rings = [polygon.exterior, *polygon.interiors]
        outline = Outline.make_compound_path(
            *(Outline(np.asarray(ring.coords), closed=True) for ring in rings)
        )
        axes.add_patch(PathPatch(outline, **look))


def polygons_of(shape: BaseGeometry) -> list[Polygon]:
    """Return the polygons a geometry is made of; lines and points are left out."""
    parts = shapely.get_parts(shape)
    return [part for part in parts if isinstance(part, Polygon) and not part.is_empty]
