"""The map of a scene, drawn with matplotlib on given axes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from shapely import MultiPolygon, Polygon, box, maximum_inscribed_circle, unary_union
from shapely.geometry.base import BaseGeometry

from mrmg import storage
from mrmg.results import style
from mrmg.results.contours import draw_contours
from mrmg.scene.types import Goal, Region, Robot, Scene, Station

DPI = 110
_MAP_INCHES = 8.6
_LEGEND_INCHES = 2.6
_LABEL_M = 1.5
_PARTIAL = style.OBSTACLE + "66"
_TIMELESS: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None},
    "svg": {"Date": None},
}
"""Metadata by format, such that equal figures give equal files."""
HALO = [withStroke(linewidth=2.5, foreground="white")]
"""What keeps text readable on anything."""


def new_map_figure(scene: Scene) -> tuple[Figure, Axes]:
    """Return a figure shaped like the scene, with room for a legend on the right.

    Args:
        scene: gives the bounds; the axes show them with equal scales, in metres.
    """
    x_min, y_min, x_max, y_max = scene.bounds
    ratio = (y_max - y_min) / (x_max - x_min)
    width_in = _MAP_INCHES / max(1.0, ratio)
    height_in = min(max(width_in * ratio, 2.4), _MAP_INCHES)
    figure = Figure(
        figsize=(width_in + _LEGEND_INCHES + 0.9, height_in + 0.9),
        dpi=DPI,
        layout="constrained",
        facecolor="white",
    )
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    margin = 0.01 * max(x_max - x_min, y_max - y_min)
    axes.set_xlim(x_min - margin, x_max + margin)
    axes.set_ylim(y_min - margin, y_max + margin)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.tick_params(colors=style.MUTED, labelsize=9)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return figure, axes


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure to `path` atomically, in the format of its suffix."""
    form = path.suffix.removeprefix(".").lower() or "png"
    with storage.atomic_path(path) as temporary:
        figure.savefig(temporary, format=form, metadata=_TIMELESS.get(form))


def draw_scene(scene: Scene, path: Path) -> None:
    """Draw the map of a scene, with its legend, to a picture file.

    Args:
        scene: what to draw.
        path: picture to write (PNG, SVG or PDF by its suffix).
    """
    figure, axes = new_map_figure(scene)
    draw_ground(axes, scene)
    for goal in scene.goals:
        draw_goal(axes, goal, style.goal_labels(scene)[goal.id])
    for station in scene.stations:
        draw_station(axes, station, style.station_labels(scene)[station.id])
    draw_robots(axes, scene)
    axes.set_title(_title(scene), loc="left", fontsize=12, color=style.INK)
    handles = map_legend(scene)
    add_legend(axes, handles)
    write_figure(figure, path)


def draw_ground(
    axes: Axes,
    scene: Scene,
    *,
    hatched: bool = True,
    label_points: float | None = 9.0,
) -> None:
    """Draw bounds, terrain classes, contour lines and obstacles.

    Args:
        axes: where to draw, in metres.
        scene: what to draw.
        hatched: hatch the terrain classes.
        label_points: size of the multipliers printed on terrain areas, and nearly that
            of heights; None for neither.
    """
    bounds = box(*scene.bounds)
    _add_shape(
        axes, bounds, facecolor=style.GROUND, edgecolor=style.OBSTACLE_EDGE, zorder=0
    )
    classes = style.terrain_classes(scene)
    for rank, area in enumerate(scene.terrain):
        look = classes[area.multiplier]
        _add_shape(
            axes,
            area.shape.intersection(bounds),
            facecolor=look.color,
            edgecolor="#00000030",
            linewidth=0.4,
            hatch=look.hatch if hatched else None,
            zorder=1 + 0.001 * rank,
        )
    for obstacle in scene.obstacles:
        partial = obstacle.blocks is not None
        _add_shape(
            axes,
            obstacle.shape,
            facecolor=_PARTIAL if partial else style.OBSTACLE,
            edgecolor=style.OBSTACLE_EDGE,
            linewidth=0.7,
            linestyle="--" if partial else "-",
            zorder=3,
        )
    draw_contours(axes, scene, label_points)
    if label_points is not None:
        _label_terrain(axes, scene, label_points)


