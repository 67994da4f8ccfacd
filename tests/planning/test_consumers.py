"""Missions whose robots draw power for as long as they last."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mrmg.planning.bound.bound import lower_bound_J
from mrmg.planning.bounding import bounds_of
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.path_following.driven_legs import what_driving_took
from mrmg.planning.planner import plan_mission
from mrmg.planning.problem.problem import state_mission
from mrmg.planning.problem.time_weighting import time_counts
from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene

MakeScene = Callable[..., Scene]
PARAMS = PlannerParams(samples=300, route_margin=0.0)


def drawing(scene: Scene, idle_power_W: float) -> Scene:
    """Return a scene whose robots' own consumers draw so much."""
    robots = tuple(
        replace(one, model=replace(one.model, idle_power_W=idle_power_W))
        for one in scene.robots
    )
    return replace(scene, robots=robots)


def test_what_consumers_draw_at_top_speed_is_in_the_bound(
    yard: Callable[..., Scene],
) -> None:
    """On plain ground that is c times what the ground takes, in every way."""
    scene = yard(battery={"capacity_m": 500})
    model = scene.robots[0].model
    power_W = 0.5 * model.energy_model.plain_ground_J_per_m() * model.top_speed_m_s
    bound_J = lower_bound_J(scene)
    assert bound_J > 0.0
    assert lower_bound_J(drawing(scene, power_W)) == pytest.approx(1.5 * bound_J)


@pytest.mark.parametrize("idle_power_W", [30.0, 90.0])
def test_plans_with_consumers_take_more_than_their_bound(idle_power_W: float) -> None:
    scene = drawing(load_scene("scene2"), idle_power_W)
    free_J = lower_bound_J(load_scene("scene2"))
    plan = plan_mission(scene).plan
    assert plan is not None
    assert free_J < lower_bound_J(scene) < plan.cost_J


@pytest.mark.parametrize(
    ("power_W", "counts"), [(0.0, False), (0.5, False), (60, True)]
)
def test_little_consumers_leave_plans_what_they_are(
    power_W: float, counts: bool
) -> None:
    assert time_counts(drawing(load_scene("scene2"), power_W)) == counts


def test_legs_take_what_consumers_draw_on_them(yard: MakeScene) -> None:
    home = {"id": "r1", "model": "car", "pose": [4, 10, 0], "finish": "start"}
    bare = yard(robots=[home], time_limit=300.0)
    free = state_mission(bare, 0, PARAMS).mission.routing
    routing = state_mission(drawing(bare, 80.0), 0, PARAMS).mission.routing
    assert routing.time.any()
    assert np.allclose(routing.cost, free.cost + 80.0 * routing.time)
    assert np.allclose(routing.finish, free.finish + 80.0 * routing.finish_time)


def test_the_fleet_shares_the_work_where_waiting_takes_more_than_driving() -> None:
    """What a robot saves that does all alone, the others draw meanwhile."""
    scene = load_scene("scene6")
    one = plan_mission(scene).plan
    shared = plan_mission(drawing(scene, 300.0)).plan
    assert one is not None
    assert shared is not None
    assert shared.makespan_s < 0.6 * one.makespan_s
    alone_J = one.cost_J + len(scene.robots) * 300.0 * one.makespan_s
    assert shared.cost_J < 0.8 * alone_J


def test_what_robots_draw_at_rest_is_learnt_by_driving() -> None:
    scene = drawing(load_scene("scene2"), 60.0)
    problem = state_mission(scene, 0, PlannerParams())
    plan = plan_mission(scene).plan
    assert plan is not None
    took = what_driving_took(problem, plan.trajectories, plan.tours)
    for r, trajectory in enumerate(plan.trajectories):
        moves = np.abs(np.diff(trajectory.state, axis=0)).sum(axis=1) > 0.0
        at_rest = len(moves) - 1 - int(np.flatnonzero(moves)[-1])
        assert took.rest_J[r] == pytest.approx(60.0 * trajectory.dt_s * at_rest)
    assert max(took.rest_J.values()) > 0.0


def test_bounds_know_that_all_draw_until_the_end(yard: MakeScene) -> None:
    """One drives, and two draw meanwhile."""
    poses = {"r1": [4, 10, 0], "r2": [4, 16, 0]}
    robots = [{"id": r, "model": "car", "pose": pose} for r, pose in poses.items()]
    scene = drawing(yard(robots=robots, battery={"capacity_m": 900}), 400.0)
    one_J, bound_J = lower_bound_J(scene), bounds_of(scene, 0.1).energy_J
    plan = plan_mission(scene).plan
    assert plan is not None
    assert bound_J is not None
    assert 1.5 * one_J < bound_J < plan.cost_J < 1.5 * bound_J


def test_who_cannot_wait_for_the_others_recharges_first(yard: MakeScene) -> None:
    """The battery suffices for all of its way, but not until the mission is over."""
    near = {"id": "near", "circle": {"center": [10, 12], "radius": 1}}
    far = {"id": "far", "circle": {"center": [80, 4], "radius": 1}}
    low = {"battery": {"capacity_m": 90}, "start_energy": {"m": 27}}
    scene = yard(
        bounds=[0, 0, 90, 20],
        goals=[near, far],
        stations=[{"id": "s", "circle": {"center": [14, 16], "radius": 1.5}}],
        battery={"capacity_m": 900},
        robots=[
            {"id": "r1", "model": "car", "pose": [4, 10, 0], **low},
            {"id": "r2", "model": "car", "pose": [4, 4, 0]},
        ],
    )
    plan = plan_mission(drawing(scene, 100.0)).plan
    assert plan is not None
    assert plan.tours == {"r1": ("near", "s"), "r2": ("far",)}
