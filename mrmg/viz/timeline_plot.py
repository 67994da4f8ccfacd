"""The timeline of a mission as a figure: what each robot does when."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog, require_same_mission
from mrmg.viz import figures, style
from mrmg.viz.activities import BROKEN, CHARGING, DRIVING, WAITING
from mrmg.viz.timeline_rows import TimelineRow, timeline_rows

_WIDTH_INCHES, _BAR_INCHES, _LINE_INCHES = 9.5, 0.24, 0.16
_LOOKS: dict[str, dict[str, Any]] = {
    WAITING: {"facecolor": "white", "edgecolor": style.MUTED, "hatch": "////"},
    CHARGING: {"facecolor": style.STATION, "edgecolor": style.STATION_EDGE},
    BROKEN: {"facecolor": "white", "edgecolor": style.RESERVE, "hatch": "xxx"},
}
"""Bars by activity; driving has the robot's colour, and having finished no bar."""
_EVENT: dict[str, Any] = {"color": style.RESERVE, "linewidth": 1.2, "linestyle": ":"}


def draw_timeline(
    scene: Scene, plan: Plan, log: ExecutionLog | None = None, *, path: Path
) -> None:
    """Draw what each robot does when, one row per robot, to a picture file.

    Args:
        scene: gives names, stations and colours.
        plan: what was to be driven; shown where there is no log.
        log: what was driven.
        path: picture to write (PNG, SVG or PDF by its suffix).

    Raises:
        IdentityError: if scene, plan and log do not belong together.
    """
    require_same_mission(scene, plan, log)
    rows, end_s = timeline_rows(scene, plan, log, (figures.NAMES_EM,))
    lines = np.array([row.line_count(0) for row in rows])
    tops_in = np.cumsum(2.0 * _BAR_INCHES + _LINE_INCHES * lines)
    figure = figures.new_figure(_WIDTH_INCHES, 1.0 + tops_in[-1])
    axes = figure.add_subplot()
    axes.set_xlim(0.0, end_s)
    for bottom_in, row in zip(tops_in, rows, strict=True):
        _draw_row(axes, scene, row, float(bottom_in) - _BAR_INCHES, end_s)
    for event in log.events if log else ():
        axes.axvline(event.time_s, **_EVENT)
    axes.set_ylim(tops_in[-1], 0.0)
    axes.set_yticks(tops_in - _BAR_INCHES, [row.robot for row in rows])
    axes.set_xlabel("time [s]")
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
    handles: list[Patch | Line2D] = [
        Patch(facecolor=style.MUTED, label="driving"),
        Patch(**_LOOKS[WAITING], label="waiting"),
        Patch(**_LOOKS[CHARGING], label="at a station"),
    ]
    if any(row.standing == "broken down" for row in rows):
        handles.append(Patch(**_LOOKS[BROKEN], label="broken down"))
    if log and log.events:
        handles.append(Line2D([], [], **_EVENT, label="stop or new plan"))
    figures.add_legend_above(figure, handles)
    figures.write_figure(figure, path)


def _draw_row(
    axes: Axes, scene: Scene, row: TimelineRow, middle_in: float, end_s: float
) -> None:
    """Draw a robot's bar about `middle_in` below the top, and names above it."""
    colors = style.scene_robot_colors(scene)
    looks = {**_LOOKS, DRIVING: {"facecolor": colors[row.robot]}}
    for span in row.spans:
        if span.kind in looks:
            axes.broken_barh(
                [(span.start_s, span.end_s - span.start_s)],
                (middle_in - 0.5 * _BAR_INCHES, _BAR_INCHES),
                **looks[span.kind],
            )
    if row.standing == "not used":
        look: Any = {"fontsize": figures.NAME_POINTS, "color": style.MUTED}
        axes.text(0.01 * end_s, middle_in, row.standing, va="center", **look)
    for named in row.visits:
        lines, time_s = max(named.lines[0], 0), named.visit.time_s
        station = named.visit.kind == "station"
        color = style.STATION_EDGE if station else style.INK
        top_in = middle_in - 0.65 * _BAR_INCHES - _LINE_INCHES * lines
        bottom_in = middle_in + 0.5 * _BAR_INCHES
        axes.plot([time_s] * 2, [top_in, bottom_in], color=color, linewidth=0.9)
        figures.write_name(axes, named, top_in, color=color)
