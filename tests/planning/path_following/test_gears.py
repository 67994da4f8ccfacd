"""Gears of paths: the cheaper way round at every turn that leaves it open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from math import cos, radians, sin

import numpy as np
import pytest

from mrmg.planning import PlannerParams
from mrmg.planning.path_following.band import SPACINGS_M, Path, smooth_path
from mrmg.planning.path_following.cost_map import cost_maps_of
from mrmg.planning.path_following.following import tour_path
from mrmg.planning.path_following.gears import WORTH_M_S, with_best_gears
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.scene.types import Scene

PARAMS = PlannerParams(samples=300)
CORNER = np.array([18.0, 10.0])


def mission(yard: Callable[..., Scene], degrees: float) -> tuple[Problem, Path]:
    """A robot drives east to a goal; the next one is that many degrees to its left."""
    turn = radians(degrees)
    ahead = CORNER + 9.0 * np.array([cos(turn), sin(turn)])
    goals = [
        {"id": "g1", "circle": {"center": CORNER.tolist(), "radius": 1.0}},
        {"id": "g2", "circle": {"center": ahead.round(3).tolist(), "radius": 1.0}},
    ]
    problem = state_mission(yard(goals=goals), 0, PARAMS)
    return problem, tour_path(problem, 0, [0, 1])


def geared(problem: Problem, path: Path, turns: Sequence[tuple[int, float]]) -> Path:
    return with_best_gears(problem, 0, cost_maps_of(problem)[0], path, turns)


def cost_m(problem: Problem, path: Path) -> float:
    cost_map = cost_maps_of(problem)[0]
    path, cost = smooth_path(problem.mission.targets, cost_map, path, SPACINGS_M[:1])
    limit = problem.scene.robots[0].model.limits
    size = np.hypot(*np.diff(path.node, axis=0).T)
    speed = np.where(path.gear > 0, limit.v_max_m_s, -limit.v_min_m_s)
    return cost + WORTH_M_S * float((size / speed).sum())


@pytest.mark.parametrize("degrees", [70.0, 90.0, 110.0, 135.0])
def test_no_other_gears_at_the_turn_are_cheaper(
    yard: Callable[..., Scene], degrees: float
) -> None:
    problem, path = mission(yard, degrees)
    at = int(path.stop[0])
    found = geared(problem, path, [(at, radians(degrees))])
    gears = set()
    for first, second in product((1, -1), repeat=2):
        gear = np.where(np.arange(len(path.gear)) < at, first, second)
        other = replace(path, gear=gear)
        gears.add(tuple(gear))
        if first == 1:
            assert cost_m(problem, found) <= cost_m(problem, other) + 1e-9
    assert tuple(found.gear) in gears


def test_gentle_turns_are_left_alone(yard: Callable[..., Scene]) -> None:
    problem, path = mission(yard, 40.0)
    back = replace(path, gear=-path.gear)
    assert geared(problem, back, [(int(path.stop[0]), radians(40.0))]) is back


def test_of_gears_that_cost_the_same_the_faster_ones_count(
    yard: Callable[..., Scene],
) -> None:
    """To drive straight on is as cheap forwards as after a change of gear and back."""
    problem, path = mission(yard, 0.0)
    doubtful = radians(90.0)
    halves = np.where(np.arange(len(path.gear)) < path.stop[0], 1, -1)
    found = geared(problem, replace(path, gear=halves), [(int(path.stop[0]), doubtful)])
    assert set(found.gear) == {1}
