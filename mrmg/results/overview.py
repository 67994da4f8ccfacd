"""The overview picture: map, planned and driven paths, and the order of visits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from mrmg.execution.log import ExecutionLog, require_same_mission
from mrmg.mission import Plan
from mrmg.results import scene_drawing, style
from mrmg.scene.types import Scene

_ARROW_SPACING_M = 18.0
_SHORTEST_NAMED_M = 15.0


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
    handles = draw_mission(axes, scene, plan, log)
    scene_drawing.add_legend(axes, handles)
    axes.set_title(_title(scene, plan), loc="left", fontsize=12, color=style.INK)
    scene_drawing.write_figure(figure, path)


def draw_mission(
    axes: Axes, scene: Scene, plan: Plan | None, log: ExecutionLog | None
) -> list[Patch | Line2D]:
    """Draw map, paths and visits on `axes`; return the legend's handles."""
    scene_drawing.draw_ground(axes, scene)
    colors = style.scene_robot_colors(scene)
    if plan is not None:
        for trajectory in plan.trajectories:
            _draw_planned(axes, trajectory.state, colors[trajectory.robot])
    if log is not None:
        for robot, state in zip(log.robots, log.state, strict=True):
            _draw_driven(axes, state, colors[robot])
        _draw_contacts(axes, log)
    _draw_targets(axes, scene, plan)
    scene_drawing.draw_robots(axes, scene)
    if plan is not None:
        _draw_ends(axes, scene, plan, log)
        _name_paths(axes, scene, plan)
    return _legend(scene, plan, log)


def visit_ranks(plan: Plan) -> dict[str, list[tuple[str, int]]]:
    """Return the visits of each target as (robot, rank in its tour from 1)."""
    ranks: dict[str, list[tuple[str, int]]] = {}
    for robot, tour in plan.tours.items():
        for rank, target in enumerate(tour, start=1):
            ranks.setdefault(target, []).append((robot, rank))
    return ranks


def _draw_planned(axes: Axes, state: np.ndarray, color: str) -> None:
    axes.plot(
        state[:, 0],
        state[:, 1],
        color=color,
        linewidth=4.5,
        alpha=0.30,
        solid_capstyle="round",
        zorder=4.2,
    )
    _draw_arrows(axes, state, color)


def _name_paths(axes: Axes, scene: Scene, plan: Plan) -> None:
    """Write its robot's name on each path, for those who see no colours."""
    colors = style.scene_robot_colors(scene)
    for robot, (x_m, y_m) in name_spots(scene, plan).items():
        axes.text(
            x_m,
            y_m,
            robot,
            fontsize=9,
            fontweight="bold",
            color=colors[robot],
            ha="center",
            va="center",
            path_effects=scene_drawing.HALO,
            zorder=8.6,
        )


def name_spots(scene: Scene, plan: Plan) -> dict[str, tuple[float, float]]:
    """Return where each path has most room for its robot's name [m], by robot.

    Paths that are too short for one are left out.
    """
    names = [target.region.center for target in scene.targets()]
    names += [np.array(robot.pose[:2]) for robot in scene.robots]
    spots = {}
    for trajectory in plan.trajectories:
        if way_to(trajectory.state)[-1] > _SHORTEST_NAMED_M:
            points = trajectory.state[:, :2]
            apart_m = np.hypot(*(points[:, None] - np.array(names)).T).min(axis=0)
            x_m, y_m = points[int(np.argmax(apart_m))].tolist()
            spots[trajectory.robot] = (x_m, y_m)
    return spots


def way_to(states: np.ndarray) -> np.ndarray:
    """Return the way driven up to each state [m], shape (n,)."""
    steps_m = np.hypot(*np.diff(states[:, :2], axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps_m)])


def _draw_driven(axes: Axes, state: np.ndarray, color: str) -> None:
    axes.plot(state[:, 0], state[:, 1], color=color, linewidth=1.2, zorder=4.4)


def _draw_arrows(axes: Axes, state: np.ndarray, color: str) -> None:
    way_m = way_to(state)
    marks_m = np.arange(_ARROW_SPACING_M / 2, way_m[-1], _ARROW_SPACING_M)
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


def _draw_contacts(axes: Axes, log: ExecutionLog) -> None:
    for contact in log.contacts:
        axes.plot(
            contact.x_m,
            contact.y_m,
            marker="X",
            markersize=12,
            markerfacecolor=style.RESERVE,
            markeredgecolor="white",
            zorder=10,
        )


