"""Goals and finishes with less room for bodies than plans need, in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrmg.compared import compared
from mrmg.planning.endings import LITTLE_ROOM
from mrmg.planning.problem.openings import least_margin_m
from mrmg.planning.problem.targets import poses_at, target_arrays
from mrmg.planning.roadmap.fleet import margins_of
from mrmg.planning.room import words_on
from mrmg.planning.standing import roomiest_pose
from mrmg.scene.margins import Margins
from mrmg.scene.types import Robot, Scene, Station

ACCURACY_M = 0.001
"""How exactly the room at a place is known."""


def little_room(scene: Scene, margins: Margins) -> Iterator[str]:
    """Yield sentences on goals and finishes with less room than plans need.

    Plans enter places deeper than need be, keep to a part of the tolerance of headings,
    and keep certified minima from obstacles, but at starts.

    Args:
        scene: the mission.
        margins: stated for all robots.
    """
    targets, everybody = target_arrays(scene), scene.robots
    finishes = [(robot.finish, (robot,)) for robot in everybody if robot.finish]
    wanted = [*((place, everybody) for place in scene.targets()), *finishes]
    for number, (place, robots) in enumerate(wanted):
        if isinstance(place, Station):
            continue
        found: list[tuple[float, float, Robot]] = []
        poses = poses_at(targets, number)
        middle = np.array([place.region.center])
        depth_m = (place.region.depth(middle) - poses.region.depth(middle)).item()
        for robot in robots:
            least_m = least_margin_m(robot, margins_of(robot, margins)[0])
            if (place.region.depth(np.array([robot.pose[:2]])) >= 0.0).any():
                break
            best = roomiest_pose(scene, robot, poses, least_m, ACCURACY_M)
            most_m = best.most_m if best else 0.0
            if most_m >= least_m:
                break
            found.append((most_m - least_m, least_m, robot))
        else:
            lack_m, least_m, robot = max(found, key=lambda one: one[0])
            most, least = compared(lack_m + least_m, least_m, 2)
            yield LITTLE_ROOM.format(
                most=most,
                least=least,
                depth_m=depth_m,
                **words_on(robot, place),
            )
