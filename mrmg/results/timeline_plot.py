"""The timeline of a mission as a figure: what each robot does when."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mrmg.accounting import Motion
from mrmg.execution.log import ExecutionLog, require_same_mission
from mrmg.mission import Plan
from mrmg.results import mission_series as series
from mrmg.results import scene_drawing, style
from mrmg.scene.types import Scene

_WIDTH_INCHES, _ROW_INCHES = 9.5, 0.62
_HALF_HEIGHT = 0.2
_SHORTEST_S = 0.1
_WAITING: dict[str, Any] = {
    "facecolor": "white",
    "edgecolor": style.MUTED,
    "hatch": "////",
}
_EVENT: dict[str, Any] = {
    "color": style.RESERVE,
    "linewidth": 1.2,
    "linestyle": ":",
}
_CHARGING: dict[str, Any] = {
    "facecolor": style.STATION,
    "edgecolor": style.STATION_EDGE,
}


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
    motions = series.shown_motions(plan, log)
    figure = Figure(
        figsize=(_WIDTH_INCHES, 1.0 + _ROW_INCHES * len(motions)),
        dpi=scene_drawing.DPI,
        layout="constrained",
        facecolor="white",
    )
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for row, motion in enumerate(motions):
        _draw_row(axes, scene, plan, motion, row)
    for event in log.events if log else ():
        axes.axvline(event.time_s, **_EVENT)
    axes.set_ylim(len(motions) - 0.5, -0.75)
    axes.set_yticks(range(len(motions)), [motion.robot for motion in motions])
    axes.set_xlim(
        0.0, max(_SHORTEST_S, *(float(motion.time_s[-1]) for motion in motions))
    )
    axes.set_xlabel("time [s]")
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.tick_params(axis="y", length=0)
    handles: list[Patch | Line2D] = [
        Patch(facecolor=style.MUTED, label="driving"),
        Patch(**_WAITING, label="waiting"),
        Patch(**_CHARGING, label="at a station"),
    ]
    if log and log.events:
        handles.append(Line2D([], [], **_EVENT, label="stop or new plan"))
    figure.legend(
        handles=handles,
        loc="outside upper right",
        ncols=len(handles),
        frameon=False,
        fontsize=9.5,
    )
    scene_drawing.write_figure(figure, path)


def _draw_row(axes: Axes, scene: Scene, plan: Plan, motion: Motion, row: int) -> None:
    visits = series.shown_visits(scene, plan, motion)
    color = style.scene_robot_colors(scene)[motion.robot]
    looks: dict[str, dict[str, Any]] = {
        series.DRIVING: {"facecolor": color},
        series.WAITING: _WAITING,
        series.CHARGING: _CHARGING,
    }
    for span in series.activities(scene, motion, visits):
        if span.kind in looks:
            axes.broken_barh(
                [(span.start_s, span.end_s - span.start_s)],
                (row - _HALF_HEIGHT, 2 * _HALF_HEIGHT),
                **looks[span.kind],
            )
    labels = {**style.goal_labels(scene), **style.station_labels(scene)}
    for visit in visits:
        station = visit.kind == "station"
        name = labels[visit.target]
        axes.plot(
            [visit.time_s] * 2,
            [row - 1.25 * _HALF_HEIGHT, row + _HALF_HEIGHT],
            color=style.STATION_EDGE if station else style.INK,
            linewidth=0.9,
        )
        axes.annotate(
            f"⚡{name}" if station else name,
            (visit.time_s, row - 1.25 * _HALF_HEIGHT),
            xytext=(0, 1),
            textcoords="offset points",
            fontsize=8.5,
            ha="center",
            va="bottom",
            color=style.STATION_EDGE if station else style.INK,
        )