def _draw_targets(axes: Axes, scene: Scene, plan: Plan | None) -> None:
    ranks = visit_ranks(plan) if plan is not None else {}
    colors = style.scene_robot_colors(scene)
    goal_labels, station_labels = style.goal_labels(scene), style.station_labels(scene)
    for goal in scene.goals:
        visits = ranks.get(goal.id, [])
        face = colors[visits[0][0]] if visits else style.GOAL_OPEN
        scene_drawing.draw_goal(axes, goal, goal_labels[goal.id], color=face)
        if visits:
            _draw_rank(axes, goal.region.center, str(visits[0][1]))
    for station in scene.stations:
        visits = ranks.get(station.id, [])
        scene_drawing.draw_station(axes, station, station_labels[station.id])
        _draw_station_visits(axes, station.region.center, visits, colors)


def _draw_rank(axes: Axes, center: np.ndarray, text: str) -> None:
    axes.text(
        float(center[0]),
        float(center[1]),
        text,
        fontsize=9,
        fontweight="bold",
        color="white",
        ha="center",
        va="center_baseline",
        path_effects=[withStroke(linewidth=1.6, foreground=style.INK)],
        zorder=8.5,
    )


def _draw_station_visits(
    axes: Axes,
    center: np.ndarray,
    visits: list[tuple[str, int]],
    colors: dict[str, str],
) -> None:
    for row, (robot, rank) in enumerate(visits):
        axes.annotate(
            f"{rank}",
            (float(center[0]), float(center[1])),
            xytext=(12 + 15 * row, -10),
            textcoords="offset points",
            fontsize=8.5,
            fontweight="bold",
            color="white",
            ha="center",
            va="center",
            bbox={"boxstyle": "round,pad=0.22", "fc": colors[robot], "ec": "white"},
            zorder=8.5,
        )


def _draw_ends(axes: Axes, scene: Scene, plan: Plan, log: ExecutionLog | None) -> None:
    colors = style.scene_robot_colors(scene)
    ends = {item.robot: item.state[-1] for item in plan.trajectories}
    if log is not None:
        ends = dict(zip(log.robots, log.state[:, -1], strict=True))
    for robot, state in ends.items():
        pose = (float(state[0]), float(state[1]), float(state[2]))
        scene_drawing.draw_footprint(
            axes, scene.robot(robot), pose, facecolor=colors[robot], alpha=0.55
        )
        axes.plot(
            *pose[:2],
            marker="o",
            markersize=15,
            markerfacecolor="none",
            markeredgecolor=colors[robot],
            markeredgewidth=1.8,
            zorder=7.5,
        )


def _legend(
    scene: Scene, plan: Plan | None, log: ExecutionLog | None
) -> list[Patch | Line2D]:
    colors = style.scene_robot_colors(scene)
    handles: list[Patch | Line2D] = []
    for robot in scene.robots:
        tour = plan.tours.get(robot.id, ()) if plan is not None else ()
        goals = sum(target in {goal.id for goal in scene.goals} for target in tour)
        text = f"{robot.id}: {goals} goal{'' if goals == 1 else 's'}"
        text = robot.id if plan is None else text
        handles.append(Patch(facecolor=colors[robot.id], label=text))
    if plan is not None:
        handles += [
            Line2D(
                [],
                [],
                color=style.MUTED,
                linewidth=4.5,
                alpha=0.4,
                label="planned path",
            ),
        ]
    if log is not None:
        handles.append(
            Line2D([], [], color=style.MUTED, linewidth=1.2, label="driven path")
        )
    if plan is not None:
        handles.append(_ring("end of the drive"))
        handles.append(_ring("n: nth stop of the tour", text="$n$"))
    if log is not None and log.contacts:
        handles.append(
            Line2D(
                [],
                [],
                linestyle="none",
                marker="X",
                color=style.RESERVE,
                label="contact",
            )
        )
    return handles + scene_drawing.map_legend(scene)


def _ring(label: str, text: str = "o") -> Line2D:
    return Line2D(
        [],
        [],
        linestyle="none",
        marker=text,
        markersize=10 if text == "o" else 8,
        markerfacecolor="none" if text == "o" else style.INK,
        markeredgecolor=style.INK,
        label=label,
    )


def _title(scene: Scene, plan: Plan | None) -> str:
    if plan is None:
        return scene.name
    return (
        f"{scene.name}: {len(scene.goals)} goals, "
        f"{plan.cost_J / 1000:.1f} kJ, {plan.makespan_s:.0f} s"
    )
