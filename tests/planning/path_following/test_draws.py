"""Draws of tours: what batteries are taken to allow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mrmg
from mrmg.planning import PlannerParams
from mrmg.planning.attempt import Request
from mrmg.planning.path_following import draws
from mrmg.planning.path_following.draws import Draw, drawn_tours
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.planning.routers import find_router
from mrmg.planning.routing.routing import Routing

PARAMS = PlannerParams(samples=600)
PLAIN = [Draw(number, 0.0, 0.0) for number in range(4)]


def request() -> Request:
    return Request(params=PARAMS, router=find_router(PARAMS.router), seed=0)


def test_tours_that_recharge_are_drawn_for_what_smoothed_paths_take(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = state_mission(mrmg.load_scene("scene1"), 0, PARAMS).with_soc_margin(0.1)
    seen: list[tuple[float, Routing]] = []
    drawn = draws._drawn

    def spy(problem: Problem, request: Request, draw: Draw) -> Routing:
        tours = drawn(problem, request, replace(draw, spread=0.0))
        seen.append((draw.surcharge, tours))
        return tours

    monkeypatch.setattr(draws, "_drawn", spy)
    found, calls = drawn_tours(problem, request(), PLAIN)
    further = draws.recharge_draws(problem.mission.targets.goals)
    assert 0 < further <= draws.RECHARGE_DRAWS
    assert calls == len(seen) == len(PLAIN) + further
    assert {tours.tours for tours in found} == {tours.tours for _, tours in seen}
    assert {surcharge for surcharge, _ in seen[: len(PLAIN)]} == {0.0}
    for surcharge, tours in seen[len(PLAIN) :]:
        assert surcharge == seen[-1][0] < 0.0
        smooth_J = draws.path_cost_J(problem, tours)
        assert tours.cost_J == pytest.approx(smooth_J, rel=0.04)


def test_where_nobody_recharges_nothing_is_measured() -> None:
    scene = mrmg.load_scene("scene1")
    ample = [
        replace(r, battery=replace(r.battery, capacity_J=1e9, start_J=1e9))
        for r in scene.robots
    ]
    problem = state_mission(replace(scene, robots=tuple(ample)), 0, PARAMS)
    found, calls = drawn_tours(problem, request(), PLAIN)
    assert calls == len(PLAIN)
    assert len({tours.tours for tours in found}) == len(found)
    costs_J = [draws.path_cost_J(problem, tours) for tours in found]
    assert costs_J == sorted(costs_J)


def test_one_draw_is_followed_as_it_is() -> None:
    problem = state_mission(mrmg.load_scene("scene1"), 0, PARAMS)
    found, calls = drawn_tours(problem, request(), PLAIN[:1])
    assert calls == len(found) == 1
    assert np.isfinite(found[0].cost_J)


def test_there_are_fewer_further_draws_the_more_goals_there_are() -> None:
    counts = [draws.recharge_draws(goals) for goals in range(400)]
    assert counts == sorted(counts, reverse=True)
    assert counts[16] == draws.RECHARGE_DRAWS
    assert counts[-1] == 0
