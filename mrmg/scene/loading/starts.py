"""Whether robots may stand where they start."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
import shapely
from shapely.geometry import Polygon

from mrmg.errors import Fault
from mrmg.scene.types import Obstacle, Robot, Station


def misplaced_robots(
    robots: Sequence[Robot],
    places: Mapping[str, str],
    bounds: tuple[float, float, float, float] | None,
    barriers: Sequence[Obstacle],
) -> Iterator[Fault]:
    """Yield a fault for each robot that starts outside the bounds or on an obstacle.

    Args:
        robots: of the scene.
        places: of their poses in its file, by id.
        bounds: of the scene; None where the file states none that hold.
        barriers: obstacles of the scene, and ground too steep.
    """
    for robot in robots:
        where, shape = places[robot.id], _footprint(robot)
        if bounds and not shapely.box(*bounds).covers(shape):
            message = f"{robot.id} starts outside the bounds {list(bounds)}"
            yield Fault(where, message)
        stopping = [wall for wall in barriers if wall.stops(robot.id)]
        below = [wall for wall in stopping if wall.shape.intersects(shape)]
        for wall in below:
            if not wall.is_steep_ground:
                yield Fault(where, f"{robot.id} starts on the obstacle '{wall.id}'")
        if any(wall.is_steep_ground for wall in below):
            yield Fault(where, f"{robot.id} starts on ground too steep for it")


def crowded_robots(
    robots: Sequence[Robot], places: Mapping[str, str], stations: Sequence[Station]
) -> Iterator[Fault]:
    """Yield a fault for each two robots that cannot both start where they do."""
    for first, second in combinations(robots, 2):
        if _footprint(first).intersects(_footprint(second)):
            message = f"{second.id} starts where {first.id} stands"
            yield Fault(places[second.id], message)
        both = np.array([first.pose[:2], second.pose[:2]])
        for station in stations:
            if station.one_at_a_time and (station.region.depth(both) >= 0.0).all():
                message = (
                    f"{first.id} and {second.id} both start in {station.id}, which "
                    "is for one robot at a time"
                )
                yield Fault(places[second.id], message)


def _footprint(robot: Robot) -> Polygon:
    return Polygon(robot.model.footprint_at(robot.pose))
