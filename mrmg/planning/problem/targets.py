"""Where robots must go, as arrays: goals, stations and finishes, and gates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.planning.problem._region_kernels import REGION, Zones
from mrmg.planning.problem._target_kernels import TARGET, Targets
from mrmg.planning.roadmap.vertices import planned_regions
from mrmg.planning.standing import Poses
from mrmg.scene.margins import LEAST_DEFAULT_M, tracking_error
from mrmg.scene.region import Region
from mrmg.scene.types import Finish, Scene, Station

ERRORS_DEEP = 3.0
"""How deep inside a region the planner drives, so that a tracked path enters it too, as
a multiple of the disturbed tracking error of the robot that strays most ..."""

LEAST_DEPTH_M, MOST_DEPTH_M = LEAST_DEFAULT_M, 0.12
"""... within these bounds [m]; cars have always driven 0.12 m deep."""

GATE_MARGIN_M = 0.3
"""How far from a station for one robot others stay, so that tracked paths do, too."""

HEADING_SHARE = 0.8
"""Share of a heading's tolerance that planning uses."""

LONGER_S = 0.5
"""How much longer than asked for robots stay, so that one that lags stays enough."""


def finish_of(scene: Scene) -> np.ndarray:
    """Return the target in which each robot must end, -1 for none, shape (R,)."""
    must = np.array([robot.finish is not None for robot in scene.robots], bool)
    return np.where(must, len(scene.targets()) + np.cumsum(must) - 1, -1)


def whole_tours(targets: Targets, tours: Sequence[Sequence[int]]) -> list[list[int]]:
    """Return the numbers of each robot's targets; where it must end comes last."""
    return [
        [*tour, *([int(finish)] if finish >= 0 else [])]
        for tour, finish in zip(tours, targets.finish, strict=True)
    ]


def target_depth_m(scene: Scene) -> float:
    """Return how deep inside its targets a fleet drives, at least [m]."""
    errors_m = [tracking_error(robot.model).disturbed_m for robot in scene.robots]
    wanted_m = round(ERRORS_DEEP * max(errors_m), 3)
    return min(max(wanted_m, LEAST_DEPTH_M), MOST_DEPTH_M)


def target_arrays(scene: Scene) -> Targets:
    """Return goals, stations and finishes as the planner enters them."""
    depth_m = target_depth_m(scene)
    regions = planned_regions(scene)
    shrunk = [_moved_corners(one, -depth_m) for one in regions]
    radius_m = [max(one.radius_m - depth_m, 0.5 * one.radius_m) for one in regions]
    target = np.zeros(len(regions), TARGET)
    corner = _fill_in(target, regions, shrunk, radius_m)
    target["tolerance"], target["zone"] = 2.0 * np.pi, -1
    gates = {station.id: i for i, station in enumerate(_exclusive(scene))}
    finishes = [robot.finish for robot in scene.robots if robot.finish]
    for own, place in zip(target, [*scene.targets(), *finishes], strict=True):
        if not isinstance(place, Station) and place.heading_rad is not None:
            own["heading"] = place.heading_rad
            own["tolerance"] = HEADING_SHARE * place.heading_tolerance_rad
        if not isinstance(place, Finish):
            own["zone"] = gates.get(place.id, -1)
            if place.dwell_s > 0.0:
                own["dwell"] = place.dwell_s + LONGER_S
    return Targets(
        goals=len(scene.goals),
        places=len(scene.targets()),
        finish=finish_of(scene),
        target=target,
        corner=corner,
    )


def poses_at(targets: Targets, target: int) -> Poses:
    """Return the poses in which a robot visits a target; its own one is in the middle.

    Where the heading is free, it is 0.
    """
    own = targets.target[target]
    corners = targets.corner[target, : own["corners"]]
    radius_m = 0.0 if own["corners"] else float(own["reach"])
    region = Region(center=own["center"], radius_m=radius_m, corners=corners)
    tolerance_rad = min(float(own["tolerance"]), np.pi)
    return Poses(region, float(own["heading"]), tolerance_rad)


def _moved_corners(region: Region, by_m: float) -> np.ndarray:
    """Return a polygon's corners with its sides moved out, if that leaves a polygon."""
    if len(region.corners):
        moved = region.shape.buffer(by_m, join_style="mitre")
        if not moved.is_empty and moved.geom_type == "Polygon":
            return np.asarray(moved.normalize().exterior.coords)[:-1][::-1]
    return region.corners


def _fill_in(
    record: np.ndarray,
    regions: Sequence[Region],
    outlines: Sequence[np.ndarray],
    radius_m: Sequence[float],
) -> np.ndarray:
    """Write what a `REGION` has into records; return the padded corners, (N, M, 2).

    Args:
        record: receives it, shape (N,).
        regions: give the middles.
        outlines: corners of each one, shape (n, 2); none of a circle.
        radius_m: of those that are circles.
    """
    corner = np.zeros((len(regions), max([3, *map(len, outlines)]), 2))
    for i, (region, outline) in enumerate(zip(regions, outlines, strict=True)):
        corner[i, : len(outline)] = outline
        reach = np.hypot(*(outline - region.center).T).max(initial=0.0)
        record[i]["center"], record[i]["corners"] = region.center, len(outline)
        record[i]["reach"] = reach if len(outline) else radius_m[i]
    return corner


def _exclusive(scene: Scene) -> list[Station]:
    return [station for station in scene.stations if station.one_at_a_time]


def gate_arrays(scene: Scene) -> Zones:
    """Return the stations for one robot at a time, a margin wider than they are."""
    regions = [station.region for station in _exclusive(scene)]
    outlines = [_moved_corners(region, GATE_MARGIN_M) for region in regions]
    zone = np.zeros(len(regions), REGION)
    radius_m = [region.radius_m + GATE_MARGIN_M for region in regions]
    return Zones(zone, _fill_in(zone, regions, outlines, radius_m))
