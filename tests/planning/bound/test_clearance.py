"""Ground that ways need not be on, against all motions along a heading on a lattice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import gcd

import numpy as np
import pytest
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from mrmg.planning.bound.clearance import (
    avoided_ground,
    blocked_ground,
    passing_radius_m,
)
from mrmg.planning.bound.visibility import VisibilityGraph, place_of
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Robot, Scene, TerrainArea

SIZE_M = 9.0
SPACING_M = 0.1
STEP_M = 0.2


def yard(rng: np.random.Generator, count: int) -> Scene:
    """Return a yard with convex obstacles, many of which a car cannot pass between."""
    obstacles = []
    for k in range(count):
        angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, 5))
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * rng.uniform(0.2, 1.5)
        hull = shapely.MultiPoint(ring + rng.uniform(2.0, SIZE_M - 2.0, 2)).convex_hull
        corners = [list(map(float, p)) for p in hull.exterior.coords[:-1]]
        obstacles.append({"id": f"o{k}", "polygon": corners, "height": 1})
    goal = {"center": [1.0, 1.0], "radius": 0.5}
    return scene_from_document(
        {
            "format": 1,
            "name": "yard",
            "bounds": [0, 0, SIZE_M, SIZE_M],
            "robots": [{"id": "r1", "model": "car", "pose": [1.0, 8.0, 0.0]}],
            "goals": [{"id": "g1", "circle": goal}],
            "obstacles": obstacles,
        },
        source="yard",
    )


def motions(scene: Scene, robot: Robot) -> tuple[np.ndarray, Callable[..., np.ndarray]]:
    """Return points of a lattice, and the lengths of the shortest motions among them.

    A motion leads along the heading, forwards or backwards; the heading may be any at
    each point, however the robot turned to it. The footprint never meets an obstacle.
    """
    steps = np.arange(0.5, SIZE_M - 0.5, SPACING_M)
    index = np.arange(len(steps) ** 2).reshape(len(steps), len(steps))
    points = np.stack([a.ravel() for a in np.meshgrid(steps, steps)], axis=1)
    solid = shapely.union_all([o.shape for o in scene.obstacles])
    shapely.prepare(solid)
    found = []
    for dx in range(-3, 4):
        for dy in range(-3, 4):
            if gcd(dx, dy) != 1:
                continue
            size, turn = np.hypot(dx, dy), np.arctan2(dy, dx)
            c, s = np.cos(turn), np.sin(turn)
            ends = robot.model.footprint_m @ np.array([[c, s], [-s, c]])
            offset = SPACING_M * np.array([dx, dy])
            swept = shapely.MultiPoint(np.concatenate([ends, ends + offset]))
            hull = np.asarray(swept.convex_hull.exterior.coords)
            free = ~shapely.intersects(solid, shapely.polygons(points[:, None] + hull))
            free = free.reshape(index.shape)
            rows, columns = np.nonzero(free)
            inside = (rows + dy >= 0) & (rows + dy < len(steps))
            inside &= (columns + dx >= 0) & (columns + dx < len(steps))
            rows, columns = rows[inside], columns[inside]
            pair = index[rows, columns], index[rows + dy, columns + dx]
            found.append((*pair, np.full(len(rows), SPACING_M * size)))
    first, last, length = (np.concatenate(part) for part in zip(*found, strict=True))
    graph = coo_array((length, (first, last)), shape=(index.size, index.size))
    graph = graph.tocsr()

    def lengths(origins: np.ndarray) -> np.ndarray:
        return np.asarray(dijkstra(graph, directed=False, indices=origins))

    return points, lengths


def box(back: float, ahead: float, half_width: float) -> np.ndarray:
    corners = shapely.box(-back, -half_width, ahead, half_width).exterior.coords[:-1]
    return np.array(corners)


FOOTPRINTS = {
    "car": box(0.3, 1.5, 0.55),
    "short": box(0.3, 0.8, 0.55),
    "backwards": box(1.5, 0.3, 0.55),
    "flat": box(0.2, 1.2, 0.8),
}
"""The first three keep 0.53 m, half their width, the last twice what it has behind."""


@pytest.mark.parametrize("name", FOOTPRINTS)
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.ci) for k in range(1, 10))]
)
def test_no_motion_along_the_heading_is_shorter_than_paths_off_avoided_ground(
    name: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    scene = yard(rng, 8)
    model = replace(scene.robots[0].model, footprint_m=FOOTPRINTS[name])
    robot = replace(scene.robots[0], model=model)
    points, lengths = motions(scene, robot)
    near = blocked_ground(scene, robot)
    free = np.flatnonzero(~shapely.intersects_xy(near, *points.T))
    origins, targets = rng.choice(free, (2, 12), replace=False)
    ends = shapely.multipoints(points[np.concatenate([origins, targets])])
    avoided = avoided_ground(scene, robot, ends, STEP_M)
    driven = lengths(origins)[:, targets]
    paths, nearer = (
        shortest_paths(scene, ground, points[origins], points[targets])
        for ground in (avoided, near)
    )
    assert (paths <= driven + 1e-9).all()
    if name != "flat":  # which passes few of the gaps that it is said to
        assert np.median((driven / paths)[np.isfinite(driven)]) < 1.1
    assert (paths > 1.02 * nearer).any()


def shortest_paths(
    scene: Scene, blocked: shapely.Geometry, first: np.ndarray, last: np.ndarray
) -> np.ndarray:
    graph = VisibilityGraph.of(
        scene, blocked, cell_m=0.03, step_m=STEP_M, reach_m=SPACING_M
    )
    nodes = np.arange(len(graph.bends.slack))
    return np.array(
        [
            [graph.least_costs(nodes, place_of(a), place_of(b))[0, 0] for b in last]
            for a in first
        ]
    )


def test_how_near_robots_pass() -> None:
    """Half the width, or less behind or ahead, or where they move otherwise."""
    car = yard(np.random.default_rng(0), 1).robots[0].model
    kept = {
        name: passing_radius_m(replace(car, footprint_m=shape))
        for name, shape in FOOTPRINTS.items()
    }
    assert kept["car"] == pytest.approx(0.53, abs=0.003)
    assert kept["short"] == kept["backwards"] == kept["car"]
    assert kept["flat"] == pytest.approx(0.36)
    square = replace(car, footprint_m=box(0.3, 0.3, 0.55))
    assert passing_radius_m(square) == pytest.approx(0.28)


def test_obstacles_at_terrain_or_at_ends_are_passed_as_near_as_can_be() -> None:
    rng = np.random.default_rng(3)
    scene = yard(rng, 1)
    robot, shape = scene.robots[0], scene.obstacles[0].shape
    away = shapely.Point(0.0, 0.0)
    near, wide = (
        blocked_ground(scene, robot),
        avoided_ground(scene, robot, away, STEP_M),
    )
    assert wide.area > near.area
    at = shapely.Point(*shape.exterior.coords[0]).buffer(0.1)
    beside = avoided_ground(scene, robot, at, STEP_M)
    assert near.area < beside.area < wide.area
    assert beside.intersection(at).area == pytest.approx(near.intersection(at).area)
    mud = TerrainArea(id="mud", shape=at, multiplier=2.0)
    muddy = replace(scene, terrain=(mud,))
    assert avoided_ground(muddy, robot, away, STEP_M).equals(near)
    everywhere = replace(mud, shape=shapely.box(0.0, 0.0, SIZE_M, SIZE_M))
    muddy = replace(scene, terrain=(everywhere,))
    assert avoided_ground(muddy, robot, away, STEP_M).equals(wide)
