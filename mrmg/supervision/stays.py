"""Stays at goals that a stop of the fleet falls into: what was stayed already counts.

A stay must not be broken, so that only the robot that is there can bring it to its end,
and only if it does not leave before.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from mrmg.energy.visits import is_at, runs
from mrmg.plans import Visit
from mrmg.scene.types import Goal

_VISITED_DEPTH_M, _VISITED_SHARE = 0.05, 0.25


@dataclass(frozen=True, slots=True)
class OngoingStay:
    """A stay at a goal that is not long enough yet.

    Attributes:
        robot: id of the robot that is there.
        stayed_s: how long it has been.
    """

    robot: str
    stayed_s: float


def seen_at(goal: Goal, poses: np.ndarray) -> np.ndarray:
    """Return where a robot was seen deep in a goal, as places are seen with noise.

    How deep depends on the goal, too: plans lead half as deep in small ones as can be.

    Args:
        goal: where it may have been.
        poses: in which it was seen, x, y [m] and yaw [rad], shape (n, 3).

    Returns:
        Flags, shape (n,).
    """
    region = goal.region
    deepest_m = float(region.depth(region.center)[0])
    return is_at(goal, poses, min(_VISITED_DEPTH_M, _VISITED_SHARE * deepest_m))


def stays_under_way(
    goals: Iterable[Goal], time_s: np.ndarray, paths: Mapping[str, np.ndarray]
) -> dict[str, OngoingStay]:
    """Return the longest ongoing stay at each goal, by its id.

    Args:
        goals: that still miss their visit.
        time_s: of what was seen, shape (n,).
        paths: poses of robots in service at these times, x, y [m] and yaw [rad], shape
            (n, 3) each.
    """
    found: dict[str, OngoingStay] = {}
    for goal in goals:
        for robot, path in paths.items():
            stays = runs(seen_at(goal, path))
            if not stays or stays[-1][1] < len(path):
                continue
            stayed_s = float(time_s[-1] - time_s[stays[-1][0]])
            known_s = found[goal.id].stayed_s if goal.id in found else 0.0
            if stayed_s > known_s:
                found[goal.id] = OngoingStay(robot, stayed_s)
    return found


def keeps_stays(visits: Iterable[Visit], stays: Mapping[str, OngoingStay]) -> bool:
    """Return whether all stays end where, and by whom, they were begun.

    Args:
        visits: of a plan that begins with the ongoing stays.
        stays: by goal.
    """
    begun = {(item.robot, item.target) for item in visits if item.step == 0}
    return all((stay.robot, goal) in begun for goal, stay in stays.items())
