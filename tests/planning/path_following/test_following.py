"""Plans driven straight along tours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.energy.metering import battery_profile
from mrmg.motion._kernels import USER
from mrmg.planning import PlannerParams, Request
from mrmg.planning.path_following import following
from mrmg.planning.path_following.band import Path
from mrmg.planning.path_following.following import (
    LEAST_SOC_MARGIN,
    can_follow,
    follow_tours,
    path_cost_J,
    tour_path,
)
from mrmg.planning.problem.problem import state_mission
from mrmg.planning.routers import find_router
from mrmg.planning.routing.routing import solve_routing
from mrmg.plans import Plan
from mrmg.scene.types import Scene

PARAMS = PlannerParams(samples=600)
REQUEST = Request(params=PARAMS, router=find_router(PARAMS.router), seed=0)


def followed(scene: Scene) -> Plan:
    problem = state_mission(scene, 0, PARAMS).with_soc_margin(LEAST_SOC_MARGIN)
    tours = solve_routing(problem.mission.routing, PARAMS.router, 0)
    plan = follow_tours(problem, REQUEST, tours).plan
    assert plan is not None
    return plan


@pytest.mark.parametrize("name", ["quickstart", "scene2", "diffdrive"])
def test_plans_along_tours_are_valid_and_the_same_again(name: str) -> None:
    scene = mrmg.load_scene(name)
    plan = followed(scene)
    assert mrmg.verify(scene, plan).violations == ()
    assert followed(scene).digest == plan.digest


def test_tours_are_given_up_before_their_next_path(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = state_mission(mrmg.load_scene("scene1"), 0, PARAMS)
    tours = solve_routing(problem.mission.routing, PARAMS.router, 0)
    request, paths = replace(REQUEST, halt=np.zeros(1, np.bool_)), []

    def tour_path_and_halt(*args: Any) -> Path:
        request.halt[0] = True
        paths.append(tour_path(*args))
        return paths[-1]

    monkeypatch.setattr(following, "tour_path", tour_path_and_halt)
    assert follow_tours(problem, request, tours).plan is None
    assert len(paths) == 1 < len(problem.scene.robots)


@pytest.mark.parametrize("name", ["quickstart", "hills"])
def test_plans_along_tours_leave_something_of_every_battery(name: str) -> None:
    scene = mrmg.load_scene(name)
    plan = followed(scene)
    for trajectory in plan.trajectories:
        battery = scene.robot(trajectory.robot).battery
        visits = [one for one in plan.visits if one.robot == trajectory.robot]
        least_J = battery_profile(scene, trajectory, visits).min()
        assert least_J >= battery.reserve_J + LEAST_SOC_MARGIN * battery.capacity_J


def test_tours_are_judged_nearly_by_what_driving_takes() -> None:
    scene = mrmg.load_scene("quickstart")
    problem = state_mission(scene, 0, PARAMS)
    tours = solve_routing(problem.mission.routing, PARAMS.router, 0)
    best_J = followed(scene).cost_J
    assert 0.9 * best_J < path_cost_J(problem, tours) < 1.02 * best_J


def test_a_car_backs_out_of_a_target_that_lies_at_a_sharp_turn(
    yard: Callable[..., Scene],
) -> None:
    goals = [
        {"id": "g1", "circle": {"center": [24, 10], "radius": 1.5}},
        {"id": "g2", "circle": {"center": [10, 10], "radius": 1.5}},
    ]
    problem = state_mission(yard(goals=goals), 0, PARAMS)
    path = tour_path(problem, 0, [0, 1])
    assert set(path.gear[: path.stop[0]]) == {1}
    assert set(path.gear[path.stop[0] :]) == {-1}
    assert len(path.pivot) == 0


OUT_AND_BACK = {
    "goals": [
        {"id": "g1", "circle": {"center": [24, 10], "radius": 1.5}},
        {"id": "g2", "circle": {"center": [4, 10], "radius": 1.5}},
    ],
    "robots": [{"id": "r1", "model": "car", "pose": [19, 10, 0]}],
}


def reversing_s(plan: Plan) -> float:
    return sum(float((t.state[:, 3] < -0.1).sum()) * t.dt_s for t in plan.trajectories)


def test_where_time_counts_cars_turn_round_if_there_is_room(
    yard: Callable[..., Scene],
) -> None:
    cheap = followed(yard(**OUT_AND_BACK))
    scene = yard(**OUT_AND_BACK, objective="makespan")
    soon = followed(scene)
    assert mrmg.verify(scene, soon).ok
    assert reversing_s(cheap) > 5.0
    assert reversing_s(soon) < 1.0
    assert soon.makespan_s < cheap.makespan_s


def test_where_time_counts_cars_back_out_of_what_is_too_narrow(
    yard: Callable[..., Scene],
) -> None:
    walls = [
        {"box": {"center": [18, y], "size": [22, 1]}, "id": f"w{y}"} for y in (7, 13)
    ]
    scene = yard(**OUT_AND_BACK, obstacles=walls, objective="makespan")
    plan = followed(scene)
    assert mrmg.verify(scene, plan).ok
    assert reversing_s(plan) > 3.0


def test_halted_it_gives_nothing(yard: Callable[..., Scene]) -> None:
    problem = state_mission(yard(), 0, PARAMS)
    tours = solve_routing(problem.mission.routing, PARAMS.router, 0)
    halted = replace(REQUEST, halt=np.ones(1, np.bool_))
    assert follow_tours(problem, halted, tours).plan is None


SWAP = [
    {
        "id": name,
        "model": "diffdrive",
        "pose": [x, 10, yaw],
        "finish": {
            "circle": {"center": [30 - x, 10], "radius": 0.8},
            "heading": heading,
        },
    }
    for name, x, yaw, heading in (("a", 8, 0.0, 1.5), ("b", 22, np.pi, 3.1))
]


def test_robots_that_turn_on_the_spot_end_as_they_must(
    yard: Callable[..., Scene],
) -> None:
    scene = yard(goals=[], robots=SWAP)
    plan = followed(scene)
    assert mrmg.verify(scene, plan).violations == ()
    for trajectory, heading in zip(plan.trajectories, (1.5, 3.1), strict=True):
        lacking = np.angle(np.exp(1j * (trajectory.state[-1, 2] - heading)))
        assert abs(lacking) < 0.15


def test_models_of_users_do_not_follow_paths(yard: Callable[..., Scene]) -> None:
    problem = state_mission(yard(), 0, PARAMS)
    assert can_follow(problem)
    fleet = problem.mission.fleet.copy()
    fleet["model"] = USER
    mission = problem.mission._replace(fleet=fleet)
    assert not can_follow(replace(problem, mission=mission))


def test_each_car_changes_gear_by_its_own_speeds(yard: Callable[..., Scene]) -> None:
    """One that is slow backwards keeps none of the others from backing out."""
    fast = {"like": "car", "limits": {"v_min": -2.0}}
    robots = [
        {"id": "r1", "model": fast, "pose": [19, 10, 0]},
        {"id": "r2", "model": "car", "pose": [19, 15, 0]},
    ]
    scene = yard(**{**OUT_AND_BACK, "robots": robots}, objective="makespan")
    problem = state_mission(scene, 0, PARAMS)
    paths = [tour_path(problem, r, [0, 1], timed=True) for r in (0, 1)]
    assert [bool((path.gear < 0).any()) for path in paths] == [True, False]
