"""Missions on bare maps: where robots, goals and stations go, and how much energy.

Everything is placed on roads a car can really drive: points of one connected area of
the free ground shrunk by a margin, near places wide enough to turn round.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from shapely.geometry import Polygon

from mrmg.errors import UsageError
from mrmg.scene.loading import scene_from_document
from mrmg.scene.loading.models import load_model, model_folder
from mrmg.scene.margins import default_margins
from mrmg.scene.populating.ground import Ground
from mrmg.scene.populating.placement import RESERVE, Placement, Sites, place_mission
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.slopes import avoided_ground
from mrmg.scene.types import Scene
from mrmg.seeding import stream

GOAL_RADIUS_M = 1.5
STATION_RADIUS_M = 2.0

_MARGINS_M = (1.3, 0.9, 0.6, 0.4)
"""Added to half the robot's width: the widest roads that span the map are used."""

_PLANNING_SLACK_M = 0.15
"""What roads have at least beyond a robot's margin from obstacles."""

_USUAL_RADIUS_M = 1.5
"""Reach of the robots that lengths here are made for; all shrink for smaller ones."""

_CELL_M, _MOST_POINTS = 0.5, 250_000
"""Spacing of the grid of places, and how many it has at most."""

_START_GAP_M = 5.0
"""Least distance of two robots at the start: either can leave first."""

_LEAST_SHARE = 0.4
"""Share of the free ground that must hang together, or the map is too narrow."""

_LEAST_CANDIDATES = 150
_CANDIDATES_PER_PLACE = 1.5
"""More candidates than are wanted leave a choice."""


def populate(
    scene: Scene,
    *,
    robots: int = 2,
    goals: int = 14,
    stations: int = 5,
    seed: int = 3,
    model: str = "car",
    trust_code: bool = False,
) -> Scene:
    """Return a scene with a mission placed on its map, in place of an earlier one.

    Args:
        scene: the map; its objective and time limit stay, too.
        robots: how many, at least one.
        goals: how many, at least one.
        stations: how many, at least one.
        seed: equal seeds place equally.
        model: of all robots: name of a shipped one, or a folder with a '/' in it.
        trust_code: whether the model may bring Python code (`loading.trust`).

    Raises:
        UsageError: if a count is below one or the map has no room for the mission.
        SceneError: if the model is invalid, or cannot climb what nothing keeps it off.
    """
    for name, count in (("robots", robots), ("goals", goals), ("stations", stations)):
        if count < 1:
            raise UsageError(f"cannot place {count} {name}; ask for at least 1")
    folder = model_folder(model, None)
    if any(obstacle.blocks is not None for obstacle in scene.obstacles):
        message = (
            "an obstacle with 'blocks' names robots that populate replaces; "
            "remove 'blocks' from the map first"
        )
        raise UsageError(message)
    robot_model, _ = load_model(folder, trust_code=trust_code)
    rng = stream(seed, "populate")
    ground = _drivable(scene, robot_model)
    wanted = robots + goals + stations
    count = max(_LEAST_CANDIDATES, math.ceil(_CANDIDATES_PER_PLACE * wanted))
    places = _candidates(ground, robot_model, count, rng)
    if len(places) < wanted:
        message = (
            f"the map has room for {len(places)} places at most, {wanted} are wanted; "
            "ask for fewer, or scale the map up"
        )
        raise UsageError(message)
    road_m = ground.between(places)
    points_m = ground.points_m[places]
    sites = Sites(
        road_m=road_m,
        climb_m=_climbs_m(scene, robot_model, points_m),
        points_m=points_m,
        start_gap_m=_START_GAP_M * _size(robot_model),
    )
    placement = place_mission(sites, robots, goals, stations, rng)
    mission = _mission(ground, places, placement, model, robot_model)
    document = {**scene.document, "margins": None, **mission}
    return scene_from_document(document, source=scene.name, trust_code=trust_code)


