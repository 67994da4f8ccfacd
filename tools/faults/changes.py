"""Changes of scenes and plans that all damage to plans is made of."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from random import Random
from typing import Any, TypeVar

import numpy as np

from mrmg.plans import Plan, Trajectory
from mrmg.scene.region import Region
from mrmg.scene.types import Scene

Case = tuple[Scene, Plan]
Make = Callable[[Scene, Plan, Random], Case]
"""Returns the scene and the plan, one of them damaged."""

Item = TypeVar("Item")


class InapplicableError(Exception):
    """A plan has nothing that this damage could be done to."""


def swapped(items: Sequence[Item], old: Item, new: Item) -> tuple[Item, ...]:
    """Return items with another one in the place of one of them."""
    return tuple(new if item is old else item for item in items)


def with_trajectory(plan: Plan, old: Trajectory, **changes: Any) -> Plan:
    """Return a plan with one of its trajectories changed."""
    changed = swapped(plan.trajectories, old, replace(old, **changes))
    return replace(plan, trajectories=changed)


def with_scene(scene: Scene, plan: Plan, **changes: Any) -> Case:
    """Return a changed scene, and the plan as if it had been made for that."""
    changed = replace(scene, **changes)
    return changed, replace(plan, scene_digest=changed.digest)


def with_robot(scene: Scene, plan: Plan, robot_id: str, **changes: Any) -> Case:
    """Return a scene with a robot changed, and the plan as if made for that."""
    robot = scene.robot(robot_id)
    robots = swapped(scene.robots, robot, replace(robot, **changes))
    return with_scene(scene, plan, robots=robots)


def moving(plan: Plan, random: Random) -> Trajectory:
    """Return the trajectory of a robot that leaves its place."""
    moving = [item for item in plan.trajectories if np.ptp(item.state[:, :2]) > 1.0]
    if not moving:
        raise InapplicableError
    return random.choice(moving)


def amount(random: Random, least: float, most: float) -> float:
    """Return a number of either sign whose logarithm is uniform."""
    size = float(np.exp(random.uniform(np.log(least), np.log(most))))
    return random.choice((-size, size))


def circle(center: np.ndarray, radius_m: float) -> Region:
    """Return the region within a circle."""
    return Region(center=center, radius_m=radius_m, corners=np.zeros((0, 2)))