def draw_goal(
    axes: Axes,
    goal: Goal,
    label: str,
    *,
    color: str = style.GOAL_OPEN,
    points: float = 10.0,
) -> None:
    """Draw a goal region and its label; a colour other than white means visited."""
    draw_region(axes, goal.region, color, style.GOAL_EDGE, 0.13 * points)
    _draw_label(axes, goal.region, label, style.INK, points)


def draw_station(
    axes: Axes, station: Station, label: str, *, points: float = 10.0
) -> None:
    """Draw a recharging station: its region with a square and its label."""
    width = 0.13 * points
    draw_region(axes, station.region, style.STATION, style.STATION_EDGE, width)
    axes.plot(
        *station.region.center,
        marker="s",
        markersize=0.6 * points,
        markerfacecolor=style.STATION,
        markeredgecolor=style.STATION_EDGE,
        markeredgewidth=0.1 * points,
        zorder=6,
    )
    _draw_label(axes, station.region, f"⚡{label}", style.STATION_EDGE, points)


def draw_region(
    axes: Axes, region: Region, color: str, edge: str, linewidth: float
) -> None:
    """Draw a goal's or station's region."""
    _add_shape(
        axes,
        region.shape,
        facecolor=color,
        edgecolor=edge,
        linewidth=linewidth,
        zorder=5,
    )


def draw_robots(axes: Axes, scene: Scene) -> None:
    """Draw every robot's footprint at its start, its heading and its id."""
    colors = style.scene_robot_colors(scene)
    for robot in scene.robots:
        draw_footprint(axes, robot, robot.pose, facecolor=colors[robot.id], alpha=1.0)
        outline = footprint_at(robot, robot.pose)
        axes.annotate(
            robot.id,
            (float(outline[:, 0].mean()), float(outline[:, 1].min())),
            xytext=(0, -3),
            textcoords="offset points",
            fontsize=10,
            fontweight="bold",
            color=colors[robot.id],
            ha="center",
            va="top",
            path_effects=HALO,
            zorder=9,
        )


def draw_footprint(
    axes: Axes,
    robot: Robot,
    pose: tuple[float, float, float],
    *,
    facecolor: str,
    alpha: float,
) -> None:
    """Draw a robot's outline at a pose (x [m], y [m], yaw [rad])."""
    _add_shape(
        axes,
        Polygon(footprint_at(robot, pose)),
        facecolor=facecolor,
        edgecolor="white",
        linewidth=0.9,
        alpha=alpha,
        zorder=7,
    )


def footprint_at(robot: Robot, pose: tuple[float, float, float]) -> np.ndarray:
    """Return a robot's outline at a pose, in the world's frame [m], shape (m, 2)."""
    x_m, y_m, yaw = pose
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    return np.asarray(robot.model.footprint_m @ turn.T + (x_m, y_m))


def map_legend(scene: Scene) -> list[Patch | Line2D]:
    """Return legend handles for all kinds of things the scene holds."""
    handles: list[Patch | Line2D] = []
    if scene.goals:
        handles.append(_marker("o", style.GOAL_OPEN, style.GOAL_EDGE, "goal"))
    if scene.stations:
        handles.append(
            _marker("s", style.STATION, style.STATION_EDGE, "recharging station ⚡")
        )
    if any(obstacle.blocks is None for obstacle in scene.obstacles):
        handles.append(
            Patch(
                facecolor=style.OBSTACLE,
                edgecolor=style.OBSTACLE_EDGE,
                label="obstacle",
            )
        )
    if any(obstacle.blocks is not None for obstacle in scene.obstacles):
        handles.append(
            Patch(
                facecolor=_PARTIAL,
                edgecolor=style.OBSTACLE_EDGE,
                linestyle="--",
                label="obstacle for some robots",
            )
        )
    if scene.terrain and 1.0 not in style.terrain_classes(scene):
        plain = Patch(
            facecolor=style.GROUND, edgecolor=style.MUTED, label="plain ground ×1"
        )
        handles.append(plain)
    if scene.elevation is not None:
        handles.append(Line2D([], [], color=style.CONTOUR, label="contour line"))
    handles += [
        Patch(
            facecolor=look.color,
            edgecolor="#00000060",
            hatch=look.hatch,
            label=look.label,
        )
        for look in style.terrain_classes(scene).values()
    ]
    return handles


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


