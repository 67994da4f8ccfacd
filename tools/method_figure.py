"""The method in three pictures: roadmap, tours along it, motion tree with its plan."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from print_style import PAGE_IN, TEXT_PT, print_figure
from problem_figure import add_legend, aspect, draw_starts, draw_targets, prepare_map

from mrmg.scene.types import Scene
from mrmg.viz import scene_drawing, style

_PANELS = 3
_TITLES = ("(a) roadmap", "(b) tours", "(c) motion tree and plan")
_BANDS = 4
"""Shades of the roadmap's edges, from plain to the dearest ground."""
_LIGHTEST = 0.25
Dash = tuple[float, tuple[float, ...]]
_DASHES: tuple[Dash, ...] = (
    (0, (1, 0)),
    (0, (5, 1.5)),
    (0, (1.5, 1)),
    (0, (6, 1.5, 1.5, 1.5)),
)


def draw_method(
    scene: Scene,
    *,
    roadmap: np.ndarray,
    multiplier: np.ndarray,
    tours: Mapping[str, np.ndarray],
    tree: Mapping[str, np.ndarray],
    paths: Mapping[str, np.ndarray],
    path: Path,
) -> None:
    """Draw how a plan comes about, over the width of a page.

    Args:
        scene: the mission.
        roadmap: edges [m], shape (E, 2, 2).
        multiplier: energy of each edge over that of plain ground, shape (E,).
        tours: each robot's tour along the roadmap [m], shape (n, 2), by robot.
        tree: each robot's edges of the motion tree [m], shape (N, 2, 2), by robot.
        paths: each robot's planned path [m], shape (n, 2), by robot.
        path: file to write (PDF, SVG or PNG by its suffix).
    """
    map_in = PAGE_IN / _PANELS
    with print_figure((PAGE_IN, map_in * aspect(scene) + 0.6), path) as own:
        panels = own.subplots(1, _PANELS)
        for axes, title in zip(panels, _TITLES, strict=True):
            prepare_map(axes, scene)
            scene_drawing.draw_ground(axes, scene, hatched=False)
            draw_targets(axes, scene)
            draw_starts(axes, scene)
            axes.set_title(title, fontsize=TEXT_PT)
        _draw_roadmap(panels[0], roadmap, multiplier)
        dashes = dict(zip(tours, _DASHES * len(tours), strict=False))
        colors = style.scene_robot_colors(scene)
        for robot, way in tours.items():
            _draw_way(panels[1], way, colors[robot], dashes[robot])
        for robot, edges in tree.items():
            _draw_edges(panels[2], edges, colors[robot], 0.5, alpha=0.55)
        for robot, way in paths.items():
            _draw_way(panels[2], way, colors[robot], dashes[robot])
        handles = [
            Line2D([], [], color=style.INK, linewidth=0.7, label="edge of the roadmap"),
            Line2D([], [], color=style.MUTED, linewidth=0.6, label="edge of the tree"),
            *(
                Line2D([], [], color=colors[robot], linestyle=dash, label=robot)
                for robot, dash in dashes.items()
            ),
        ]
        add_legend(own, handles, columns=len(handles))


def _draw_roadmap(axes: Axes, edges: np.ndarray, multiplier: np.ndarray) -> None:
    """Draw the edges, darker where they cost more."""
    steps = np.linspace(1.0, max(float(multiplier.max()), 1.01), _BANDS + 1)
    band = np.clip(np.digitize(multiplier, steps) - 1, 0, _BANDS - 1)
    for rank in range(_BANDS):
        alpha = _LIGHTEST + (1.0 - _LIGHTEST) * rank / (_BANDS - 1)
        _draw_edges(axes, edges[band == rank], style.INK, 0.25, alpha=alpha)


def _draw_edges(
    axes: Axes, edges: np.ndarray, color: str, width: float, *, alpha: float
) -> None:
    lines = LineCollection(
        list(edges), colors=color, linewidths=width, alpha=alpha, zorder=4.1
    )
    axes.add_collection(lines, autolim=False)


def _draw_way(axes: Axes, way: np.ndarray, color: str, dash: Dash) -> None:
    axes.plot(
        way[:, 0],
        way[:, 1],
        color=color,
        linestyle=dash,
        linewidth=1.1,
        zorder=4.5,
    )
