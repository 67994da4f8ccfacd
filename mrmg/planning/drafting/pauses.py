"""How long robots stand at the stops of their paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrmg.energy.metering import battery_profile, find_visits
from mrmg.energy.model import CONSUMERS_W
from mrmg.planning.drafting.band import Path
from mrmg.planning.problem.problem import Problem
from mrmg.plans import Trajectory

MORE = 1.05
"""Multiple of what its path takes from which it follows how long a battery is filled:
turns and slopes take some more."""

LEAST_MISSING_S = 0.5
"""Least time that a stay is prolonged by [s]."""


def with_pauses(problem: Problem, r: int, path: Path, longer_s: np.ndarray) -> Path:
    """Return robot r's path with the time it stands at each stop.

    That is the dwell time, and at stations that take time until the battery is full.

    Args:
        problem: the mission.
        r: robot.
        path: from the robot's start; its pauses do not count.
        longer_s: how much longer than that it stands at each stop [s].
    """
    targets, robot = problem.mission.targets, problem.mission.fleet[r]
    pause_s = np.where(path.target < targets.places, targets.dwell[path.target], 0.0)
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
    return replace(path, pause_s=pause_s + longer_s[: len(pause_s)])


def missing_charge_s(
    problem: Problem, r: int, tour: Sequence[int], trajectory: Trajectory
) -> np.ndarray:
    """Return how much longer robot r had to charge at each stop for a full battery [s].

    All zero where the battery suffices. Waiting for others, turns and slopes take what
    `with_pauses` does not foresee.

    Args:
        problem: the mission.
        r: robot.
        tour: numbers of its targets; where it must end may come last.
        trajectory: that visits them.
    """
    scene, targets = problem.scene, problem.mission.targets
    robot = problem.mission.fleet[r]
    missing_s = np.zeros(len(tour))
    places = [t for t in tour if t < targets.places]
    stations = [i for i, t in enumerate(places) if t >= targets.goals]
    if not stations or not np.isfinite(robot["charge"]):
        return missing_s
    names = [target.id for target in scene.targets()]
    visits = find_visits(scene, trajectory, [names[t] for t in places])
    if len(visits) < len(places):
        return missing_s
    content_J = battery_profile(scene, trajectory, visits)
    battery = scene.robots[r].battery
    if content_J.min() >= battery.reserve_J + problem.soc_margin * battery.capacity_J:
        return missing_s
    power_W = robot["charge"] - robot["energy"][CONSUMERS_W]
    ends = [visit.step for visit in visits[1:]] + [len(content_J)]
    for i in stations:
        most_J = content_J[visits[i].step : max(ends[i], visits[i].step + 1)].max()
        missing_s[i] = max(0.0, battery.capacity_J - most_J) / power_W
    return np.where(missing_s > LEAST_MISSING_S, missing_s, 0.0)


def _used_J(problem: Problem, r: int, path: Path) -> np.ndarray:
    """Return the energy that rolling takes to each node, shape (n,)."""
    spaces, terrain = problem.mission.spaces, problem.mission.terrain.multiplier
    middle = 0.5 * (path.node[1:] + path.node[:-1])
    cell = ((middle - (spaces.x_min, spaces.y_min)) / spaces.cell).astype(int)
    rows, columns = terrain.shape
    ground = terrain[
        np.clip(cell[:, 1], 0, rows - 1), np.clip(cell[:, 0], 0, columns - 1)
    ]
    size = np.hypot(*np.diff(path.node, axis=0).T)
    plain = problem.mission.fleet[r]["plain"]
    return np.concatenate([[0.0], np.cumsum(plain * ground * size)])
