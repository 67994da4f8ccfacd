"""Which way round a robot drives: where on its tour it changes gear.

Turning towards the next target takes a car a detour and scrub, changing gear only some
scrub. Which of the two is cheaper at a target is seen when the path is smoothed. To a
robot that turns on the spot gears are worth what they spare it of turning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import pi, radians, remainder, tau
from operator import itemgetter

import numpy as np

from mrmg.planning.path_following._band_kernels import CostMap
from mrmg.planning.path_following.band import (
    SPACINGS_M,
    Path,
    directions_of,
    smooth_path,
)
from mrmg.planning.path_following.cost_map import radian_m
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.time_weighting import energy_share

DOUBTFUL = (radians(60.0), radians(165.0))
"""Turns at targets between which either may be cheaper [rad]."""

PIVOT = radians(60.0)
"""Turn from which on a robot that can turns on the spot [rad]."""

WORTH_M_S = 0.01
"""Plain ground that a second is worth where paths cost about the same [m/s]: robots
are slower backwards."""


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


def with_least_turning(problem: Problem, r: int, path: Path) -> Path:
    """Return the path of a robot that turns on the spot with the best gear of each leg.

    What it has to turn before, between and after the legs is priced, and the time that
    they take backwards; the least sum is found by dynamic programming.

    Args:
        problem: the mission.
        r: robot.
        path: the path; the robot turns on the spot at its stops where it turns sharply.
    """
    nodes, before, ahead = zip(*directions_of(path), strict=True)
    backwards, forwards = np.abs(problem.mission.fleet[r]["limit"][:2])
    share = energy_share(problem.preference.driving, problem.scene.robots[r])
    share = 0.0 if problem.minimum_time else share
    worth_m_s = WORTH_M_S + forwards * (1.0 - share)
    price = {1: 0.0}
    if backwards > 0.0:
        price[-1] = worth_m_s * (1.0 / backwards - 1.0 / forwards)
    wanted = problem.mission.targets.target[path.target]
    fixed = wanted["tolerance"] < pi
    aims = [wanted["heading"][fixed & (path.stop == node)] for node in nodes]
    turn_m = radian_m(problem, r)

    def turned(i: int, last: int, *gear: int) -> float:
        """Return how much it turns at a stop, from a gear to the next one [rad]."""
        leaving = [_nose(ahead[i], one) for one in gear]
        return _turning([_nose(before[i], last), *aims[i], *leaving])

    best = [(0.0, [1])]  # by its gear: what it takes at least, and the gears until then
    for i, way_m in enumerate(np.diff(path.way[list(nodes)])):
        ways = [
            (cost_m + turn_m * turned(i, gears[-1], gear) + own * way_m, [*gears, gear])
            for cost_m, gears in best
            for gear, own in price.items()
        ]
        best = [
            min((one for one in ways if one[1][-1] == gear), key=itemgetter(0))
            for gear in price
        ]
    _, gears = min(
        ((cost_m + turn_m * turned(-1, own[-1]), own) for cost_m, own in best),
        key=itemgetter(0),
    )
    turns = [
        _turning([_nose(before[i], own), _nose(ahead[i], other)])
        for i, (own, other) in enumerate(pairwise(gears))
    ]
    return replace(
        path,
        gear=np.repeat(np.array(gears[1:], np.int64), np.diff(nodes)),
        pivot=np.array(nodes[:-1], np.int64)[np.array(turns) > PIVOT],
    )


def _turning(headings: Sequence[float]) -> float:
    """Return how much a robot turns through headings, one after the other [rad]."""
    return sum(abs(remainder(b - a, tau)) for a, b in pairwise(headings))


def _nose(direction: float, gear: int) -> float:
    """Return the heading of a robot that drives in a direction in a gear [rad]."""
    return direction if gear > 0 else direction + pi


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
