"""Battery content over time: planned against simulated, one panel per robot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes

from mrmg.energy.battery_curves import (
    BatteryCurve,
    measured_curves,
    planned_curves,
    with_recharge_jumps,
)
from mrmg.plans import Plan, Visit
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog, require_same_mission
from mrmg.viz import figures, scene_drawing, style
from mrmg.viz.timeline_rows import named_visits

_PANEL_INCHES = (9.5, 2.5)
_LINE_SHARE = 0.082
"""Height of a line of names, in heights of the panel."""
_FULL_SHARE = 1.04
"""Upper end of the curves' room, in full batteries."""
_SHORTEST_S = 0.1


def draw_energy(
    scene: Scene, plan: Plan, log: ExecutionLog | None = None, *, path: Path
) -> None:
    """Draw battery content over time, one panel per robot, to a picture file.

    Args:
        scene: what both were made for.
        plan: what was predicted.
        log: adds the content by the work of the simulated drives.
        path: picture to write (PNG, SVG or PDF by its suffix).

    Raises:
        IdentityError: if scene, plan and log do not belong together.
    """
    require_same_mission(scene, plan, log)
    planned = planned_curves(scene, plan)
    driven = measured_curves(scene, plan, log) if log else ()
    width_in, panel_in = _PANEL_INCHES
    figure = figures.new_figure(width_in, panel_in * len(planned) + 0.7)
    panels = figure.subplots(len(planned), 1, sharex=True, squeeze=False)[:, 0]
    for at, axes in enumerate(panels):
        draw_battery(axes, scene, (planned[at], *driven[at : at + 1]))
    panels[-1].set_xlabel("time [s]")
    figures.add_legend_above(figure, panels[0].get_legend_handles_labels()[0])
    figures.write_figure(figure, path)


def draw_battery(axes: Axes, scene: Scene, curves: Sequence[BatteryCurve]) -> None:
    """Draw one robot's battery content, its reserve, recharges and goals.

    Args:
        axes: where to draw, over time [s].
        scene: what both were made for.
        curves: of the robot: as planned, and as simulated where it was.
    """
    robot, battery = curves[-1].robot, curves[-1].battery
    color = style.scene_robot_colors(scene)[robot]
    capacity_kJ = battery.capacity_J / 1000.0
    reserve_kJ = battery.reserve_J / 1000.0
    looks = {"planned": style.PLANNED, "simulated": style.DRIVEN}
    for curve, (label, look) in zip(curves, looks.items(), strict=False):
        stroke = look.stroke(scene_drawing.LETTER_POINTS) | {"solid_joinstyle": "round"}
        time_s, energy_J = with_recharge_jumps(curve)
        axes.plot(time_s, energy_J / 1000.0, color=color, label=label, **stroke)
    axes.axhline(
        reserve_kJ, color=style.RESERVE, linewidth=1.2, linestyle="--", label="reserve"
    )
    axes.axhspan(0.0, reserve_kJ, color=style.RESERVE, alpha=0.08, linewidth=0)
    axes.set_xlim(0.0, max(_SHORTEST_S, *(float(curve.time_s[-1]) for curve in curves)))
    room = _mark_visits(axes, scene, curves[-1].visits)
    least_J = min(curve.least_J for curve in curves)
    low = min(0.0, 1.05 * least_J / battery.capacity_J)
    high = low + (_FULL_SHARE - low) / (1.0 - room)
    axes.set_ylim(low * capacity_kJ, high * capacity_kJ)
    axes.set_ylabel("battery [kJ]")
    axes.set_title(robot, loc="left", fontsize=11, fontweight="bold", color=color)
    figures.tidy(axes)
    percent = axes.twinx()
    percent.set_ylim(100.0 * low, 100.0 * high)
    percent.set_yticks([0, 25, 50, 75, 100])
    percent.set_ylabel("charge [%]")
    percent.spines["top"].set_visible(False)


def _mark_visits(axes: Axes, scene: Scene, visits: tuple[Visit, ...]) -> float:
    """Mark and name visits; return the share of the height that the names take."""
    named = named_visits(scene, visits, float(axes.get_xlim()[1]), (figures.NAMES_EM,))
    rows = max([1, *(item.lines[0] + 1 for item in named)])
    for item in named:
        station = item.visit.kind == "station"
        bottom = 1.0 - _LINE_SHARE * (rows - max(item.lines[0], 0))
        axes.axvline(
            item.visit.time_s,
            ymax=bottom,
            color=style.STATION_EDGE if station else "#B9BEC7",
            linewidth=1.0 if station else 0.7,
            linestyle="-" if station else ":",
            zorder=0.5,
        )
        figures.write_name(
            axes,
            item,
            bottom,
            transform=axes.get_xaxis_transform(),
            fontweight="bold" if station else "normal",
            color=style.STATION_EDGE if station else style.MUTED,
        )
    return rows * _LINE_SHARE
