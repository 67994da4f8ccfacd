"""Visits that are only counted, against exact tours of missions small enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import mrmg
from mrmg.planning.bound import bound, counted_visits
from mrmg.planning.bound.bound import lower_bound_J, relaxed_routing_J
from mrmg.planning.bound.completions import completions
from mrmg.planning.bound.counted_visits import MOST_WORK, most_remembered
from mrmg.planning.bound.exact_tours import exact_routing
from mrmg.planning.bound.relaxation import Relaxation
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.scene.loading import scene_from_document

Mission = Callable[..., RoutingArrays]


@pytest.mark.parametrize("remembered", [0, 3, 6])
def test_walks_cost_no_more_than_tours(
    mission: Mission, remembered: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(counted_visits, "most_remembered", lambda goals: remembered)
    for seed in range(8):
        problem = mission(seed, goals=6, stations=2, robots=2, range_m=(60.0, 160.0))
        exact = exact_routing(problem)
        assert exact is not None
        visits = counted_visits.counted_visits(problem)
        assert sorted(visits.order) == list(range(6))
        least_J = completions(problem, None, visits).before[0]
        assert least_J - visits.surcharge <= exact.cost_J * (1.0 + 1e-9)


def test_prices_raise_what_walks_cost(
    mission: Mission, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(counted_visits, "most_remembered", lambda goals: 0)
    for seed in range(4):
        problem = mission(seed, goals=9, stations=1, robots=2, range_m=(1e6, 2e6))
        visits = counted_visits.counted_visits(problem)
        free = replace(visits, price=np.zeros_like(visits.price))
        priced_J, free_J = (
            float(completions(problem, None, each).before[0]) - each.surcharge
            for each in (visits, free)
        )
        exact = exact_routing(problem)
        assert exact is not None
        assert free_J < priced_J <= exact.cost_J * (1.0 + 1e-9)
        assert priced_J >= 0.7 * exact.cost_J


def test_prices_rise_where_a_robot_starts_in_a_goal(
    mission: Mission, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without prices, walks visit that goal over and over, for nothing."""
    monkeypatch.setattr(counted_visits, "most_remembered", lambda goals: 0)
    problem = mission(0, goals=9, stations=1, robots=2, range_m=(1e6, 2e6))
    problem.cost[0, -1, 4] = 0.0
    exact = exact_routing(problem)
    assert exact is not None
    visits = counted_visits.counted_visits(problem)
    priced_J = completions(problem, None, visits).before[0] - visits.surcharge
    assert 0.7 * exact.cost_J <= priced_J <= exact.cost_J * (1.0 + 1e-9)


def test_as_many_goals_are_remembered_as_the_work_allows() -> None:
    kept = [most_remembered(goals) for goals in range(1, 100)]
    assert kept[9] == 10
    assert kept[20:] == sorted(kept[20:], reverse=True)
    for goals, remembered in enumerate(kept, start=1):
        states = (goals - remembered + 1) << remembered
        work = states * (goals - 0.5 * remembered) ** 3
        assert work <= MOST_WORK or remembered == 0


def test_counted_visits_bound_a_mission_between_trees_and_all_tours(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = mrmg.load_scene("scene2")
    exact_J = lower_bound_J(scene)
    tree_J = relaxed_routing_J(Relaxation.of(scene).problem)
    monkeypatch.setattr(bound, "are_few", lambda goals, robots: False)
    monkeypatch.setattr(counted_visits, "most_remembered", lambda goals: goals // 2)
    counted_J = lower_bound_J(scene)
    assert tree_J < counted_J <= exact_J * (1.0 + 5e-3)
    assert counted_J >= 0.95 * exact_J
    monkeypatch.setattr(bound, "MOST_TARGETS", 0)
    assert lower_bound_J(scene) == pytest.approx(tree_J, rel=1e-3)


def test_robots_roll_down_from_high_ground_only_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Walks that may set out again and again pay for that, or they cost nothing."""
    places = np.random.default_rng(1).uniform((12.0, 4.0), (56.0, 36.0), (8, 2))
    goals = [
        {"id": f"g{k}", "circle": {"center": place, "radius": 1.0}}
        for k, place in enumerate(places.tolist())
    ]
    robots = [{"id": f"r{y}", "model": "car", "pose": [8, y, 0]} for y in (16, 20, 24)]
    hill = {"center": [10, 20], "height": 1.5, "radius": 18}
    scene = scene_from_document(
        {
            "format": 1,
            "name": "hill",
            "bounds": [0, 0, 60, 40],
            "battery": {"capacity_m": 4000},
            "elevation": {"hills": [hill]},
            "goals": goals,
            "robots": robots,
        },
        source="hill",
    )
    exact_J = lower_bound_J(scene)
    monkeypatch.setattr(bound, "are_few", lambda goals, robots: False)
    assert lower_bound_J(scene) == pytest.approx(exact_J, rel=1e-3)
