"""Paths that lead a robot's search: its own, or ways down its costs-to-go, rounded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrmg.planning.path_following._following_kernels import Course
from mrmg.planning.path_following.band import Path
from mrmg.planning.path_following.coordination.tasks import no_path
from mrmg.planning.path_following.tracking import Drive, course_of
from mrmg.planning.problem.problem import Problem

ROUNDINGS = 2
"""Times that a way is averaged over a robot's length, which rounds its corners."""

SPACING_SHARE = 0.25
"""Distance of the nodes, in radii of the robot."""


def courses(
    problem: Problem, paths: Sequence[Path], drives: Sequence[Drive | None]
) -> list[Course]:
    """Return what leads each robot: its path, with what is left of a drive along it."""
    found = [course_of(problem, r, path) for r, path in enumerate(paths)]
    for course, drive in zip(found, drives, strict=True):
        if drive is not None and len(drive.spent_s) > 0:
            rest_s = drive.spent_s[-1] - drive.spent_s
            course.node["rest_s"][: len(rest_s)] = rest_s
    return found


def rounded_path(problem: Problem, r: int, way: np.ndarray) -> Path:
    """Return a path along a chain of points, shape (n, 2), with rounded corners."""
    reach_m = float(problem.mission.fleet[r]["radius"])
    way = way[np.append(True, np.hypot(*np.diff(way, axis=0).T) > 0.0)]
    if len(way) < 2:
        return no_path(problem, r)
    node = _rounded(way, reach_m)
    return replace(
        no_path(problem, r), node=node, gear=np.ones(len(node) - 1, np.int64)
    )


def _rounded(way: np.ndarray, reach_m: float) -> np.ndarray:
    """Return points along a stretch, each the mean of what is within the reach.

    Its ends stay: near them it is the mean of less.
    """
    for _ in range(ROUNDINGS):
        along = np.append(0.0, np.cumsum(np.hypot(*np.diff(way, axis=0).T)))
        at = np.linspace(0.0, along[-1], int(along[-1] / (SPACING_SHARE * reach_m)) + 3)
        points = np.stack([np.interp(at, along, one) for one in way.T], axis=1)
        sides = 0.5 * (points[1:] + points[:-1]) * at[1]
        whole = np.vstack([np.zeros(2), np.cumsum(sides, axis=0)])
        near = np.minimum(reach_m, np.minimum(at, at[-1] - at))[1:-1]
        inner = [
            np.interp(at[1:-1] + near, at, one) - np.interp(at[1:-1] - near, at, one)
            for one in whole.T
        ]
        points[1:-1] = np.stack(inner, axis=1) / (2.0 * near[:, None])
        way = points
    return way
