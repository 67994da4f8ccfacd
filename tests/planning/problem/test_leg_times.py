"""The times that the router reckons with."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mrmg.planning.parameters import PlannerParams
from mrmg.planning.preference import TIME_MARGIN_S
from mrmg.planning.problem.leg_times import TIE_SHARE
from mrmg.planning.problem.problem import state_mission
from mrmg.planning.problem.targets import LONGER_S
from mrmg.planning.routing.routing import RouterParams, solve_routing

PARAMS = PlannerParams(samples=300, route_margin=0.0)
GOALS = [
    {"id": "a", "circle": {"center": [14, 10], "radius": 1.5}},
    {"id": "b", "circle": {"center": [24, 10], "radius": 1.5}, "dwell": 7},
]


def top_speed_m_s(scene: Any) -> float:
    model = scene.robots[0].model
    return float(model.limits.scaled(model.planning_share).v_max_m_s)


def test_legs_take_their_length_at_top_speed_and_the_stay(yard: Any) -> None:
    scene = yard(goals=GOALS, objective="makespan")
    routing = state_mission(scene, 0, PARAMS).mission.routing
    top_m_s = top_speed_m_s(scene)
    assert routing.time[0, 2, 0] == pytest.approx(10.0 / top_m_s, rel=0.03)
    stay_s = 7.0 + LONGER_S
    assert routing.time[0, 0, 1] == pytest.approx(10.0 / top_m_s + stay_s, rel=0.03)
    driving_W = routing.cost[0, 2, 0] / routing.time[0, 2, 0]
    share = driving_W * routing.energy_weight / routing.makespan_weight
    assert share == pytest.approx(TIE_SHARE, rel=0.05)
    assert routing.limit[0] == np.inf


def test_time_does_not_exist_where_it_does_not_matter(yard: Any) -> None:
    routing = state_mission(yard(goals=GOALS), 0, PARAMS).mission.routing
    assert not routing.time.any()
    assert (routing.energy_weight, routing.makespan_weight) == (1.0, 0.0)


def test_the_way_to_the_finish_counts(yard: Any) -> None:
    home = {"id": "r1", "model": "car", "pose": [4, 10, 0], "finish": "start"}
    scene = yard(goals=GOALS, robots=[home], time_limit=99)
    routing = state_mission(scene, 0, PARAMS).mission.routing
    expected_s = 20.0 / top_speed_m_s(scene)
    assert routing.finish_time[0, 1] == pytest.approx(expected_s, rel=0.02)
    assert routing.limit[0] == 99.0 - TIME_MARGIN_S


def test_tours_share_the_goals_if_the_makespan_counts(yard: Any) -> None:
    goals = [
        {"id": f"g{i}", "circle": {"center": [x, y], "radius": 1}}
        for i, (x, y) in enumerate([(12, 4), (24, 4), (12, 16), (24, 16)])
    ]
    robots = [
        {"id": f"r{i}", "model": "car", "pose": [4, y, 0]} for i, y in ((1, 5), (2, 15))
    ]
    scene = yard(goals=goals, robots=robots, objective="makespan")
    routing = state_mission(scene, 0, PARAMS).mission.routing
    tours = solve_routing(routing, RouterParams(), 0).tours
    assert tours == ((0, 1), (2, 3))
