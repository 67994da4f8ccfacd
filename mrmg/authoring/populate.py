"""Missions on bare maps: where robots, goals and stations go, and how much energy.

Everything is placed on roads a car can really drive: points of one connected area of
the free ground shrunk by a margin, near places wide enough to turn round. Stations are
spread by k-medoids over the road distances, goals by farthest-point sampling, and the
robots start near each other at one end of the map. The capacity is then chosen between
two bounds: large enough that every goal and station can be reached from another
station, and so small that no plan can do without recharging.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrmg import shipped
from mrmg.authoring.ground import Ground
from mrmg.errors import UsageError
from mrmg.scene.loading import scene_from_document
from mrmg.scene.loading.models import load_model
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.seeding import stream

GOAL_RADIUS_M = 1.5
STATION_RADIUS_M = 2.0
RESERVE = 0.05

_MARGINS_M = (1.3, 0.9, 0.6, 0.4)
"""Added to half the robot's width: the widest roads that span the map are used."""

_START_GAP_M = 5.0
"""Least distance of two robots at the start: either can leave first."""

_ATTEMPTS = 40
_CANDIDATES = 150


@dataclass(frozen=True)
class _Placement:
    """Indices of candidates, and the capacity that suits them [m of plain ground]."""

    robots: list[int]
    goals: list[int]
    stations: list[int]
    capacity_m: float


def populate(
    document: dict[str, Any],
    *,
    robots: int = 2,
    goals: int = 14,
    stations: int = 5,
    seed: int = 3,
    model: str = "car",
) -> dict[str, Any]:
    """Place a mission on a map; an earlier one in the document is replaced.

    Args:
        document: a scene document; bounds, obstacles and terrain are used.
        robots: how many, at least one.
        goals: how many, at least one.
        stations: how many, at least one.
        seed: equal seeds place equally.
        model: name of the shipped model all robots are of.

    Returns:
        A scene document with the mission.

    Raises:
        UsageError: if a count is below one or the map has no room for the mission.
        SceneError: if the document is no valid scene.
    """
    for name, count in (("robots", robots), ("goals", goals), ("stations", stations)):
        if count < 1:
            raise UsageError(f"cannot place {count} {name}; ask for at least 1")
    if model not in shipped.model_names():
        allowed = ", ".join(shipped.model_names())
        raise UsageError(f"unknown model '{model}'; shipped models: {allowed}")
    kept = ("format", "name", "bounds", "obstacles", "terrain")
    bare = {key: document[key] for key in kept if key in document}
    for obstacle in bare.get("obstacles", []):
        if "blocks" in obstacle:
            message = (
                "an obstacle with 'blocks' names robots that populate replaces; "
                "remove 'blocks' from the map first"
            )
            raise UsageError(message)
    scene = scene_from_document(bare, source=str(document.get("name", "the map")))
    robot_model, _ = load_model(shipped.models_folder() / model)
    rng = stream(seed, "populate")
    ground = _drivable(scene, robot_model)
    places = _candidates(ground, robot_model, rng)
    wanted = robots + goals + stations
    if len(places) < wanted:
        message = (
            f"the map has room for {len(places)} places at most, {wanted} are wanted; "
            "ask for fewer, or scale the map up"
        )
        raise UsageError(message)
    road_m = ground.distances(places)[:, places]
    placement = _place(road_m, ground.points_m[places], robots, goals, stations, rng)
    return _document(bare, ground, places, placement, model, robot_model)


def _drivable(scene: Scene, model: RobotModel) -> Ground:
    """Return the ground with the widest margin that keeps most of the map together."""
    grounds = [
        Ground.over(
            scene.bounds,
            [obstacle.shape for obstacle in scene.obstacles],
            [(area.shape, area.multiplier) for area in scene.terrain],
            margin_m=model.half_width_m + margin_m,
        )
        for margin_m in _MARGINS_M
    ]
    sizes = [_largest(ground).sum() for ground in grounds]
    # Wide margins lose a seam along every wall; lost rooms lose much more.
    return next(
        ground
        for ground, size in zip(grounds, sizes, strict=True)
        if size >= 0.6 * max(sizes)
    )


