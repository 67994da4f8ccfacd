"""Ways round other robots' paths."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrmg.planning import PlannerParams
from mrmg.planning.drafting.band import SPARE_M, tightened
from mrmg.planning.drafting.detours import (
    LACK_M,
    Detour,
    avoiding,
    passing_detours,
    room_made,
)
from mrmg.planning.drafting.drafting import tour_path
from mrmg.planning.drafting.errand import Errand
from mrmg.planning.drafting.lanes import Lane, apart_m, lane_of, spacing_m
from mrmg.planning.drafting.refine import surfaces_of
from mrmg.planning.drafting.tracking import Drive
from mrmg.planning.problem.problem import Problem, state_mission
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


def follow(errands: list[Errand], way: list[Detour]) -> list[Errand]:
    """Return the errands with detours in them."""
    led = list(errands)
    for one in way:
        led[one.robot] = one.lead(led[one.robot])
    return led


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
    ways = passing_detours(problem, errands, STUCK, 0, 1, 1.0)
    assert min(len(way) for way in ways) == 1
    for way in ways:
        led = follow(errands, way)
        assert least_m(problem, led) > spacing_m(problem, 0, 1) - SPARE_M - LACK_M
        assert all(one.cost_m < 26.0 for one in way)  # 22 m as the crow flies
    assert least_m(problem, follow(errands, ways[0])) > spacing_m(problem, 0, 1) - 0.1


def test_where_one_alone_has_no_room_both_give_way(yard: Callable[..., Scene]) -> None:
    walls = [
        {"id": f"w{y}", "box": {"center": [15, y], "size": [14, 1]}}
        for y in (7.2, 12.8)
    ]
    problem, errands = meeting(yard, obstacles=walls)
    ways = passing_detours(problem, errands, STUCK, 0, 1, 1.0)
    assert {one.robot for one in ways[0]} == {0, 1}
    assert least_m(problem, follow(errands, ways[0])) > spacing_m(problem, 0, 1) - 0.1


def test_where_two_cannot_pass_there_is_no_detour(yard: Callable[..., Scene]) -> None:
    walls = [
        {"id": f"w{y}", "box": {"center": [15, y], "size": [14, 1]}}
        for y in (8.0, 12.0)
    ]
    problem, errands = meeting(yard, obstacles=walls)
    assert passing_detours(problem, errands, STUCK, 0, 1, 1.0) == []


def test_a_robot_that_stays_is_led_nowhere(yard: Callable[..., Scene]) -> None:
    problem, errands = meeting(yard)
    path = errands[1].path
    still = replace(
        path, node=np.array([[16.8, 10.0]]), gear=path.gear[:0], stop=path.stop[:0]
    )
    errands[1].path = replace(still, target=path.target[:0], deeper=path.deeper[:0])
    outcome = replace(STUCK, driven=np.array([9.5, np.inf]))
    ways = passing_detours(problem, errands, outcome, 0, 1, 1.0)
    assert ways
    assert {one.robot for way in ways for one in way} == {0}


def test_a_robot_without_targets_makes_room(yard: Callable[..., Scene]) -> None:
    robots = [
        {
            "id": "a",
            "model": "car",
            "pose": [4, 10, 0],
            "finish": {"circle": {"center": [26, 10], "radius": 1.0}},
        },
        {"id": "b", "model": "car", "pose": [15, 10, np.pi / 2]},
    ]
    problem = state_mission(yard(goals=[], robots=robots), 0, PARAMS)
    surfaces = surfaces_of(problem)
    errands = [
        Errand(tour, tour_path(problem, r, tour), surfaces[r])
        for r, tour in enumerate(([0], []))
    ]
    errands[0].tighten(problem, (0.8,))
    state = np.array([[12, 10, 0, 0, 0], [15, 10, np.pi / 2, 0, 0]])
    outcome = Drive((), 0, state, np.array([8.0, np.inf]))
    (way,) = room_made(problem, errands, outcome, 1, 0)
    path = way[0].path
    assert way[0].robot == 1
    assert path.node[0] == pytest.approx([15, 10])
    assert path.node[:, 0] == pytest.approx(np.full(len(path.node), 15.0))
    moved = follow(errands, way)
    end_m = float(path.way[-1])
    lanes = [
        lane_of(problem, moved[0], 0, 0, 22),
        lane_of(problem, moved[1], 1, end_m, end_m),
    ]
    apart = apart_m(lanes[0].disc.reshape(-1, 2), lanes[1].disc.reshape(-1, 2)).min()
    assert apart > sum(lane.radius_m for lane in lanes) + spacing_m(problem, 0, 1)
    assert end_m <= 6.0
    moved[1].tighten(problem, (0.8,))
    assert moved[1].path is path  # nothing draws it back


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
    ways = passing_detours(problem, errands, STUCK, 0, 1, 2.0)
    for one in (one for way in ways for one in way):
        _, cost_m = tightened(
            problem.mission.targets, surfaces_of(problem)[one.robot], one.path, (0.8,)
        )
        assert one.cost_m > plain[one.robot]
        assert cost_m < one.cost_m
    costs_m = [sum(one.cost_m - plain[one.robot] for one in way) for way in ways]
    lacks_m = [max(one.lack_m for one in way) for way in ways]
    for k in range(len(ways) - 1):  # what is dearer lacks less, if anything
        assert costs_m[k] <= costs_m[k + 1] or lacks_m[k] < lacks_m[k + 1]


def test_a_robot_that_ends_where_it_begins_makes_no_detour(
    yard: Callable[..., Scene],
) -> None:
    """Also where one alone has little room, and if it is not known to have ended."""
    walls = [
        {"id": f"w{y}", "box": {"center": [15, y], "size": [14, 1]}}
        for y in (7.2, 12.8)
    ]
    problem, errands = meeting(yard, obstacles=walls)
    path = errands[1].path
    one_node = replace(path, node=np.array([[16.8, 10.0]]), gear=path.gear[:0])
    errands[1].path = replace(one_node, stop=np.zeros(1, np.int64))
    for way in passing_detours(problem, errands, STUCK, 0, 1, 0.6):
        for one in way:
            assert one.robot == 0 or len(one.path.node) == 1
