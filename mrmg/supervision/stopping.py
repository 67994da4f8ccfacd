"""Choosing how a fleet comes to rest, so that nobody touches anything on the way.

All robots brake in full, steering held, if that keeps them clear. Else robots in
service may stop along their planned paths instead, all at one rate, later but without
leaving the places they were given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Set

import numpy as np

from mrmg.motion.user_motion import plain_step
from mrmg.plans import Trajectory
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.verification.distances import obstacle_distance, robot_distance

ENOUGH_M = 0.1
"""Clearance with which full braking needs no alternative."""

_REST = 1e-9

Motion = tuple[np.ndarray, np.ndarray]
"""States, shape (n + 1, 5), and controls, shape (n, 2)."""


def motions_to_rest(
    scene: Scene,
    trajectories: Sequence[Trajectory],
    step: int,
    states: Mapping[str, np.ndarray],
    broken: Set[str],
) -> dict[str, Motion]:
    """Return how each robot of a fleet comes to rest; motions differ in length.

    Args:
        scene: obstacles and robots.
        trajectories: the plan in force, in the scene's order of robots.
        step: of the plan, from which on the fleet brakes.
        states: of all robots at that step, shape (5,) each.
        broken: ids of robots that can but brake in full.
    """
    models = {robot.id: robot.model for robot in scene.robots}
    braked = {
        item.robot: brake_to_rest(models[item.robot], states[item.robot], item.dt_s)
        for item in trajectories
    }
    clear_m = clearance_m(scene, braked)
    if clear_m >= ENOUGH_M:
        return braked
    along = {
        item.robot: _stopped_along_plan(
            models[item.robot], states[item.robot], item.state[step:], item.dt_s
        )
        for item in trajectories
        if item.robot not in broken
    }
    along = {**braked, **along}
    return along if clearance_m(scene, along) > clear_m else braked


def brake_to_rest(model: RobotModel, state: np.ndarray, dt_s: float) -> Motion:
    """Return the motion of full braking, and of straightening the wheels after it.

    Args:
        model: of the robot; it brakes at the planner's share of its limits.
        state: (x, y, theta, v, psi) at the beginning, shape (5,).
        dt_s: length of a step.
    """
    limits = model.planned_limits
    step = plain_step(model)
    turns_on_the_spot = model.motion_model == "unicycle"
    states, controls = [tuple(float(value) for value in state)], []
    while _moving(states[-1][3]) or _moving(states[-1][4]):
        v, w = states[-1][3:]
        u1 = _toward_zero(v, limits.u1_max_m_s2, dt_s)
        # A car holds its steering until it stands.
        free = turns_on_the_spot or not _moving(v)
        u2 = _toward_zero(w, limits.u2_max, dt_s) if free else 0.0
        states.append(step(states[-1], (u1, u2), model.wheelbase_m, dt_s))
        controls.append((u1, u2))
    return np.array(states), np.array(controls, float).reshape(-1, 2)


def _moving(rate: float) -> bool:
    return abs(rate) > _REST


def _toward_zero(value: float, bound: float, dt_s: float) -> float:
    return max(-bound, min(bound, -value / dt_s))


def _stopped_along_plan(
    model: RobotModel, first: np.ndarray, planned: np.ndarray, dt_s: float
) -> Motion:
    """Return a planned motion slowed down to rest at half the braking limit.

    The plan is run at a rate that falls evenly from 1 to 0.

    Args:
        model: of the robot.
        first: its state at the beginning, shape (5,).
        planned: states of the plan from there on, shape (n, 5).
        dt_s: length of a step.
    """
    limit_m_s2 = 0.5 * model.planning_share * model.limits.u1_max_m_s2
    slowing_s = max(float(np.abs(planned[:, 3]).max()) / limit_m_s2, dt_s)
    count = math.ceil(slowing_s / dt_s)
    rate = 1.0 - np.arange(count + 1) / count
    plan_s = dt_s * np.cumsum([0.0, *(0.5 * (rate[1:] + rate[:-1]))])
    times_s = dt_s * np.arange(len(planned))
    states = np.stack(
        [np.interp(plan_s, times_s, column) for column in planned.T], axis=1
    )
    states[0] = first
    states[:, 3] *= rate
    if model.motion_model == "unicycle":
        states[:, 4] *= rate
    controls = np.diff(states[:, 3:], axis=0) / dt_s
    rest, straighten = brake_to_rest(model, states[-1], dt_s)
    return np.concatenate([states[:-1], rest]), np.concatenate([controls, straighten])


def clearance_m(scene: Scene, motions: Mapping[str, Motion]) -> float:
    """Return the least distance of a robot to anything while it comes to rest."""
    robots = scene.robots
    longest = max(len(control) for _, control in motions.values())
    poses = [held(*motions[robot.id], longest)[0] for robot in robots]
    distances_m = [
        obstacle_distance(scene, robot, own).min()
        for robot, own in zip(robots, poses, strict=True)
    ]
    if len(robots) > 1:
        distances_m.append(robot_distance(robots, poses).min())
    return float(min(distances_m))


def held(state: np.ndarray, control: np.ndarray, length: int) -> Motion:
    """Return a motion lengthened to `length` steps by standing at its end."""
    rest = state[-1].copy()
    rest[3:] = 0.0
    missing = length - len(control)
    return (
        np.concatenate([state, np.repeat(rest[None], missing, axis=0)]),
        np.concatenate([control, np.zeros((missing, 2))]),
    )