def _largest(ground: Ground) -> np.ndarray:
    """Return the mask of the largest connected free area."""
    labels = ground.component[ground.free]
    if not len(labels):
        message = "no robot of this model fits on the map; scale the map up"
        raise UsageError(message)
    return np.asarray(ground.component == np.bincount(labels).argmax())


def _candidates(
    ground: Ground, model: RobotModel, rng: np.random.Generator
) -> list[int]:
    """Return grid points that are spread over the ground and good to stop at.

    Wanted is room about the point, and a wide place to turn round not far away by road.
    """
    connected = _largest(ground)
    turning_m = model.turning_radius_m + model.half_width_m
    wide = np.flatnonzero(connected & (ground.clearance_m >= turning_m))
    near_wide = connected & (
        ground.road_to_nearest(wide) <= 4.0 * model.turning_radius_m
    )
    turnable = near_wide if near_wide.sum() >= 0.5 * connected.sum() else connected
    for clearance_m in (2.6, 2.0, 1.5, ground.margin_m):
        good = np.flatnonzero(turnable & (ground.clearance_m >= clearance_m))
        if len(good) >= 0.25 * connected.sum():
            break
    spacing_m = math.sqrt(len(good) * ground.cell_m**2 / _CANDIDATES) * 0.8
    chosen: list[int] = []
    for index in rng.permutation(good):
        gap = ground.points_m[chosen] - ground.points_m[index]
        if not chosen or (np.hypot(gap[:, 0], gap[:, 1]) >= spacing_m).all():
            chosen.append(int(index))
        if len(chosen) == _CANDIDATES:
            break
    return chosen


def _place(
    road_m: np.ndarray,
    points_m: np.ndarray,
    robots: int,
    goals: int,
    stations: int,
    rng: np.random.Generator,
) -> _Placement:
    """Return the first placement whose two bounds on the capacity leave room."""
    for _ in range(_ATTEMPTS):
        starts = _depot(road_m, points_m, robots, rng)
        if len(starts) < robots:
            continue
        free = [i for i in range(len(road_m)) if i not in starts]
        posts = [free[i] for i in _medoids(road_m[np.ix_(free, free)], stations, rng)]
        rest = [i for i in free if i not in posts]
        sites = _spread(road_m, rest, [*starts, *posts], goals)
        least = _least_capacity_m(road_m, starts, sites, posts)
        most = _most_capacity_m(road_m, starts, sites)
        if least <= most:
            capacity_m = max(least, 0.8 * most)
            return _Placement(starts, sites, posts, math.ceil(capacity_m))
    message = (
        f"found no mission of {robots} robots, {goals} goals and {stations} stations "
        "that needs recharging and stays feasible; ask for more stations"
    )
    raise UsageError(message)


def _depot(
    road_m: np.ndarray, points_m: np.ndarray, robots: int, rng: np.random.Generator
) -> list[int]:
    """Return places near each other at one end of the map, one for each robot."""
    eccentricity = road_m.max(axis=1)
    ends = np.flatnonzero(eccentricity >= np.quantile(eccentricity, 0.7))
    first = int(rng.choice(ends))
    starts: list[int] = []
    for index in np.argsort(road_m[first], kind="stable"):
        gap = points_m[starts] - points_m[index]
        if len(starts) < robots and (np.hypot(*gap.T) >= _START_GAP_M).all():
            starts.append(int(index))
    return starts


def _medoids(road_m: np.ndarray, count: int, rng: np.random.Generator) -> list[int]:
    """Return `count` places that serve all others well (k-medoids)."""
    medoids = [int(rng.integers(len(road_m)))]
    while len(medoids) < count:
        medoids.append(int(road_m[medoids].min(axis=0).argmax()))
    for _ in range(20):
        owner = road_m[medoids].argmin(axis=0)
        moved = [
            # The centre of a cluster: least worst distance to its members.
            int(members[road_m[np.ix_(members, members)].max(axis=1).argmin()])
            for members in (np.flatnonzero(owner == k) for k in range(count))
        ]
        if moved == medoids:
            break
        medoids = moved
    return medoids


