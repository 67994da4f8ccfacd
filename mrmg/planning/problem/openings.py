"""Openings: passages that only a smaller margin opens, and where that margin counts.

Of the narrow places of a map (`free_ground`) those count that lie on the way to a
target that there is no wide way to, and where robots start beside walls.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry

from mrmg.planning.free_ground import Bottleneck, FreeGround, bottleneck
from mrmg.planning.problem._clearance_kernels import keeps_clear
from mrmg.planning.problem.targets import target_depth_m
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS, Spaces
from mrmg.planning.roadmap.fleet import PASSAGE_SLACK_M, margins_of
from mrmg.planning.roadmap.vertices import planned_regions
from mrmg.scene.margins import Margins, certified_minimum_m
from mrmg.scene.region import Region
from mrmg.scene.types import Robot, Scene
from mrmg.world.world import CELL_M, Opening

LEVELS = 8
"""Margins that are tried, from the wanted one down to the certified minimum."""

STEERING_M = 0.04
"""Room on each side of an opening, beyond half the robot and the margin, within which
planned motions stray from its middle."""

RASTER_SHARE = 0.6
"""Share of a cell by which distances between cells are read too small, at most."""

LEAST_CELL_M = 0.05
"""Side of the cells of the distance field of a map with openings [m]."""

MOST_CELLS = 4_000_000
"""Cells of a distance field at most."""


def entered(scene: Scene, region: Region) -> BaseGeometry:
    """Return where a region counts as entered for planning."""
    inner = region.shape.buffer(-target_depth_m(scene), join_style="mitre")
    return region.shape.centroid if inner.is_empty else inner


def openings_to(
    scene: Scene, margins: Margins, wanted: Sequence[tuple[int, int]]
) -> tuple[Opening, ...]:
    """Return the openings on the ways to targets that no wide way leads to.

    Args:
        scene: the mission.
        margins: stated for all robots.
        wanted: numbers of robots, and of targets that they may have to get to.
    """
    regions = planned_regions(scene)
    found: list[Opening] = []
    for number, target in wanted:
        robot, region = scene.robots[number], entered(scene, regions[target])
        ground, start = FreeGround.of(scene, robot), Point(*robot.pose[:2])
        margin_m = margins_of(robot, margins)[0]
        wide_m = wide_clearance_m(robot, margin_m)
        if ground.reaches(start, region, wide_m):
            continue
        for level_m in np.linspace(margin_m, least_margin_m(robot, margin_m), LEVELS):
            needed_m = clearance_needed_m(robot, float(level_m))
            if ground.reaches(start, region, needed_m):
                found += [
                    _opening(
                        narrow, robot, [number], margin_m - level_m, wide_m - needed_m
                    )
                    for narrow in ground.narrows(start, region, needed_m, wide_m)
                ]
                break
    return tuple(dict.fromkeys(found))


def tightest_openings(scene: Scene, margins: Margins) -> tuple[Opening, ...]:
    """Return all ground that is too narrow to turn in, at the certified minimum.

    That is passages, and where robots start and have to get to.

    Args:
        scene: the mission.
        margins: stated for all robots.
    """
    found: list[Opening] = []
    regions = [entered(scene, region) for region in planned_regions(scene)]
    everybody = range(len(scene.robots))
    for margin_m, least_m, numbers in _robots_alike(scene, margins, everybody):
        robot = scene.robots[numbers[0]]
        wide_m = robot.model.circumscribed_radius_m + margin_m
        needed_m = min(clearance_needed_m(robot, least_m), wide_m)
        ground = FreeGround.of(scene, robot)
        wide = shapely.union_all(ground.pieces(wide_m))
        places = [*regions, *(Point(*scene.robots[n].pose[:2]) for n in numbers)]
        pieces = [
            *ground.narrow_pieces(needed_m, wide_m),
            *(place for place in places if not place.intersects(wide)),
        ]
        if pieces and least_m < margin_m:
            narrow, lacking_m = shapely.union_all(pieces), wide_m - needed_m
            found.append(
                _opening(narrow, robot, numbers, margin_m - least_m, lacking_m)
            )
    return tuple(found)


def _robots_alike(
    scene: Scene, margins: Margins, numbers: Iterable[int]
) -> Iterator[tuple[float, float, list[int]]]:
    """Yield wanted and least margin, and those numbers, of robots of equal ground."""
    alike: dict[tuple[float, float, Hashable], list[int]] = {}
    for number in numbers:
        robot = scene.robots[number]
        margin_m = margins_of(robot, margins)[0]
        sizes_m = robot.model.half_width_m, robot.model.circumscribed_radius_m
        stopping = tuple(i for i, o in enumerate(scene.barriers) if o.stops(robot.id))
        key = margin_m, least_margin_m(robot, margin_m), (sizes_m, stopping)
        alike.setdefault(key, []).append(number)
    for (margin_m, least_m, _), numbers in alike.items():
        yield margin_m, least_m, numbers


def cell_m(scene: Scene, margins: Margins, wanted_m: float = CELL_M) -> float:
    """Return the side of the cells of a scene's distance field.

    Half a robot's width with its margin exceeds a cell, as far as memory allows.
    """
    reaches_m = [
        robot.model.half_width_m + margins_of(robot, margins)[0]
        for robot in scene.robots
    ]
    x_min, y_min, x_max, y_max = scene.bounds
    least_m = ((x_max - x_min) * (y_max - y_min) / MOST_CELLS) ** 0.5
    return max(min(wanted_m, *reaches_m, CELL_M), least_m if wanted_m < CELL_M else 0.0)


def guide_m(cell_m: float) -> float:
    """Return what distances in openings count for besides their allowances.

    Robots stray as much from an opening's middle as from that of a wide way, but it is
    known how far; and distances between cells are read too small.
    """
    return max(0.0, PASSAGE_SLACK_M - STEERING_M) + RASTER_SHARE * cell_m


def clearance_needed_m(robot: Robot, margin_m: float) -> float:
    """Return the clearance of the middle of an opening that a robot drives through."""
    return robot.model.half_width_m + margin_m + STEERING_M


def wide_clearance_m(robot: Robot, margin_m: float) -> float:
    """Return the clearance from which on ground is wide for the roadmap's raster."""
    passage_m = robot.model.half_width_m + margin_m + PASSAGE_SLACK_M
    return passage_m + RASTER_SHARE * CELL_M


