"""How long robots stand at the stops of their paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrmg.energy.model import CONSUMERS_W
from mrmg.planning.path_following.band import Path
from mrmg.planning.problem.problem import Problem
from mrmg.world.terrain import multiplier_at

MORE = 1.05
"""Multiple of what its path takes from which it follows how long a battery is filled:
turns and slopes take some more."""


def with_pauses(problem: Problem, r: int, path: Path) -> Path:
    """Return robot r's path with the time it stands at each stop.

    That is the dwell time, and at stations that take time until the battery is full.

    Args:
        problem: the mission.
        r: robot.
        path: from the robot's start; its pauses do not count.
    """
    targets, robot = problem.mission.targets, problem.mission.fleet[r]
    pause_s = np.where(
        path.target < targets.places, targets.target["dwell"][path.target], 0.0
    )
    if np.isfinite(robot["charge"]):
        used_J = MORE * _used_J(problem, r, path)[path.stop]
        power_W = robot["charge"] - robot["energy"][CONSUMERS_W]
        filled_J = float(problem.scene.robots[r].battery.start_J)
        began_J = 0.0
        for i, target in enumerate(path.target):
            if targets.goals <= target < targets.places:
                lack_J = robot["capacity"] - filled_J + used_J[i] - began_J
                pause_s[i] = max(pause_s[i], lack_J / power_W)
                filled_J, began_J = robot["capacity"], used_J[i]
    return replace(path, pause_s=pause_s)


def _used_J(problem: Problem, r: int, path: Path) -> np.ndarray:
    """Return the energy that rolling takes to each node, shape (n,)."""
    middle = 0.5 * (path.node[1:] + path.node[:-1])
    ground = multiplier_at(problem.scene, middle)
    size = np.hypot(*np.diff(path.node, axis=0).T)
    plain = problem.mission.fleet[r]["plain"]
    return np.concatenate([[0.0], np.cumsum(plain * ground * size)])
