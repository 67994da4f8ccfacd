"""The numbers behind the report's charts, as JSON that the page's script draws.

All series share one grid of times, so that one cursor reads them all.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mrmg.accounting import Motion, battery_content
from mrmg.execution.log import ExecutionLog
from mrmg.mission import Plan
from mrmg.results import mission_series as series
from mrmg.results import style
from mrmg.results.audit import measured_step_energy
from mrmg.results.energy_plot import BatteryCurve, planned_curves, with_recharge_jumps
from mrmg.scene.types import Scene

_MOST_SAMPLES = 1200
_FINEST_S = 0.1


def chart_data(scene: Scene, plan: Plan, log: ExecutionLog | None) -> dict[str, Any]:
    """Return everything the page's script needs.

    Returns:
        `time_s`; `robots` with id, colours on light and dark, and poses; `charts`, each
        with a title, a unit and series. A series belongs to a robot, and its values are
        null where it has none.
    """
    time_s = _grid(plan, log)
    motions = series.shown_motions(plan, log)
    ids = [robot.id for robot in scene.robots]
    light, dark = style.robot_colors(ids), style.robot_colors_on_dark(ids)
    poses = [_poses(motion, time_s) for motion in motions]
    return {
        "time_s": _rounded(time_s, 3),
        "robots": [
            {
                "id": motion.robot,
                "light": light[motion.robot],
                "dark": dark[motion.robot],
                "x": _rounded(pose[:, 0] - scene.bounds[0], 2),
                "y": _rounded(scene.bounds[3] - pose[:, 1], 2),
                "turn": _rounded(-np.degrees(pose[:, 2]), 1),
                "speed": _rounded(pose[:, 3], 2),
            }
            for motion, pose in zip(motions, poses, strict=True)
        ],
        "visits": [
            {
                "target": visit.target,
                "robot": visit.robot,
                "kind": visit.kind,
                "time_s": round(visit.time_s, 2),
            }
            for motion in motions
            for visit in series.shown_visits(scene, plan, motion)
        ],
        "charts": [
            *_charge_charts(scene, plan, log, time_s),
            *_tracking_chart(log, time_s),
            *_distance_charts(scene, poses, time_s),
        ],
    }


def measured_curves(
    scene: Scene, plan: Plan, log: ExecutionLog
) -> tuple[BatteryCurve, ...]:
    """Return the battery content by the work at the simulated wheels."""
    curves = []
    for index, motion in enumerate(series.logged_motions(log)):
        visits = series.shown_visits(scene, plan, motion)
        draw_J = measured_step_energy(scene.robot(motion.robot), log, index)
        content_J, arrival_J = battery_content(
            scene, motion.robot, draw_J.sum(axis=1), visits
        )
        curves.append(
            BatteryCurve(
                robot=motion.robot,
                time_s=log.time_s,
                energy_J=content_J,
                visits=tuple(
                    replace(visit, energy_J=energy_J)
                    for visit, energy_J in zip(visits, arrival_J, strict=True)
                ),
            )
        )
    return tuple(curves)


def _grid(plan: Plan, log: ExecutionLog | None) -> np.ndarray:
    end_s = plan.makespan_s
    if log is not None:
        end_s = max(end_s, float(log.time_s[-1]))
    samples = min(int(np.ceil(end_s / _FINEST_S)) + 1, _MOST_SAMPLES)
    return np.linspace(0.0, end_s, max(samples, 2))


def _poses(motion: Motion, time_s: np.ndarray) -> np.ndarray:
    """Return (x, y, theta, v) at the grid's times; the ends are held."""
    return np.stack(
        [np.interp(time_s, motion.time_s, motion.state[:, at]) for at in range(4)],
        axis=1,
    )


def _charge_charts(
    scene: Scene, plan: Plan, log: ExecutionLog | None, time_s: np.ndarray
) -> list[dict[str, Any]]:
    driven = (
        {item.robot: item for item in measured_curves(scene, plan, log)} if log else {}
    )
    charts = []
    for planned in planned_curves(scene, plan):
        battery = scene.robot(planned.robot).battery
        reserve = np.full(len(time_s), 100.0 * battery.reserve_fraction)
        lines = [_charge("planned", planned, battery.capacity_J, time_s)]
        if planned.robot in driven:
            measured = driven[planned.robot]
            lines.append(_charge("simulated", measured, battery.capacity_J, time_s))
        lines.append(_line("reserve", "limit", planned.robot, reserve, 2))
        charts.append(
            {
                "id": f"charge-{planned.robot}",
                "group": "charge",
                "title": f"{planned.robot}, battery of "
                f"{battery.capacity_J / 1000:.1f} kJ",
                "unit": "%",
                "range": [0, 105],
                "digits": 1,
                "series": lines,
            }
        )
    return charts


def _charge(
    label: str, curve: BatteryCurve, capacity_J: float, time_s: np.ndarray
) -> dict[str, Any]:
    at_s, content_J = with_recharge_jumps(curve)
    percent = 100.0 * np.interp(time_s, at_s, content_J, right=np.nan) / capacity_J
    return _line(label, label, curve.robot, percent, 2)


def _tracking_chart(
    log: ExecutionLog | None, time_s: np.ndarray
) -> list[dict[str, Any]]:
    if log is None:
        return []
    return [
        {
            "id": "tracking",
            "group": "tracking",
            "title": "Distance from the planned place",
            "unit": "cm",
            "digits": 2,
            "series": [
                _line(
                    robot,
                    "robot",
                    robot,
                    100.0 * _largest(log.time_s, error_m, time_s),
                    3,
                )
                for robot, error_m in zip(
                    log.robots, series.tracking_error(log), strict=True
                )
            ],
        }
    ]


def _largest(at_s: np.ndarray, values: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Return the largest value around each of the grid's times; NaN after the last."""
    middles = 0.5 * (time_s[:-1] + time_s[1:])
    bins = np.searchsorted(middles, at_s)
    largest = np.full(len(time_s), np.nan)
    np.fmax.at(largest, bins, values)
    return largest


def _distance_charts(
    scene: Scene, poses: list[np.ndarray], time_s: np.ndarray
) -> list[dict[str, Any]]:
    ids = [robot.id for robot in scene.robots]
    to_obstacles = [
        series.obstacle_distance(scene, robot, pose)
        for robot, pose in zip(scene.robots, poses, strict=True)
    ]
    charts = [
        {
            "id": "obstacles",
            "group": "distance",
            "title": "To the nearest obstacle or the bounds",
            "unit": "m",
            "digits": 2,
            "series": [
                _line(name, "robot", name, distance, 3)
                for name, distance in zip(ids, to_obstacles, strict=True)
            ],
        }
    ]
    if len(ids) > 1:
        apart = series.robot_distance(scene.robots, poses)
        charts.append(
            {
                "id": "robots",
                "group": "distance",
                "title": "To the nearest other robot",
                "unit": "m",
                "digits": 2,
                "series": [
                    _line(name, "robot", name, distance, 3)
                    for name, distance in zip(ids, apart, strict=True)
                ],
            }
        )
    return charts


def _line(
    label: str, kind: str, robot: str, values: np.ndarray, digits: int
) -> dict[str, Any]:
    return {
        "label": label,
        "kind": kind,
        "robot": robot,
        "values": _rounded(values, digits),
    }


def _rounded(values: np.ndarray, digits: int) -> list[float | None]:
    return [
        None if missing else value
        for missing, value in zip(
            np.isnan(values).tolist(), np.round(values, digits).tolist(), strict=True
        )
    ]
