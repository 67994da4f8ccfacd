"""Finding the way from any place: waypoints in sight, and costlier tight edges."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely

from mrmg import seeding
from mrmg.planning.roadmap import _roadmap_kernels
from mrmg.planning.roadmap._roadmap_kernels import TIGHT_SHARE
from mrmg.planning.roadmap.roadmap import Roadmap, build_roadmap
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.world.world import CELL_M, World

PASSAGE_M = 0.85
VIEW_M = 15.0


def rectangle(
    name: str, x: tuple[float, float], y: tuple[float, float], **more: Any
) -> dict[str, Any]:
    centre = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])]
    size = [x[1] - x[0], y[1] - y[0]]
    return {"id": name, "box": {"center": centre, "size": size}, **more}


class Place:
    """A walled yard with mud, its world and its roadmap."""

    def __init__(self) -> None:
        document = {
            "format": 1,
            "name": "yard",
            "bounds": [0, 0, 60, 40],
            "obstacles": [
                rectangle("north", (20, 22), (14, 40), height=1),
                rectangle("south", (38, 40), (0, 26), height=1),
                rectangle("shed", (50, 54), (24, 40), height=1),
            ],
            "terrain": [rectangle("mud", (24, 36), (18, 24), multiplier=4)],
            "goals": [{"id": "a", "circle": {"center": [55, 8], "radius": 1}}],
            "stations": [{"id": "s", "circle": {"center": [8, 34], "radius": 1}}],
            "battery": {"capacity_m": 500},
            "robots": [{"id": "r1", "model": "car", "pose": [5, 20, 0]}],
        }
        self.scene: Scene = scene_from_document(document, source="yard")
        self.world = World.from_scene(self.scene)
        self.roadmap: Roadmap = build_roadmap(
            self.scene,
            self.world,
            samples=800,
            neighbours=12,
            margin_m=0.25,
            rng=seeding.stream(0, "roadmap"),
        )
        frame = shapely.box(*self.scene.bounds)
        self.lines = shapely.union_all([frame.exterior, self.world.obstacles[0]])

    def waypoint(self, target: int, x: float, y: float) -> tuple[float, np.ndarray]:
        """Return (cost to the target, waypoint)."""
        out = np.full(2, np.nan)
        cost = _roadmap_kernels.find_waypoint(
            self.world.spaces[0],
            self.world.terrain,
            self.roadmap.arrays,
            0,
            target,
            x,
            y,
            PASSAGE_M,
            VIEW_M,
            out,
        )
        return cost, out

    def free_points(self, n: int) -> np.ndarray:
        """Return random points where a car fits."""
        points = np.random.default_rng(2).uniform((1, 1), (59, 39), (4 * n, 2))
        room = shapely.distance(self.lines, shapely.points(points))
        return points[room > PASSAGE_M + 0.1][:n]


@pytest.fixture(scope="module")
def place() -> Place:
    return Place()


@pytest.mark.parametrize("target", [0, 1])
def test_waypoints_are_in_sight_and_costs_reach_the_target(
    place: Place, target: int
) -> None:
    goal = place.scene.targets()[target].region.center
    for point in place.free_points(150):
        cost, waypoint = place.waypoint(target, *point)
        sight = shapely.LineString([point, waypoint])
        assert sight.distance(place.lines) > 0.5 * PASSAGE_M
        assert cost >= np.hypot(*(goal - point)) - 1e-9, "shorter than a straight line"


@pytest.mark.parametrize("target", [0, 1])
def test_going_from_waypoint_to_waypoint_ends_at_the_target(
    place: Place, target: int
) -> None:
    goal = place.scene.targets()[target].region.center
    for point in place.free_points(40):
        cost, waypoint = place.waypoint(target, *point)
        first_cost, driven, here = cost, 0.0, point
        for _ in range(60):
            step = waypoint - here
            length = np.hypot(*step)
            share = min(1.0, 3.0 / max(length, 1e-9))
            driven += share * length
            here = here + share * step
            if np.hypot(*(goal - here)) < 0.5:
                break
            cost, waypoint = place.waypoint(target, *here)
        assert np.hypot(*(goal - here)) < 0.5, point
        assert driven <= 1.1 * first_cost + 1.0


def test_a_target_that_is_cut_off_has_no_waypoint(place: Place) -> None:
    arrays = place.roadmap.arrays
    cut_off = arrays._replace(cost_to_go=np.full_like(arrays.cost_to_go, np.inf))
    out = np.zeros(2)
    cost = _roadmap_kernels.find_waypoint(
        place.world.spaces[0],
        place.world.terrain,
        cut_off,
        0,
        0,
        5.0,
        20.0,
        PASSAGE_M,
        VIEW_M,
        out,
    )
    assert cost == np.inf


def edge_cost(place: Place, a: tuple[float, float], b: tuple[float, float]) -> float:
    one = np.array([0])
    cost = _roadmap_kernels.edge_costs(
        place.world.spaces[0],
        place.world.terrain,
        np.array([a, b], float),
        one,
        one + 1,
        PASSAGE_M,
        0.0,
        0.0,
    )
    assert cost[0, 0] == cost[0, 1], "flat ground costs the same there and back"
    return float(cost[0, 0])


def test_an_edge_costs_its_weighted_length(place: Place) -> None:
    assert edge_cost(place, (5, 10), (15, 10)) == pytest.approx(10.0)
    assert edge_cost(place, (27, 20), (33, 20)) == pytest.approx(24.0)
    assert edge_cost(place, (15, 10), (5, 10)) == pytest.approx(10.0)


def test_an_edge_through_an_obstacle_is_blocked(place: Place) -> None:
    assert edge_cost(place, (15, 20), (25, 20)) == np.inf
    assert edge_cost(place, (15, 0.3), (18, 0.3)) == np.inf, "along the bounds"


def test_tight_edges_are_dearer_but_not_by_more_than_the_share(place: Place) -> None:
    """Along the wall at x = 20, from its foot away."""
    costs = [
        edge_cost(place, (20 - room, 30), (20 - room, 36))
        for room in np.arange(PASSAGE_M + 0.5 * CELL_M, 3.0, 0.1)
    ]
    assert costs == sorted(costs, reverse=True)
    assert 6.0 * (1.0 + 0.5 * TIGHT_SHARE) < costs[0] <= 6.0 * (1.0 + TIGHT_SHARE)
    assert costs[-1] == pytest.approx(6.0)
