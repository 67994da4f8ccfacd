"""What exporters write down: the scene, and where each robot was, when, how charged."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path

import numpy as np
import shapely

from mrmg.energy.battery_curves import BatteryCurve, shown_curves
from mrmg.errors import Fault, RunFolderError
from mrmg.plans import Plan
from mrmg.runs.record import read_record
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz.activities import CHARGING, Activity, activities, breakdowns, stops_behind

PATH_PERIOD_S = 0.1
PATH_TOLERANCE_M = 0.01
"""How far lines between points of a path, so far apart in time, may be from it."""


@dataclass(frozen=True, kw_only=True)
class Course(BatteryCurve):
    """The motion of one robot: driven, or planned where nothing was driven.

    Attributes:
        tour: ids of its targets, in the order of its visits.
        activities: what it does, span by span.
        broken_s: when it broke down; None if it did not.
    """

    tour: tuple[str, ...]
    activities: tuple[Activity, ...]
    broken_s: float | None

    @cached_property
    def charge(self) -> np.ndarray:
        """State of charge, 0..1, shape (n,)."""
        return np.clip(self.energy_J / self.battery.capacity_J, 0.0, 1.0)

    @cached_property
    def charging(self) -> np.ndarray:
        """Whether it is at a station of its tour, shape (n,)."""
        there = np.zeros(len(self.time_s), dtype=bool)
        for span in self.activities:
            if span.kind == CHARGING:
                there |= (self.time_s >= span.start_s) & (self.time_s < span.end_s)
        return there

    @cached_property
    def turning_rad_s(self) -> np.ndarray:
        """Yaw rate, shape (n,)."""
        if len(self.time_s) < 2:
            return np.zeros(len(self.time_s))
        return np.gradient(np.unwrap(self.state[:, 2]), self.time_s)

    @cached_property
    def target(self) -> np.ndarray:
        """The id of the next target of its tour; "" after the last, shape (n,)."""
        steps = np.arange(len(self.time_s))
        stops = stops_behind(self.tour, self.visits, steps)
        return np.array([*self.tour, ""]).take(stops)


@dataclass(frozen=True, kw_only=True)
class Mission:
    """A planned or driven mission.

    Attributes:
        scene: what was to be done.
        plan: the plan in force.
        log: of its drive; None where nothing was driven.
        courses: of all robots, in the scene's order, at equal times.
    """

    scene: Scene
    plan: Plan
    log: ExecutionLog | None
    courses: tuple[Course, ...]

    @property
    def motion(self) -> str:
        """Whether the courses were "driven" or "planned"."""
        return "planned" if self.log is None else "driven"

    @property
    def time_s(self) -> np.ndarray:
        """Times of the states of all courses, shape (n,)."""
        return self.courses[0].time_s


def every(time_s: np.ndarray, period_s: float) -> np.ndarray:
    """Return indices of times at most `period_s` apart, the first and last included.

    Where times are further apart than that, all are returned.
    """
    marks_s = np.arange(0.0, time_s[-1], period_s)
    last_before = np.searchsorted(time_s, marks_s + 1e-9, "right") - 1
    return np.unique([*last_before, len(time_s) - 1])


def bends(points: np.ndarray, tolerance_m: float) -> np.ndarray:
    """Return indices of the points between which a path is straight within a tolerance.

    The first and last point are among them (Douglas and Peucker 1973).

    Args:
        points: of the path [m], shape (n, 2).
        tolerance_m: how far the path may be from the straight lines.
    """
    if len(points) < 2:
        return np.arange(len(points))
    numbered = np.column_stack([points, np.arange(len(points))])
    line = shapely.simplify(shapely.linestrings(numbered), tolerance_m)
    return np.asarray(shapely.get_coordinates(line, include_z=True)[:, 2], dtype=int)


def path_indices(time_s: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Return indices of the states between which a path is drawn as straight lines.

    Args:
        time_s: of the states, shape (n,).
        state: x, y and what else there is, shape (n, 2 or more).
    """
    at = every(time_s, PATH_PERIOD_S)
    return np.asarray(at[bends(state[at, :2], PATH_TOLERANCE_M)])


def read_mission(run_folder: Path, *, trust_code: bool = False) -> Mission:
    """Read the mission of a run folder.

    Args:
        run_folder: the run; at least planned.
        trust_code: whether robot models may bring Python code (`loading.trust`).

    Raises:
        RunFolderError: if there is no plan, or a file cannot be read.
    """
    record = read_record(run_folder, trust_code=trust_code)
    scene, plan, log = record.scene, record.plan, record.log
    if plan is None:
        reason = f"there is no plan to export ({record.planning['reason']})"
        raise RunFolderError(str(run_folder), [Fault("planning.json", reason)])
    broken_s = breakdowns(log)
    courses = [
        Course(
            **{item.name: getattr(curve, item.name) for item in fields(BatteryCurve)},
            tour=plan.tours.get(curve.robot, ()),
            activities=activities(
                scene, curve, curve.visits, broken_s.get(curve.robot)
            ),
            broken_s=broken_s.get(curve.robot),
        )
        for curve in shown_curves(scene, plan, log)
    ]
    return Mission(scene=scene, plan=plan, log=log, courses=tuple(courses))
