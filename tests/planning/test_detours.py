"""Ways round other robots' paths."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrmg.planning import PlannerParams
from mrmg.planning.band import tightened
from mrmg.planning.detours import avoiding, cheapest_detours
from mrmg.planning.drafting import tour_path
from mrmg.planning.errand import Errand
from mrmg.planning.lanes import Lane, apart_m, lane_of, spacing_m
from mrmg.planning.motion_tree import Problem
from mrmg.planning.planner import state_mission
from mrmg.planning.refine import surfaces_of
from mrmg.planning.tracking import Drive
from mrmg.scene.types import Scene

PARAMS = PlannerParams(samples=400)


def meeting(yard: Callable[..., Scene], **changes: Any) -> tuple[Problem, list[Errand]]:
    """Return two cars that change places, with their straight paths."""
    robots = [
        {
            "id": name,
            "model": "car",
            "pose": [x, 10, yaw],
            "finish": {"circle": {"center": [30 - x, 10], "radius": 1.0}},
        }
        for name, x, yaw in (("a", 4, 0.0), ("b", 26, np.pi))
    ]
    problem = state_mission(yard(goals=[], robots=robots, **changes), 0, PARAMS)
    surfaces = surfaces_of(problem)
    errands = [Errand([r], tour_path(problem, r, [r]), surfaces[r]) for r in range(2)]
    for errand in errands:
        errand.tighten(problem, (0.8,))
    return problem, errands


STUCK = Drive(
    (),
    0,
    np.array([[13.5, 10, 0, 0, 0], [16.8, 10, np.pi, 0, 0]]),
    np.array([9.5, 9.2]),
)


def least_m(problem: Problem, errands: list[Errand]) -> float:
    """Return the least distance of two robots' discs on their way past each other."""
    lanes = [lane_of(problem, one, r, 7.0, 12.0) for r, one in enumerate(errands)]
    apart = apart_m(lanes[0].disc.reshape(-1, 2), lanes[1].disc.reshape(-1, 2))
    return float(apart.min()) - lanes[0].radius_m - lanes[1].radius_m


def test_where_there_is_room_one_robot_is_led_round_the_other(
    yard: Callable[..., Scene],
) -> None:
    problem, errands = meeting(yard)
    assert least_m(problem, errands) < 0.0
    found = cheapest_detours(problem, errands, STUCK, 0, 1, 1.0)
    assert len(found) == 1
    found[0].lead(errands[found[0].robot])
    assert least_m(problem, errands) > spacing_m(problem, 0, 1) - 0.15
    assert found[0].cost_m < 26.0  # 22 m as the crow flies


def test_where_one_alone_has_no_room_both_give_way(yard: Callable[..., Scene]) -> None:
    walls = [
        {"id": f"w{y}", "box": {"center": [15, y], "size": [14, 1]}}
        for y in (7.2, 12.8)
    ]
    problem, errands = meeting(yard, obstacles=walls)
    found = cheapest_detours(problem, errands, STUCK, 0, 1, 1.0)
    assert {one.robot for one in found} == {0, 1}
    for one in found:
        one.lead(errands[one.robot])
    assert least_m(problem, errands) > spacing_m(problem, 0, 1) - 0.2


def test_where_two_cannot_pass_there_is_no_detour(yard: Callable[..., Scene]) -> None:
    walls = [
        {"id": f"w{y}", "box": {"center": [15, y], "size": [14, 1]}}
        for y in (8.0, 12.0)
    ]
    problem, errands = meeting(yard, obstacles=walls)
    assert cheapest_detours(problem, errands, STUCK, 0, 1, 1.0) == []


def test_a_robot_that_stays_is_led_nowhere(yard: Callable[..., Scene]) -> None:
    problem, errands = meeting(yard)
    path = errands[1].path
    still = replace(path, node=path.node[:1], gear=path.gear[:0], stop=path.stop[:0])
    errands[1].path = replace(still, target=path.target[:0], deeper=path.deeper[:0])
    outcome = replace(STUCK, driven=np.array([9.5, np.inf]))
    found = cheapest_detours(problem, errands, outcome, 0, 1, 1.0)
    assert all(one.robot == 0 for one in found)


@pytest.mark.parametrize("needed_m", [1.0, 2.5])
def test_lanes_are_obstacles_as_far_away_as_is_needed(
    yard: Callable[..., Scene], needed_m: float
) -> None:
    problem, errands = meeting(yard)
    surface = errands[0].surface
    lane = Lane(np.zeros(1), np.array([[[15.0, 10.0]]]), 0.5)
    changed = avoiding(surface, lane, needed_m)
    rows, columns = np.nonzero(changed.distance < surface.room)
    x = surface.x_min + (columns + 0.5) * surface.cell
    y = surface.y_min + (rows + 0.5) * surface.cell
    inside = surface.distance[rows, columns] >= surface.room
    far = np.hypot(x - 15, y - 10)
    assert (far[inside] < needed_m).all()
    blocked = np.hypot(x - 15, y - 10) < needed_m
    assert blocked.sum() > 0.9 * np.pi * (needed_m / surface.cell) ** 2


def test_a_detour_costs_more_than_the_path_drawn_tight(
    yard: Callable[..., Scene],
) -> None:
    problem, errands = meeting(yard)
    plain = [one.cost_m for one in errands]
    for one in cheapest_detours(problem, errands, STUCK, 0, 1, 2.0):
        _, cost_m = tightened(
            problem.mission.targets, surfaces_of(problem)[one.robot], one.path, (0.8,)
        )
        assert one.cost_m > plain[one.robot]
        assert cost_m < one.cost_m
