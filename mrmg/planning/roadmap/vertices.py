"""Where the vertices of a roadmap lie."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

import numpy as np
import shapely

from mrmg.planning.roadmap.fleet import TravelClass
from mrmg.scene.region import Region
from mrmg.scene.types import Robot, Scene
from mrmg.world._kernels import FreeSpace
from mrmg.world.world import World

SPREAD = np.array([0.7548776662466927, 0.5698402909980532])
"""Steps of the R2 sequence (Roberts 2018): 1/p, 1/p^2 with p^3 = p + 1. From a random
start it covers the square evenly; scipy's own sequences take 0.6 s to import."""

ENTRY_DEPTH_M = 0.3
"""How deep inside a region a vertex lies that stands for having entered it [m]."""

OPENING_SPACING_M = 0.3
"""Distance of the vertices in the middle of openings [m]."""

NARROW_M = 2.5
"""Clearance below which the middle of a place gets vertices of its own [m]."""


ANCHOR_SLACK = 0.75
"""Cells by which a target's middle must have more clearance than a way needs: between
cells distances are read too small by that much."""

FARTHEST_M = 4.0
"""Way straight out of a narrow place within which a robot looks for room, ..."""

STEP_M = 0.1
"""... and the distance of the places that are looked at."""


def planned_regions(scene: Scene) -> list[Region]:
    """Return the regions the planner numbers: goals, stations, finishes of robots."""
    finishes = [robot.finish.region for robot in scene.robots if robot.finish]
    return [*(target.region for target in scene.targets()), *finishes]


def reach_m(region: Region) -> float:
    """Return the radius of a region about its centre [m]."""
    if len(region.corners):
        return float(np.hypot(*(region.corners - region.center).T).max())
    return region.radius_m


def roadmap_vertices(
    scene: Scene,
    world: World,
    classes: Sequence[TravelClass],
    samples: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return the vertices: targets, starts, and points that some class can pass.

    Args:
        scene: the scene.
        world: its geometry.
        classes: travel classes of its robots.
        samples: number of free samples tried.
        rng: source of the samples.
    """
    low, high = np.array(scene.bounds).reshape(2, 2)
    first, regions = classes[0], planned_regions(scene)
    fixed = [_anchor(world.spaces[first.space], first.passage, one) for one in regions]
    fixed += [np.array(robot.pose[:2]) for robot in scene.robots]
    unit = (rng.random(2) + np.arange(samples)[:, None] * SPREAD) % 1.0
    spread = unit * (high - low) + low
    passage = min(item.passage for item in classes)
    rings = [
        *(
            union.simplify(0.05).buffer(passage + 0.15, quad_segs=2)
            for union in world.obstacles
        ),
        *(area.shape.buffer(0.3, quad_segs=1) for area in scene.terrain),
        *(area.shape.buffer(-0.3, quad_segs=1) for area in scene.terrain),
    ]
    corners = shapely.get_coordinates(
        [shapely.segmentize(ring, 8.0) for ring in rings if not ring.is_empty]
    )
    ridges = [_ridge(world.spaces[item.space]) for item in classes]
    inner = [_inner_points(region) for region in regions]
    loose = np.concatenate([spread, corners.reshape(-1, 2), *ridges, *inner])
    loose = loose[((loose > low) & (loose < high)).all(axis=1)]
    widest = np.max(
        [_field_at(world.spaces[item.space], loose) for item in classes], axis=0
    )
    return np.concatenate([np.array(fixed).reshape(-1, 2), loose[widest >= passage]])


def departure(
    robot: Robot, space: FreeSpace, obstacles: shapely.Geometry, passage: float
) -> np.ndarray:
    """Return where a robot that starts beside a wall first has room for a way.

    It drives there straight ahead, or back.

    Args:
        robot: the robot.
        space: its free space.
        obstacles: in its way.
        passage: clearance of its line of travel [m].

    Returns:
        Shape (1, 2), or (0, 2) if there is no such place.
    """
    pose = np.array(robot.pose)
    gears = (1.0, -1.0) if robot.model.limits.v_min_m_s < 0.0 else (1.0,)
    ways = np.arange(STEP_M, FARTHEST_M, STEP_M)[:, None] * gears
    places = np.tile(pose, (ways.size, 1))
    places[:, :2] += np.outer(ways, [cos(pose[2]), sin(pose[2])])
    room = _field_at(space, places[:, :2]) >= passage + ANCHOR_SLACK * space.cell
    for place in places[room]:
        bodies = robot.model.footprint_at([pose, place])
        swept = shapely.MultiPoint(bodies.reshape(-1, 2)).convex_hull
        if not swept.intersects(obstacles):
            return np.array([place[:2]])
    return np.zeros((0, 2))


def _inner_points(region: Region) -> np.ndarray:
    """Return points spread over a region, shape (8, 2)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * reach_m(region)
    points = region.center + 0.7 * ring
    return np.asarray(points[region.depth(points) >= ENTRY_DEPTH_M])


def _ridge(space: FreeSpace) -> np.ndarray:
    """Return points in the middle of narrow places, about one a square metre.

    They are the local maxima of the distance field along x or y; free samples seldom
    hit a corridor's middle.
    """
    d = space.distance
    inner = d[1:-1, 1:-1]
    across = (inner >= d[1:-1, :-2]) & (inner > d[1:-1, 2:])
    along = (inner >= d[:-2, 1:-1]) & (inner > d[2:, 1:-1])
    row, column = np.nonzero((across | along) & (inner > 0.0) & (inner < NARROW_M))
    points = np.stack([column + 1.5, row + 1.5], axis=1) * space.cell
    side_m = np.ones(len(points))
    if space.allowance.size:
        side_m[space.allowance[row + 1, column + 1] >= 0.0] = OPENING_SPACING_M
    places = np.floor(points / side_m[:, None]).astype(int)
    keys = np.column_stack([side_m, places])
    _, first = np.unique(keys, axis=0, return_index=True)
    return np.asarray(points[np.sort(first)] + (space.x_min, space.y_min))


def _anchor(space: FreeSpace, passage: float, region: Region) -> np.ndarray:
    """Return a region's centre, or its clearest point where the centre is tight."""
    centre = np.asarray(region.center, dtype=float)
    if _field_at(space, centre[None])[0] >= passage + ANCHOR_SLACK * space.cell:
        return centre
    x0, y0, x1, y1 = region.shape.bounds
    grid = np.stack(
        np.meshgrid(np.linspace(x0, x1, 21), np.linspace(y0, y1, 21)), axis=-1
    ).reshape(-1, 2)
    grid = grid[region.depth(grid) >= 0.0]
    return np.asarray(grid[np.argmax(_field_at(space, grid))])


def _field_at(space: FreeSpace, points: np.ndarray) -> np.ndarray:
    """Return the distance field at the cells of points; -inf outside."""
    rows, columns = space.distance.shape
    column = np.floor((points[:, 0] - space.x_min) / space.cell).astype(int)
    row = np.floor((points[:, 1] - space.y_min) / space.cell).astype(int)
    valid = (column >= 0) & (row >= 0) & (column < columns) & (row < rows)
    value = np.full(len(points), -np.inf)
    value[valid] = space.distance[row[valid], column[valid]]
    return value
