"""Damage that puts something in a robot's way: bounds, posts, other robots."""

from __future__ import annotations

from random import Random

from faults.changes import (
    Case,
    InapplicableError,
    moving,
    with_robot,
    with_scene,
    with_trajectory,
)
from faults.motion_damage import states_under
from faults.posts import thin_post
from mrmg.plans import Plan
from mrmg.scene.types import Scene


def narrow_bounds(scene: Scene, plan: Plan, random: Random) -> Case:
    """Draw the bounds in until the reference point of a robot is outside."""
    state = moving(plan, random).state
    axis = random.randrange(2)
    bounds = [*scene.bounds]
    low, high = float(state[:, axis].min()), float(state[:, axis].max())
    if high - low < 0.5:
        raise InapplicableError
    inside = low + random.uniform(0.05, 0.95) * (high - low)
    bounds[axis + random.choice((0, 2))] = inside
    return with_scene(scene, plan, bounds=tuple(bounds))


def put_post(scene: Scene, plan: Plan, random: Random) -> Case:
    """Put a post where no pose of the plan touches it, but motion between two does."""
    trajectory = moving(plan, random)
    post = thin_post(scene.robot(trajectory.robot).model, trajectory, random)
    if post is None:
        raise InapplicableError
    return with_scene(scene, plan, obstacles=(*scene.obstacles, post))


def cross_robot(scene: Scene, plan: Plan, random: Random) -> Case:
    """Let one robot make its motion from a start that leads it into another one."""
    if len(plan.trajectories) < 2:
        raise InapplicableError
    one, other = random.sample(plan.trajectories, 2)
    steps = min(len(one.state), len(other.state))
    step = random.randrange(steps)
    start = one.state[0].copy()
    jitter = [random.uniform(-0.1, 0.1) for _ in range(2)]
    start[:2] += other.state[step, :2] - one.state[step, :2] + jitter
    states = states_under(scene, one, one.control, start)
    moved = with_trajectory(plan, one, state=states)
    return with_robot(scene, moved, one.robot, pose=tuple(start[:3].tolist()))
