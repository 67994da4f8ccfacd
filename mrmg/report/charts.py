"""The numbers behind the report's charts, as JSON that the page's script draws.

All series share one grid of times, so that one cursor reads them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from mrmg.energy.battery_curves import (
    BatteryCurve,
    planned_curves,
    shown_curves,
    with_recharge_jumps,
)
from mrmg.energy.metering import Motion
from mrmg.energy.text import energy_text
from mrmg.plans import Plan
from mrmg.report.chart_spec import chart, grid, line, rounded
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.verification.distances import obstacle_distance, robot_distance


def chart_data(scene: Scene, plan: Plan, log: ExecutionLog | None) -> dict[str, Any]:
    """Return everything the report's script needs.

    Returns:
        `time_s`; `robots` with their poses on the map; `visited_s`, when each goal was
        visited; and `charts` as of `chart_spec`.
    """
    time_s = grid(max(plan.makespan_s, log.time_s[-1] if log else 0.0))
    curves = shown_curves(scene, plan, log)
    poses = [_poses(curve, time_s) for curve in curves]
    return {
        "time_s": rounded(time_s, 3),
        "robots": [
            {
                "id": curve.robot,
                "x": rounded(pose[:, 0] - scene.bounds[0], 2),
                "y": rounded(scene.bounds[3] - pose[:, 1], 2),
                "turn": rounded(-np.degrees(pose[:, 2]), 1),
            }
            for curve, pose in zip(curves, poses, strict=True)
        ],
        "visited_s": {
            visit.target: round(visit.time_s, 2)
            for curve in curves
            for visit in curve.visits
            if visit.kind == "goal"
        },
        "charts": [
            *_charge_charts(scene, plan, curves if log else (), time_s),
            *_course_charts(scene, log, poses, time_s),
        ],
    }


def _poses(motion: Motion, time_s: np.ndarray) -> np.ndarray:
    """Return (x, y, theta) at the grid's times; the ends are held."""
    return np.stack(
        [np.interp(time_s, motion.time_s, motion.state[:, at]) for at in range(3)],
        axis=1,
    )


def _charge_charts(
    scene: Scene, plan: Plan, driven: Sequence[BatteryCurve], time_s: np.ndarray
) -> list[dict[str, Any]]:
    charts = []
    for at, planned in enumerate(planned_curves(scene, plan)):
        owner, curves = (at, planned.robot), (planned, *driven[at : at + 1])
        # What was driven is judged by the reserve of the battery it really had.
        reserve = np.full(len(time_s), 100.0 * curves[-1].battery.reserve_fraction)
        lines = [
            line(label, label, owner, _percent(curve, time_s), digits=2)
            for label, curve in zip(("planned", "simulated"), curves, strict=False)
        ]
        lines.append(line("reserve", "limit", owner, reserve))
        title = (
            f"{planned.robot}, battery of {energy_text(planned.battery.capacity_J, 1)}"
        )
        name = f"charge-{planned.robot}"
        charts.append(
            chart(name, title, "%", lines, group="charge", digits=1, limits=(0, 100))
        )
    return charts


def _percent(curve: BatteryCurve, time_s: np.ndarray) -> np.ndarray:
    at_s, content_J = with_recharge_jumps(curve)
    content_J = np.interp(time_s, at_s, content_J, right=np.nan)
    return np.asarray(100.0 * content_J / curve.battery.capacity_J)


def _largest(at_s: np.ndarray, values: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Return the largest value around each of the grid's times; NaN where none is."""
    middles = 0.5 * (time_s[:-1] + time_s[1:])
    largest = np.full(len(time_s), np.nan)
    np.fmax.at(largest, np.searchsorted(middles, at_s), values)
    return largest


def _course_charts(
    scene: Scene, log: ExecutionLog | None, poses: list[np.ndarray], time_s: np.ndarray
) -> list[dict[str, Any]]:
    """Return the charts that have one line for each robot."""
    courses = []
    if log is not None:
        errors_cm = [
            100.0 * _largest(log.time_s, error_m, time_s)
            for error_m in log.tracking_error_m()
        ]
        title = "Distance from the planned place"
        courses.append(("tracking", "tracking", title, "cm", errors_cm))
    to_obstacles = [*map(partial(obstacle_distance, scene), scene.robots, poses)]
    title = "To the nearest obstacle or the bounds"
    courses.append(("obstacles", "distance", title, "m", to_obstacles))
    if len(poses) > 1:
        to_robots = [*robot_distance(scene.robots, poses)]
        title = "To the nearest other robot"
        courses.append(("robots", "distance", title, "m", to_robots))
    charts = []
    for name, group, title, unit, values in courses:
        lines = [
            line(robot.id, "own", (at, robot.id), values[at])
            for at, robot in enumerate(scene.robots)
        ]
        charts.append(chart(name, title, unit, lines, group=group))
    return charts
