"""Every robot's motion and charge as one table of comma-separated values."""

from __future__ import annotations

import csv
import io

import numpy as np

from mrmg.columns import POSE_AND_SPEED
from mrmg.export.mission import Course, Mission
from mrmg.export.table import Files, Format

COLUMNS = ("robot", "time_s", *POSE_AND_SPEED, "energy_J", "charge", "target")
"""`charge` is the state of charge, 0..1; `target` is what is visited next."""

_DECIMALS = 6


def files(mission: Mission, versions: tuple[str, ...] = ()) -> Files:
    """Return the table: a row for every robot and time, robot by robot."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for course in mission.courses:
        writer.writerows(_rows(course))
    return {"mission.csv": text.getvalue().encode()}


def _rows(course: Course) -> list[tuple[object, ...]]:
    numbers = [course.time_s, *course.state[:, :4].T, course.energy_J, course.charge]
    columns = [(np.round(column, _DECIMALS) + 0.0).tolist() for column in numbers]
    robots = [course.robot] * len(course.time_s)
    return list(zip(robots, *columns, course.target.tolist(), strict=True))


FORMAT = Format(suffix=".csv", files=files)