def _drivable(scene: Scene, model: RobotModel) -> Ground:
    """Return the ground with the widest margin that keeps most of the map together."""
    size = _size(model)
    x_min, y_min, x_max, y_max = scene.bounds
    extent_m2 = (x_max - x_min) * (y_max - y_min)
    bare = Ground.over(
        scene.bounds,
        [*(obstacle.shape for obstacle in scene.obstacles), *_too_steep(scene, model)],
        [(area.shape, area.multiplier) for area in scene.terrain],
        margin_m=0.0,
        cell_m=max(_CELL_M * size, math.sqrt(extent_m2 / _MOST_POINTS)),
    )
    kept_m = model.margins.over(default_margins(model)).obstacle_m or 0.0
    least_m = kept_m + min(1.0, size) * _PLANNING_SLACK_M
    margins_m = [max(least_m, size * margin_m) for margin_m in _MARGINS_M]
    grounds = [
        replace(bare, margin_m=model.half_width_m + margin_m) for margin_m in margins_m
    ]
    most = max(ground.largest.sum() for ground in grounds)
    share = most / max(1, (bare.clearance_m > 0.0).sum())
    if share < _LEAST_SHARE:
        message = (
            f"roads wide enough for this robot join only {100 * share:.0f} % of the "
            "map's free ground; scale the map up, or take a smaller robot (--model)"
        )
        raise UsageError(message)
    # Wide margins lose a seam along every wall; lost rooms lose much more.
    return next(ground for ground in grounds if ground.largest.sum() >= 0.6 * most)


def _size(model: RobotModel) -> float:
    """Return how large a robot is, relative to those that lengths here are for."""
    return min(1.0, model.circumscribed_radius_m / _USUAL_RADIUS_M)


def _too_steep(scene: Scene, model: RobotModel) -> list[Polygon]:
    """Return the ground that a robot of a model cannot climb."""
    robots = Scene.around(model, 1.0).robots
    ground = avoided_ground(scene.elevation, robots, scene.terrain)
    return [part.shape for part in ground]


def _climbs_m(scene: Scene, model: RobotModel, points_m: np.ndarray) -> np.ndarray:
    """Return what climbing between points adds at most [m of plain ground]."""
    if scene.elevation is None:
        return np.zeros((len(points_m), len(points_m)))
    height_m = scene.elevation.height_at(points_m)
    rise_m = np.abs(height_m[:, None] - height_m[None, :])
    return np.asarray(rise_m / model.rolling_coefficient)


def _candidates(
    ground: Ground, model: RobotModel, count: int, rng: np.random.Generator
) -> list[int]:
    """Return up to `count` grid points, spread over the ground and good to stop at.

    Wanted is room about the point, and a wide place to turn round not far away by road.
    """
    connected = ground.largest
    turning_m = model.turning_radius_m + model.half_width_m
    wide = np.flatnonzero(connected & (ground.clearance_m >= turning_m))
    near_wide = connected & (
        ground.road_to_nearest(wide) <= 4.0 * model.turning_radius_m
    )
    turnable = near_wide if near_wide.sum() >= 0.5 * connected.sum() else connected
    size = _size(model)
    for clearance_m in (3.2, 2.6, 2.0, 1.5, 0.0):
        wanted_m = max(ground.margin_m, size * clearance_m)
        good = np.flatnonzero(turnable & (ground.clearance_m >= wanted_m))
        if len(good) >= 0.25 * connected.sum():
            break
    # Many places must not crowd until goals overlap, nor be sparser than few are.
    spacing_m, sparse_m = (
        math.sqrt(len(good) * ground.cell_m**2 / number) * 0.8
        for number in (count, _LEAST_CANDIDATES)
    )
    spacing_m = max(spacing_m, min(sparse_m, 2.0 * size * GOAL_RADIUS_M))
    chosen: list[int] = []
    for index in rng.permutation(good):
        gap = ground.points_m[chosen] - ground.points_m[index]
        if not chosen or (np.hypot(gap[:, 0], gap[:, 1]) >= spacing_m).all():
            chosen.append(int(index))
        if len(chosen) == count:
            break
    return chosen


def _mission(
    ground: Ground,
    places: list[int],
    placement: Placement,
    model: str,
    robot_model: RobotModel,
) -> dict[str, Any]:
    """Return the keys of a scene file that make the mission."""

    def at(place: int) -> list[float]:
        return [round(float(value), 3) for value in ground.points_m[places[place]]]

    def regions(name: str, chosen: list[int], radius_m: float) -> list[dict[str, Any]]:
        radius = round(radius_m * _size(robot_model), 3)
        return [
            {"id": f"{name}{k}", "circle": {"center": at(p), "radius": radius}}
            for k, p in enumerate(chosen, start=1)
        ]

    top_m_s = robot_model.planned_limits.v_max_m_s
    capacity_m = placement.capacity_m * (1.0 + robot_model.consumed_per_m(top_m_s))
    return {
        "goals": regions("g", placement.goals, GOAL_RADIUS_M),
        "stations": regions("s", placement.stations, STATION_RADIUS_M),
        "battery": {"capacity_m": round(capacity_m, 1), "reserve": RESERVE},
        "robots": [
            {
                "id": f"r{k}",
                "model": model,
                "pose": [*at(p), _open_heading(ground, places[p], robot_model)],
            }
            for k, p in enumerate(placement.robots, start=1)
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
