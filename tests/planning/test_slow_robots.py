"""Robots that take a long time for their length, or to brake, as rovers do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from solved import verified_plan

import mrmg
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.path_following.coordination._end_kernels import brake, braking_steps
from mrmg.planning.path_following.coordination.tasks import horizon_steps, no_path
from mrmg.planning.problem.problem import Problem
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene

PARAMS = PlannerParams(samples=400, improvements=0)


def slower(model: RobotModel, times: float) -> RobotModel:
    """Return a model that does all it does in so many times the time."""
    limits, car = model.limits, model.motion_model == "car"
    return replace(
        model,
        idle_power_W=model.idle_power_W / times,
        device_power_W=model.device_power_W / times,
        limits=replace(
            limits,
            v_min_m_s=limits.v_min_m_s / times,
            v_max_m_s=limits.v_max_m_s / times,
            w_max=limits.w_max if car else limits.w_max / times,
            u1_max_m_s2=limits.u1_max_m_s2 / times**2,
            u2_max=limits.u2_max / (times if car else times**2),
        ),
    )


def with_models(scene: Scene, change: Callable[[RobotModel], RobotModel]) -> Scene:
    robots = (replace(one, model=change(one.model)) for one in scene.robots)
    return replace(scene, robots=tuple(robots))


@pytest.mark.parametrize("name", ["diffdrive", "mixed"])
def test_slow_robots_take_the_same_energy_and_their_time(name: str) -> None:
    scene = mrmg.load_scene(name)
    plan = verified_plan(scene, 0, PARAMS)
    slow = verified_plan(
        with_models(scene, lambda model: slower(model, 40.0)), 0, PARAMS
    )
    assert slow.cost_J == pytest.approx(plan.cost_J, rel=0.02)
    assert slow.makespan_s == pytest.approx(40.0 * plan.makespan_s, rel=0.3)


def test_slow_robots_make_room_for_each_other(crossing: Scene) -> None:
    """In as few motions as others, or none would end."""
    plan = verified_plan(crossing, 0, PARAMS)
    slow = verified_plan(
        with_models(crossing, lambda model: slower(model, 20.0)), 0, PARAMS
    )
    assert slow.makespan_s < 1.5 * 20.0 * plan.makespan_s


@pytest.mark.parametrize("name", ["diffdrive", "mixed"])
def test_sluggish_robots_have_the_time_to_brake(name: str) -> None:
    """For a minute and more."""

    def sluggish(model: RobotModel) -> RobotModel:
        least = 0.02 * model.limits.u1_max_m_s2
        return replace(model, limits=replace(model.limits, u1_max_m_s2=least))

    scene = with_models(mrmg.load_scene(name), sluggish)
    assert scene.robots[0].model.limits.u1_max_m_s2 < 0.05
    verified_plan(scene, 0, PARAMS)


@pytest.mark.parametrize("name", ["scene1", "mixed"])
def test_robots_that_steer_slowly_follow_their_paths(name: str) -> None:
    def slowly(model: RobotModel) -> RobotModel:
        least = 0.15 * model.limits.u2_max
        return replace(model, limits=replace(model.limits, u2_max=least))

    scene = mrmg.load_scene(name)
    result = plan_mission(with_models(scene, slowly), params=PARAMS)
    assert result.plan is not None, result.reason
    assert result.statistics["coordinated"] == 0
    assert result.plan.cost_J < 1.2 * verified_plan(scene, 0, PARAMS).cost_J


def test_searches_have_room_for_braking_from_full_speed(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """Of a robot that takes ten minutes for it, twice over."""

    def sluggish(model: RobotModel) -> RobotModel:
        least = model.limits.v_max_m_s / 600.0
        return replace(model, limits=replace(model.limits, u1_max_m_s2=least))

    problem = state(with_models(yard(), sluggish), samples=0)
    own, dt_s = problem.mission.fleet[:1], problem.dt_s
    horizon = horizon_steps(problem, [[0]], [no_path(problem, 0)])
    states, controls = np.zeros((horizon + 1, 5)), np.zeros((horizon, 2))
    states[0, 3] = own[0]["limit"][1]
    steps = brake(own, dt_s, states, controls)
    assert steps > 5000
    assert abs(states[steps, 3]) < 1e-9
    assert 2 * braking_steps(own, dt_s) < horizon
