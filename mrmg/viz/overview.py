"""The overview picture: map, planned and driven paths, and the order of visits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from matplotlib.patheffects import withStroke

from mrmg.counted import counted
from mrmg.energy.text import energy_text
from mrmg.plans import Plan
from mrmg.scene.types import Robot, Scene
from mrmg.simulation.log import ExecutionLog, require_same_mission
from mrmg.viz import scene_drawing, style
from mrmg.viz.activities import breakdowns, lengths_along, standing_of, visit_ranks
from mrmg.viz.figures import write_figure
from mrmg.viz.map_labels import map_labels
from mrmg.viz.map_shapes import end_poses, end_ring

_ARROWS_PER_MAP = 5.5
_STILL = 0.01
_CROSS = scene_drawing.marker("X", 11, style.RESERVE, "white")
_NARROW = scene_drawing.marker("D", 6, "none", style.RESERVE)
_END = scene_drawing.marker("o", 10, "none", style.INK)
_RANK: Any = {"marker": "$n$", "markersize": 8, "color": style.INK}


def draw_overview(
    scene: Scene,
    plan: Plan | None = None,
    log: ExecutionLog | None = None,
    *,
    path: Path,
) -> None:
    """Draw the mission on its map to a picture file.

    Goals carry the robot's colour and the rank of the visit in that robot's tour.

    Args:
        scene: the map.
        plan: adds planned paths, their ends and the order of visits.
        log: adds driven paths and contacts.
        path: picture to write (PNG, SVG or PDF by its suffix).

    Raises:
        IdentityError: if scene, plan and log do not belong together.
    """
    require_same_mission(scene, plan, log)
    figure, axes = scene_drawing.new_map_figure(scene)
    axes.set_title(_title(scene, plan), loc="left", fontsize=12, color=style.INK)
    draw_mission(axes, scene, plan, log)
    write_figure(figure, path)


def draw_mission(
    axes: Axes, scene: Scene, plan: Plan | None, log: ExecutionLog | None
) -> list[Patch | Line2D]:
    """Draw map, paths, visits and legend on `axes`; return the legend's handles."""
    scene_drawing.draw_ground(axes, scene)
    colors = style.scene_robot_colors(scene)
    for trajectory in plan.trajectories if plan else ():
        color = colors[trajectory.robot]
        scene_drawing.draw_path(axes, trajectory.state, color, style.PLANNED)
        _draw_arrows(axes, trajectory.state, color)
    if log is not None:
        for robot_id, state in zip(log.robots, log.state, strict=True):
            scene_drawing.draw_path(axes, state, colors[robot_id], style.DRIVEN)
        for contact in log.contacts:
            _draw_cross(axes, contact.x_m, contact.y_m)
    _draw_targets(axes, scene, plan)
    if plan is not None:
        _draw_narrow(axes, plan)
    for robot in scene.robots:
        scene_drawing.draw_footprint(axes, robot, robot.pose, colors[robot.id])
    handles = _legend(scene, plan, log)
    scene_drawing.add_legend(axes, handles)
    em_m = scene_drawing.letter_m(axes)
    _draw_ends(axes, scene, plan, log, em_m)
    labels = map_labels(scene, plan, log, em_m=em_m)
    scene_drawing.draw_labels(axes, scene, labels)
    return handles


def _draw_arrows(axes: Axes, state: np.ndarray, color: str) -> None:
    way_m = lengths_along(state)
    spacing_m = abs(axes.get_xlim()[1] - axes.get_xlim()[0]) / _ARROWS_PER_MAP
    marks_m = np.arange(spacing_m / 2, way_m[-1], spacing_m)
    for index in np.searchsorted(way_m, marks_m):
        step = state[index, :2] - state[index - 1, :2]
        length_m = float(np.hypot(*step))
        if length_m > 0.0:
            axes.annotate(
                "",
                xy=tuple(state[index, :2] + 0.01 * step / length_m),
                xytext=tuple(state[index, :2]),
                arrowprops={
                    "arrowstyle": "-|>,head_length=0.55,head_width=0.3",
                    "color": color,
                    "shrinkA": 0,
                    "shrinkB": 0,
                },
                zorder=4.6,
            )


def _draw_narrow(axes: Axes, plan: Plan) -> None:
    """Mark where robots keep less than their margins, with what they keep."""
    for one in plan.narrow:
        axes.plot(one.x_m, one.y_m, zorder=9, **_NARROW)
        axes.annotate(
            f"{one.margin_m:.2f} m",
            (one.x_m, one.y_m),
            xytext=(0.0, 9.0),
            textcoords="offset points",
            ha="center",
            fontsize=7,
            color=style.INK,
            zorder=9,
            path_effects=scene_drawing.HALO,
        )