def _title(scene: Scene) -> str:
    counts = [
        (len(scene.robots), "robot"),
        (len(scene.goals), "goal"),
        (len(scene.stations), "station"),
        (len(scene.terrain), "terrain area"),
    ]
    words = [f"{count} {noun}{'' if count == 1 else 's'}" for count, noun in counts]
    return f"{scene.name}: " + ", ".join(words)


def terrain_spots(scene: Scene) -> list[tuple[float, float, float]]:
    """Return where each visible terrain area has room for its name: (x, y, multiplier).

    Areas that obstacles, targets or later areas cover altogether are left out.
    """
    taken = [obstacle.shape for obstacle in scene.obstacles]
    taken += [target.region.shape.buffer(_LABEL_M) for target in scene.targets()]
    free = box(*scene.bounds).difference(unary_union(taken))
    spots = []
    for rank, area in enumerate(scene.terrain):
        visible = area.shape.intersection(free)
        for later in scene.terrain[rank + 1 :]:
            visible = visible.difference(later.shape)
        if not visible.is_empty:
            widest = max(polygons_of(visible), key=lambda part: part.area)
            x_m, y_m = maximum_inscribed_circle(widest, tolerance=0.5).coords[0]
            spots.append((x_m, y_m, area.multiplier))
    return spots


def _label_terrain(axes: Axes, scene: Scene, points: float) -> None:
    for x_m, y_m, multiplier in terrain_spots(scene):
        axes.text(
            x_m,
            y_m,
            f"×{multiplier:g}",
            fontsize=points,
            color=style.INK,
            ha="center",
            va="center",
            path_effects=HALO,
            zorder=4,
        )


def _draw_label(
    axes: Axes, region: Region, text: str, color: str, points: float
) -> None:
    x_min, _, x_max, y_max = region.shape.bounds
    # Towards the upper right corner of the region's box, where a circle leaves room.
    axes.annotate(
        text,
        (x_max - 0.12 * (x_max - x_min), y_max),
        xytext=(1, -1),
        textcoords="offset points",
        fontsize=points,
        fontweight="bold",
        color=color,
        va="bottom",
        path_effects=HALO,
        zorder=8,
    )


def _marker(shape: str, face: str, edge: str, label: str) -> Line2D:
    return Line2D(
        [],
        [],
        linestyle="none",
        marker=shape,
        markersize=9,
        markerfacecolor=face,
        markeredgecolor=edge,
        label=label,
    )


def _add_shape(axes: Axes, shape: BaseGeometry, **look: object) -> None:
    for polygon in polygons_of(shape):
        rings = [polygon.exterior, *polygon.interiors]
        outline = Outline.make_compound_path(
            *(Outline(np.asarray(ring.coords), closed=True) for ring in rings)
        )
        axes.add_patch(PathPatch(outline, **look))


def polygons_of(shape: BaseGeometry) -> list[Polygon]:
    """Return the polygons a geometry is made of; lines and points are left out."""
    if isinstance(shape, Polygon):
        return [shape] if not shape.is_empty else []
    if isinstance(shape, MultiPolygon) or hasattr(shape, "geoms"):
        return [part for item in shape.geoms for part in polygons_of(item)]
    return []
