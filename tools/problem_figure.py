"""Scenes for papers: one problem in a column, or many side by side over the page."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from print_style import COLUMN_IN, PAGE_IN, SMALL_PT, TEXT_PT, print_figure

from mrmg.scene.types import Scene, Station
from mrmg.viz import scene_drawing, style
from mrmg.viz.map_labels import KINDS, map_labels

_ABREAST = 3
_ROBOT_PT = 6.0
_LEGEND_COLUMNS = 4
_MARKER_SCALE = 0.6


def draw_problem(scene: Scene, path: Path) -> None:
    """Draw one problem, a column wide: map, robots, goals, stations, legend.

    Args:
        scene: the problem.
        path: file to write (PDF, SVG or PNG by its suffix).
    """
    handles = problem_legend([scene])
    legend_in = 0.17 * math.ceil(len(handles) / 2) + 0.1
    with print_figure((COLUMN_IN, COLUMN_IN * aspect(scene) + legend_in), path) as own:
        axes = own.add_subplot()
        prepare_map(axes, scene)
        scene_drawing.draw_ground(axes, scene)
        scene_drawing.draw_targets(axes, scene, {}, SMALL_PT)
        draw_starts(axes, scene)
        add_legend(own, handles, columns=2)
        _draw_labels(axes, scene, set(KINDS) - {"obstacle"})


def draw_problems(scenes: Sequence[Scene], path: Path) -> None:
    """Draw problems side by side, three abreast over the width of a page.

    Args:
        scenes: the problems; at least one.
        path: file to write (PDF, SVG or PNG by its suffix).
    """
    rows = math.ceil(len(scenes) / _ABREAST)
    map_in = PAGE_IN / _ABREAST
    height_in = rows * (map_in * max(map(aspect, scenes)) + 0.1) + 0.4
    handles = problem_legend(scenes)
    with print_figure((PAGE_IN, height_in), path) as own:
        panels = own.subplots(rows, _ABREAST, squeeze=False).ravel()
        for number, (axes, scene) in enumerate(zip(panels, scenes, strict=False)):
            prepare_map(axes, scene)
            scene_drawing.draw_ground(axes, scene)
            draw_targets(axes, scene)
            draw_starts(axes, scene)
            axes.set_title(f"({chr(ord('a') + number)}) {scene.name}", fontsize=TEXT_PT)
        for axes in panels[len(scenes) :]:
            axes.remove()
        add_legend(own, handles, columns=_LEGEND_COLUMNS)
        for axes, scene in zip(panels, scenes, strict=False):
            _draw_labels(axes, scene, ("terrain", "height"))


def _draw_labels(axes: Axes, scene: Scene, kinds: Collection[str]) -> None:
    em_m = scene_drawing.letter_m(axes, SMALL_PT)
    labels = map_labels(scene, em_m=em_m, kinds=kinds)
    scene_drawing.draw_labels(axes, scene, labels, SMALL_PT)


def aspect(scene: Scene) -> float:
    """Return height over width of a scene's bounds."""
    x_min, y_min, x_max, y_max = scene.bounds
    return (y_max - y_min) / (x_max - x_min)


def prepare_map(axes: Axes, scene: Scene) -> None:
    """Give axes the scene's bounds at equal scales, and nothing around them."""
    x_min, y_min, x_max, y_max = scene.bounds
    margin = 0.01 * max(x_max - x_min, y_max - y_min)
    axes.set_xlim(x_min - margin, x_max + margin)
    axes.set_ylim(y_min - margin, y_max + margin)
    axes.set_aspect("equal")
    axes.set_axis_off()


def draw_targets(axes: Axes, scene: Scene) -> None:
    """Draw goals as circles and stations as squares, without names."""
    for target in scene.targets():
        shape = "s" if isinstance(target, Station) else "o"
        look = scene_drawing.marker(shape, 4.0, *style.target_colors(target))
        axes.plot(*target.region.center, markeredgewidth=0.7, zorder=6, **look)


def draw_starts(axes: Axes, scene: Scene) -> None:
    """Draw every robot's start as an arrowhead that points where the robot heads."""
    colors = style.scene_robot_colors(scene)
    for robot in scene.robots:
        x_m, y_m, yaw = robot.pose
        arrowhead = (3, 0, math.degrees(yaw) - 90.0)
        look = scene_drawing.marker(arrowhead, _ROBOT_PT, colors[robot.id], "white")
        axes.plot(x_m, y_m, markeredgewidth=0.4, zorder=9, **look)


def problem_legend(scenes: Sequence[Scene]) -> list[Patch | Line2D]:
    """Return legend handles for all kinds of things that any of the scenes holds."""
    size = _ROBOT_PT / _MARKER_SCALE
    look = scene_drawing.marker((3, 0, -90.0), size, style.INK, style.INK)
    start = scene_drawing.marker_handle("robot at its start", **look)
    found: dict[object, Patch | Line2D] = {start.get_label(): start}
    for scene in scenes:
        for handle in scene_drawing.map_legend(scene):
            found.setdefault(handle.get_label(), handle)
    # Multipliers are printed on the areas; one entry states what they are.
    terrain = [name for name in found if str(name).startswith("terrain ×")]
    areas = [found.pop(name) for name in terrain][-1:]
    for handle in areas:
        handle.set_label("terrain: × energy")
    return [*found.values(), *areas]


def add_legend(
    figure: Figure, handles: Sequence[Patch | Line2D], *, columns: int
) -> None:
    """Put a legend below everything else."""
    figure.legend(
        handles=list(handles),
        loc="outside lower center",
        ncols=columns,
        frameon=False,
        fontsize=TEXT_PT,
        handlelength=1.5,
        markerscale=_MARKER_SCALE,
        columnspacing=1.2,
        labelspacing=0.35,
    )
