"""Who makes no progress along its path, where, and which robot is in its way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.planning.path_following.robot_task import RobotTask
from mrmg.planning.path_following.tracking import Drive
from mrmg.planning.problem.problem import Problem

CONTACT_M = 0.6
"""How much farther apart than they must be robots may be in each other's way."""

BLOCKING_M = 4.0
"""Distance within which another robot counts as being in the way."""


def in_the_way(problem: Problem, outcome: Drive) -> int:
    """Return the robot that the stuck one cannot get past, -1 if there is none near."""
    fleet, r = problem.mission.fleet, outcome.stuck
    reach = fleet["radius"] + fleet["radius"][r]
    reach += np.maximum(fleet["spacing"], fleet["spacing"][r]) + CONTACT_M
    turn = np.stack([np.cos(outcome.state[:, 2]), np.sin(outcome.state[:, 2])], axis=1)
    left = np.stack([-turn[:, 1], turn[:, 0]], axis=1)
    offset = fleet["middle"]
    middle = outcome.state[:, :2] + offset[:, :1] * turn + offset[:, 1:] * left
    gap = np.hypot(*(middle - middle[r]).T) - reach
    gap[r] = np.inf
    return int(gap.argmin()) if gap.min() < 0.0 else -1


def no_progress(problem: Problem, tasks: Sequence[RobotTask], outcome: Drive) -> str:
    """Return which robot made no progress in words, and where; "" if none did."""
    r = outcome.stuck
    if r < 0:
        return "robots miss targets of their tours"
    scene, path = problem.scene, tasks[r].path
    ahead = np.flatnonzero(path.way[path.stop] > outcome.driven[r])
    target = int(path.target[ahead[0]]) if len(ahead) else -1
    places = [one.id for one in scene.targets()]
    where = (
        f"on its way to {places[target]}" if 0 <= target < len(places) else "at last"
    )
    apart_m = np.hypot(*(outcome.state[:, :2] - outcome.place).T)
    apart_m[r] = np.inf
    other = int(apart_m.argmin())
    near = apart_m[other] < BLOCKING_M
    by = f", with {scene.robots[other].id} in its way" if near else ""
    return f"{scene.robots[r].id} makes no progress {where}{by}"
