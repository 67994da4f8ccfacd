"""Places that robots have no room at, or no way to, in words."""

from __future__ import annotations

from collections.abc import Sequence

from shapely.geometry import Point

from mrmg.planning.endings import FINISH_CUT_OFF, GOAL_CUT_OFF, NO_ROOM
from mrmg.planning.free_ground import FreeGround, bottleneck
from mrmg.planning.path_bounds import outer_polygon
from mrmg.planning.standing import Poses, roomiest_pose
from mrmg.scene.region import Region
from mrmg.scene.types import Finish, Goal, Robot, Scene

MOST_LOOKED_AT = 4
"""Robots for which gaps are measured at most."""


def goal_cut_off(scene: Scene, goal: Goal) -> str:
    """Return the sentence on a goal that no robot gets to."""
    gap = _widest_gap(scene, scene.robots, goal.region)
    return GOAL_CUT_OFF.format(goal=goal.id, gap=gap)


def finish_cut_off(scene: Scene, robot: Robot) -> str:
    """Return the sentence on a robot that does not get to its finish."""
    assert robot.finish is not None
    gap = _widest_gap(scene, [robot], robot.finish.region)
    return FINISH_CUT_OFF.format(robot=robot.id, gap=gap)


def _widest_gap(scene: Scene, robots: Sequence[Robot], region: Region) -> str:
    """Return in words how wide the widest gap on the way to a region is, and where.

    Args:
        scene: the mission.
        robots: that cannot get there; the one that lacks least is named.
        region: where they are to get.
    """
    wanted = outer_polygon(region)
    kinds = {(robot.model.name, robot.pose): robot for robot in robots}
    found: list[tuple[float, str]] = []
    for robot in [*kinds.values()][:MOST_LOOKED_AT]:
        half_m = robot.model.half_width_m
        start, ground = Point(*robot.pose[:2]), FreeGround.of(scene, robot)
        gap = bottleneck(ground, start, wanted, half_m)
        if gap is not None and gap.width_m < 2.0 * half_m:
            text = f"the widest one is {gap}, {robot.id} is {2.0 * half_m:.2f} m wide"
            found.append((2.0 * half_m - gap.width_m, text))
        elif gap is not None:
            return ""
    return f": {min(found)[1]}" if found else ": there is none at all"


def no_room(scene: Scene, robot: Robot, place: Goal | Finish) -> str:
    """Return a proof that a robot has no room at a place; "" if there is none.

    Args:
        scene: the mission.
        robot: that may get there.
        place: a goal, which names no robot in it, or the robot's finish.
    """
    if roomiest_pose(scene, robot, Poses.at(place)) is not None:
        return ""
    return NO_ROOM.format(**words_on(robot, place))


def words_on(robot: Robot, place: Goal | Finish) -> dict[str, str]:
    """Return what sentences on a robot at a place say: names, and what would help."""
    free = place.heading_rad is None
    more = "more room" if free else "another heading, a larger heading_tolerance or "
    names = f"the finish of {robot.id}", robot.id
    if isinstance(place, Goal):
        names = f"goal {place.id}", "a robot"
    return {
        "place": names[0],
        "robot": names[1],
        "heading": "" if free else " with the heading wanted there",
        "remedy": more if free else f"{more}more room",
    }