def least_margin_m(robot: Robot, margin_m: float) -> float:
    """Return the least margin that a robot's openings are driven with."""
    return min(margin_m, certified_minimum_m(robot.model))


def cramped_starts(fleet: np.ndarray, spaces: Spaces, start: np.ndarray) -> list[int]:
    """Return the robots that start nearer to obstacles than their margins.

    Args:
        fleet: the robots, shape (R,).
        spaces: their free spaces.
        start: their states, shape (R, 5).
    """
    corner = np.empty((MOST_CORNERS, 2))
    return [
        r
        for r in range(len(fleet))
        if not keeps_clear(
            fleet[r : r + 1], spaces, start[r], fleet[r]["margin"], corner
        )
    ]


def openings_at_starts(
    scene: Scene, margins: Margins, numbers: Iterable[int]
) -> Iterator[Opening]:
    """Yield the openings about the starts of robots that stand beside walls.

    Robots that are alike have one in common, so that they go on sharing a roadmap.

    Args:
        scene: the mission.
        margins: stated for all robots.
        numbers: of the robots that are looked at.
    """
    for margin_m, least_m, alike in _robots_alike(scene, margins, numbers):
        ground = FreeGround.of(scene, scene.robots[alike[0]])
        starts, level_m = [], margin_m
        for robot in (scene.robots[number] for number in alike):
            start = Point(*robot.pose[:2])
            body = Polygon(robot.model.footprint_at(robot.pose))
            gap_m = ground.clearance_m(body)
            wide_m = wide_clearance_m(robot, margin_m)
            if gap_m < margin_m or ground.clearance_m(start) < wide_m:
                starts.append(start)
                level_m = min(level_m, max(gap_m - STEERING_M, least_m))
        if starts:
            yield _opening(
                shapely.MultiPoint(starts),
                robot,
                alike,
                margin_m - level_m,
                wide_m - clearance_needed_m(robot, level_m),
            )


def _opening(
    narrow: BaseGeometry,
    robot: Robot,
    numbers: Sequence[int],
    allowance_m: float,
    lacking_m: float,
) -> Opening:
    """Return the opening of narrow ground.

    Args:
        narrow: the ground.
        robot: one that drives through.
        numbers: of all that do.
        allowance_m: by how much what they keep there is less than their margin.
        lacking_m: by how much the clearance there is less than that of wide ground.
    """
    return Opening(
        shape=narrow.buffer(robot.model.circumscribed_radius_m + lacking_m),
        allowance_m=float(allowance_m),
        robots=tuple(numbers),
    )


def passages_missing(
    scene: Scene,
    margins: Margins,
    wanted: Sequence[tuple[int, int]],
    on_the_map: Callable[[tuple[float, float]], tuple[float, float]],
) -> list[str]:
    """Return in words what keeps robots from targets: passages, how wide and where.

    Args:
        scene: the mission in the frame that is planned in.
        margins: stated for all robots.
        wanted: numbers of robots, and of targets that they know no path to; of each
            target the robot that lacks least is named.
        on_the_map: returns where a point of the frame is [m].
    """
    least: dict[int, tuple[float, str]] = {}
    regions = planned_regions(scene)
    for number, target in wanted[:MOST_MEASURED]:
        robot, region = scene.robots[number], regions[target]
        unit_m = robot.model.unit_m
        ground = FreeGround.of(scene, robot)
        start = Point(*robot.pose[:2])
        kept_m = least_margin_m(robot, margins_of(robot, margins)[0])
        needed_m = clearance_needed_m(robot, kept_m)
        gap = bottleneck(ground, start, entered(scene, region), needed_m)
        clear_m = ground.clearance_m(start)
        if gap is not None and clear_m < min(needed_m, 0.5 * gap.width_m):
            gap = Bottleneck(2.0 * clear_m, start.x, start.y)
        if gap is None:
            lacking_m, text = 2.0 * needed_m, f"there is no way at all for {robot.id}"
        elif gap.width_m >= 2.0 * needed_m:
            lacking_m = 0.0
            text = f"{robot.id} has ways wide enough that no samples of the map joined"
        else:
            lacking_m = 2.0 * needed_m - gap.width_m
            gap = Bottleneck(gap.width_m * unit_m, *on_the_map((gap.x_m, gap.y_m)))
            text = (
                f"the widest way of {robot.id} leads through a passage {gap}, and it "
                f"needs {2.0 * needed_m * unit_m:.2f} m: its width of "
                f"{2.0 * robot.model.half_width_m * unit_m:.2f} m, and on each side a "
                f"margin of at least {kept_m * unit_m:.3f} m and "
                f"{STEERING_M * unit_m:g} m to steer"
            )
        least[target] = min(least.get(target, (np.inf, "")), (lacking_m, text))
    return [*dict.fromkeys(text for _, text in least.values())]


MOST_MEASURED = 8
"""Ways that are measured at most."""
