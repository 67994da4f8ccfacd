"""Damage to motion: states, controls, their limits, and clocks."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import numpy as np

from faults.changes import (
    Case,
    InapplicableError,
    Make,
    amount,
    moving,
    with_robot,
    with_trajectory,
)
from mrmg.motion.user_motion import plain_step
from mrmg.plans import Plan, Trajectory
from mrmg.scene.types import Scene


def change_state(column: int) -> Make:
    """Return what changes one number of a state."""

    def make(scene: Scene, plan: Plan, random: Random) -> Case:
        trajectory = moving(plan, random)
        state = trajectory.state.copy()
        step = random.randrange(1, len(state))
        least = 8 * np.spacing(max(1.0, abs(state[step, column])))
        state[step, column] += amount(random, least, 1.0)
        return scene, with_trajectory(plan, trajectory, state=state)

    return make


def make_not_finite(scene: Scene, plan: Plan, random: Random) -> Case:
    """Put infinity, or what is no number, into states or controls."""
    trajectory = moving(plan, random)
    name = random.choice(("state", "control"))
    values = getattr(trajectory, name).copy()
    values.flat[random.randrange(values.size)] = random.choice((np.nan, np.inf))
    return scene, with_trajectory(plan, trajectory, **{name: values})


def change_shape(scene: Scene, plan: Plan, random: Random) -> Case:
    """Cut states or controls, flatten them, empty them, or move them far away."""
    trajectory = moving(plan, random)
    state, control = trajectory.state, trajectory.control
    other = random.choice(
        (
            {"state": state[:-1]},
            {"control": control[:-1]},
            {"state": state[:, :4]},
            {"control": control[:, :1]},
            {"state": state.ravel()},
            {"state": state[:0], "control": control[:0]},
            {"state": state + 1e13},
        )
    )
    return scene, with_trajectory(plan, trajectory, **other)


def move_start(scene: Scene, plan: Plan, random: Random) -> Case:
    """Move or turn a robot's start in the scene."""
    robot = random.choice(scene.robots)
    pose = list(robot.pose)
    pose[random.randrange(3)] += amount(random, 1e-9, 1.0)
    return with_robot(scene, plan, robot.id, pose=tuple(pose))


def cut_off(scene: Scene, plan: Plan, random: Random) -> Case:
    """End all motion while a robot drives."""
    fast = np.abs(moving(plan, random).state[:, 3]) > 0.01
    steps = [int(step) for step in np.flatnonzero(fast) if step > 0]
    end = random.choice(steps)
    cut = tuple(
        replace(item, state=item.state[: end + 1], control=item.control[:end])
        for item in plan.trajectories
    )
    return scene, replace(plan, trajectories=cut)


def change_control(scene: Scene, plan: Plan, random: Random) -> Case:
    """Change one number of a control."""
    trajectory = moving(plan, random)
    control = trajectory.control.copy()
    step, column = random.randrange(len(control)), random.randrange(2)
    control[step, column] += amount(random, 1e-9, 1.0)
    return scene, with_trajectory(plan, trajectory, control=control)


def exceed_control_limit(scene: Scene, plan: Plan, random: Random) -> Case:
    """Drive by a control beyond its limit."""
    trajectory = moving(plan, random)
    limits = scene.robot(trajectory.robot).model.limits
    column = random.randrange(2)
    limit = (limits.u1_max_m_s2, limits.u2_max)[column]
    control = trajectory.control.copy()
    step = random.randrange(len(control))
    excess = abs(amount(random, 1e-6, 10.0))
    control[step, column] = random.choice((-1, 1)) * (limit + excess)
    states = states_under(scene, trajectory, control)
    return scene, with_trajectory(plan, trajectory, state=states, control=control)


def exceed_state_limit(name: str, column: int) -> Make:
    """Return what lowers a model's limit below what its robot reaches."""

    def make(scene: Scene, plan: Plan, random: Random) -> Case:
        trajectory = moving(plan, random)
        reached = float(np.abs(trajectory.state[:, column]).max())
        if reached < 0.01:
            raise InapplicableError
        robot = scene.robot(trajectory.robot)
        limit = reached * (1.0 - abs(amount(random, 1e-6, 0.5)))
        limits = replace(robot.model.limits, **{name: limit})
        model = replace(robot.model, limits=limits)
        return with_robot(scene, plan, robot.id, model=model)

    return make


def states_under(
    scene: Scene,
    trajectory: Trajectory,
    control: np.ndarray,
    start: np.ndarray | None = None,
) -> np.ndarray:
    """Return the states of a robot under other controls, or from another start."""
    model = scene.robot(trajectory.robot).model
    step = plain_step(model)
    states = [tuple((trajectory.state[0] if start is None else start).tolist())]
    for pair in control.tolist():
        states.append(
            step(states[-1], tuple(pair), float(model.wheelbase_m), trajectory.dt_s)
        )
    return np.array(states)


def change_step(scene: Scene, plan: Plan, random: Random) -> Case:
    """Change the length of all steps."""
    dt_s = plan.dt_s * (1.0 + amount(random, 1e-6, 0.5))
    slower = tuple(replace(item, dt_s=dt_s) for item in plan.trajectories)
    return scene, replace(plan, dt_s=dt_s, trajectories=slower)


def change_step_of_one_robot(scene: Scene, plan: Plan, random: Random) -> Case:
    """Change the length of one robot's steps."""
    trajectory = random.choice(plan.trajectories)
    wrong = random.choice((trajectory.dt_s * 2, 0.0, float("nan"), -0.1))
    return scene, with_trajectory(plan, trajectory, dt_s=wrong)
