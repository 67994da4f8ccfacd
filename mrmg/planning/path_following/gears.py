"""Which way round a car drives: where on its tour it changes gear.

Turning towards the next target takes a detour and scrub, changing gear only some scrub.
Which of the two is cheaper at a target is seen when the path is smoothed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import radians

import numpy as np

from mrmg.planning.path_following._band_kernels import CostMap
from mrmg.planning.path_following.band import SPACINGS_M, Path, smooth_path
from mrmg.planning.problem.problem import Problem

DOUBTFUL = (radians(60.0), radians(165.0))
"""Turns at targets between which either may be cheaper [rad]."""

WORTH_M_S = 0.01
"""Plain ground that a second is worth where paths cost about the same [m/s]: cars are
slower backwards."""


def with_best_gears(
    problem: Problem,
    r: int,
    cost_map: CostMap,
    path: Path,
    turns: Sequence[tuple[int, float]],
) -> Path:
    """Return robot r's path with the gears that look cheapest.

    Each turn that leaves it open is tried with a change of gear and without; they
    hardly depend on each other.

    Args:
        problem: the mission.
        r: robot, a car.
        cost_map: what the path is priced on.
        path: the path.
        turns: nodes at which it may change gear, and how much it turns there [rad].
    """
    least_m = smoothed_cost_m(problem, r, cost_map, path)
    for at, turn in turns:
        if not DOUBTFUL[0] < turn < DOUBTFUL[1]:
            continue
        other = other_gear_from(path, at)
        cost_m = smoothed_cost_m(problem, r, cost_map, other)
        if cost_m < least_m:
            path, least_m = other, cost_m
    return path


def other_gear_from(path: Path, at: int) -> Path:
    """Return a path that is driven in the other gear from a node on."""
    number = np.arange(len(path.gear))
    return replace(path, gear=np.where(number < at, path.gear, -path.gear))


def smoothed_cost_m(problem: Problem, r: int, cost_map: CostMap, path: Path) -> float:
    """Return the cost of a path smoothed with few nodes, its time included."""
    path, cost_m = smooth_path(problem.mission.targets, cost_map, path, SPACINGS_M[:1])
    size = np.hypot(*np.diff(path.node, axis=0).T)
    backwards, forwards = np.maximum(
        np.abs(problem.mission.fleet[r]["limit"][:2]), 1e-3
    )
    time_s = size / np.where(path.gear > 0, forwards, backwards)
    return cost_m + WORTH_M_S * float(time_s.sum())