def _spread(
    road_m: np.ndarray, allowed: Sequence[int], taken: Sequence[int], count: int
) -> list[int]:
    """Return `count` of the allowed places, far from the taken ones and each other."""
    sites: list[int] = []
    pool = np.array(allowed)
    for _ in range(count):
        near = road_m[[*taken, *sites]][:, pool].min(axis=0)
        best = int(near.argmax())
        sites.append(int(pool[best]))
        pool = np.delete(pool, best)
    return sites


def _least_capacity_m(
    road_m: np.ndarray, starts: list[int], sites: list[int], posts: list[int]
) -> float:
    """Return a capacity with which every goal can be served, with room to spare."""
    to_post = road_m[np.ix_(sites, posts)].min(axis=1).max()
    from_start = road_m[np.ix_(starts, posts)].min(axis=1).max()
    return float(
        max(to_post / 0.38, from_start / 0.6, _widest_gap(road_m, posts) / 0.7)
    )


def _widest_gap(road_m: np.ndarray, posts: list[int]) -> float:
    """Return the longest leg one must drive to get from any station to any other."""
    between = road_m[np.ix_(posts, posts)]
    joined, widest = [0], 0.0
    while len(joined) < len(posts):
        apart = [k for k in range(len(posts)) if k not in joined]
        legs = between[np.ix_(joined, apart)]
        widest = max(widest, float(legs.min()))
        joined.append(apart[int(legs.min(axis=0).argmin())])
    return widest


def _most_capacity_m(road_m: np.ndarray, starts: list[int], sites: list[int]) -> float:
    """Return a capacity with which no plan does without recharging.

    Either some goal is out of reach of every robot, or all batteries together fall
    short of the spanning forest of the goals, rooted at the robots.
    """
    reach = road_m[np.ix_(starts, sites)].min(axis=0)
    away, forest_m = list(range(len(sites))), 0.0
    near = reach.copy()
    while away:
        closest = min(away, key=lambda k: near[k])
        forest_m += near[closest]
        away.remove(closest)
        near = np.minimum(near, road_m[sites[closest], sites])
    return 0.9 * max(float(reach.max()), forest_m / len(starts)) / (1.0 - RESERVE)


def _document(
    bare: dict[str, Any],
    ground: Ground,
    places: list[int],
    placement: _Placement,
    model: str,
    robot_model: RobotModel,
) -> dict[str, Any]:
    def at(place: int) -> list[float]:
        return [round(float(value), 3) for value in ground.points_m[places[place]]]

    def regions(name: str, chosen: list[int], radius_m: float) -> list[dict[str, Any]]:
        return [
            {"id": f"{name}{k + 1}", "circle": {"center": at(p), "radius": radius_m}}
            for k, p in enumerate(chosen)
        ]

    return {
        **bare,
        "goals": regions("g", placement.goals, GOAL_RADIUS_M),
        "stations": regions("s", placement.stations, STATION_RADIUS_M),
        "battery": {"capacity_m": float(placement.capacity_m), "reserve": RESERVE},
        "robots": [
            {
                "id": f"r{k + 1}",
                "model": model,
                "pose": [*at(p), _open_heading(ground, places[p], robot_model)],
            }
            for k, p in enumerate(placement.robots)
        ],
    }


def _open_heading(ground: Ground, index: int, model: RobotModel) -> float:
    """Return the heading [rad] with the most clearance along the robot and ahead."""
    start = ground.points_m[index]
    ahead_m = np.arange(
        model.footprint_m[:, 0].min(), 3.0 * model.footprint_m[:, 0].max(), 0.5
    )
    headings = np.round(np.arange(16) * math.pi / 8, 4)
    along = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    points = start + ahead_m[None, :, None] * along[:, None, :]
    clearance = [min(ground.clearance_at(row)) for row in points]
    return float(headings[int(np.argmax(clearance))])