def _draw_cross(axes: Axes, x_m: float, y_m: float) -> None:
    axes.plot(x_m, y_m, zorder=10, **_CROSS)


def _draw_targets(axes: Axes, scene: Scene, plan: Plan | None) -> None:
    ranks = visit_ranks(plan) if plan is not None else {}
    colors = style.scene_robot_colors(scene)
    visited = [(goal, *ranks[goal.id][0]) for goal in scene.goals if goal.id in ranks]
    faces = {goal.id: colors[robot] for goal, robot, _ in visited}
    scene_drawing.draw_targets(axes, scene, faces)
    for goal, _, rank in visited:
        x_m, y_m = goal.region.center
        axes.text(
            x_m,
            y_m,
            str(rank),
            fontsize=9,
            fontweight="bold",
            color="white",
            ha="center",
            va="center_baseline",
            path_effects=[withStroke(linewidth=1.6, foreground=style.INK)],
            zorder=8.5,
        )


def _draw_ends(
    axes: Axes,
    scene: Scene,
    plan: Plan | None,
    log: ExecutionLog | None,
    em_m: float,
) -> None:
    """Draw each robot where it came to rest, with a ring around it."""
    colors, broken = style.scene_robot_colors(scene), breakdowns(log)
    for robot_id, pose in end_poses(plan, log).items():
        robot = scene.robot(robot_id)
        if np.allclose(pose, robot.pose, atol=_STILL) and robot_id not in broken:
            continue
        scene_drawing.draw_footprint(axes, robot, pose, colors[robot_id])
        middle, radius_m = end_ring(robot, pose, em_m)
        ring = Circle(
            (float(middle[0]), float(middle[1])),
            radius_m,
            facecolor="none",
            edgecolor=style.RESERVE if robot_id in broken else colors[robot_id],
            linewidth=1.4,
            path_effects=[withStroke(linewidth=2.6, foreground="white")],
            zorder=6.9,
        )
        axes.add_patch(ring)
        if robot_id in broken:
            _draw_cross(axes, *middle)


def _legend(
    scene: Scene, plan: Plan | None, log: ExecutionLog | None
) -> list[Patch | Line2D]:
    colors = style.scene_robot_colors(scene)
    handles: list[Patch | Line2D] = []
    for robot in scene.robots:
        work = "" if plan is None else _work(scene, plan, log, robot)
        label = ": ".join(filter(None, [robot.id, work]))
        handles.append(Patch(facecolor=colors[robot.id], label=label))
    looks = {"planned path": (style.PLANNED, plan), "driven path": (style.DRIVEN, log)}
    handles += [
        Line2D(
            [],
            [],
            color=style.MUTED,
            label=label,
            **look.stroke(scene_drawing.LETTER_POINTS),
        )
        for label, (look, shown) in looks.items()
        if shown is not None
    ]
    marks = {
        "end of the drive": (_END, plan is not None),
        "n: nth stop of the tour": (_RANK, plan is not None),
        "contact": (_CROSS, log is not None and log.contacts),
        "broken down": (_CROSS, breakdowns(log)),
        "less than the margin kept": (_NARROW, plan is not None and plan.narrow),
    }
    handles += [
        scene_drawing.marker_handle(label, **look)
        for label, (look, shown) in marks.items()
        if shown
    ]
    return handles + scene_drawing.map_legend(scene)


def _work(scene: Scene, plan: Plan, log: ExecutionLog | None, robot: Robot) -> str:
    """Return what a robot's tour amounts to, and what became of the robot."""
    tour, standing = plan.tours.get(robot.id, ()), standing_of(robot, plan, log)
    goals = sum(target in {goal.id for goal in scene.goals} for target in tour)
    words = [counted(goals, "goal")] if tour else []
    if not tour and robot.finish and standing != "not used":
        words = ["to its finish"]
    return ", ".join([*words, *filter(None, [standing])])


def _title(scene: Scene, plan: Plan | None) -> str:
    if plan is None:
        counts = [
            (len(scene.robots), "robot"),
            (len(scene.goals), "goal"),
            (len(scene.stations), "station"),
            (len(scene.terrain), "terrain area"),
        ]
        return f"{scene.name}: {', '.join(counted(*item) for item in counts)}"
    return (
        f"{scene.name}: {counted(len(scene.goals), 'goal')}, "
        f"{energy_text(plan.cost_J, 1)}, {plan.makespan_s:.0f} s"
    )
