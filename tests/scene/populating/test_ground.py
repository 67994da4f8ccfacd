"""The grid over a map against exact geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from places import nearest

from mrmg.scene.populating.ground import Ground

FIELD = (0.0, 0.0, 40.0, 30.0)


def ground(
    obstacles: list[shapely.Polygon] | None = None,
    terrain: list[tuple[shapely.Polygon, float]] | None = None,
    margin_m: float = 1.0,
) -> Ground:
    return Ground.over(FIELD, obstacles or [], terrain or [], margin_m=margin_m)


@given(
    boxes=st.lists(
        st.tuples(st.floats(2, 34), st.floats(2, 24), st.floats(1, 6), st.floats(1, 6)),
        max_size=5,
    )
)
@settings(max_examples=20)
def test_clearance_is_the_exact_distance(boxes: list[tuple[float, ...]]) -> None:
    obstacles = [shapely.box(x, y, x + a, y + b) for x, y, a, b in boxes]
    grid = ground(obstacles)
    points = shapely.points(grid.points_m)
    walls = shapely.union_all([shapely.box(*FIELD).exterior, *obstacles])
    exact = shapely.distance(walls, points)
    outside = exact > 0.0
    assert grid.clearance_m[outside] == pytest.approx(exact[outside], abs=1e-9)
    assert (grid.clearance_m[~outside] <= 0.0).all()


def test_open_ground_is_driven_nearly_straight() -> None:
    """Roads over the grid are never shorter than the line, and at most 2.8 % longer."""
    grid = ground()
    start = nearest(grid, (20.0, 15.0))
    road = grid.distances([start])[0][grid.free]
    line = np.hypot(*(grid.points_m[grid.free] - grid.points_m[start]).T)
    far = line > 1.0
    assert (road[far] >= line[far] * (1.0 - 1e-12)).all()
    assert (road[far] <= line[far] * 1.028).all()


def test_terrain_multiplies_the_cost() -> None:
    plain = ground()
    mud = ground(terrain=[(shapely.box(*FIELD), 2.5)])
    ends = [nearest(plain, (5, 5)), nearest(plain, (35, 25))]
    ratio = mud.distances(ends)[0, ends[1]] / plain.distances(ends)[0, ends[1]]
    assert ratio == pytest.approx(2.5)


def test_later_terrain_counts() -> None:
    grid = ground(terrain=[(shapely.box(*FIELD), 2.5), (shapely.box(0, 0, 9, 9), 0.5)])
    assert grid.multiplier[nearest(grid, (4, 4))] == 0.5
    assert grid.multiplier[nearest(grid, (30, 20))] == 2.5


def test_road_round_a_wall() -> None:
    """From one side of a wall to the other, round its end: two straight lines."""
    wall = shapely.box(19.5, 0, 20.5, 20)
    grid = ground([wall], margin_m=0.6)
    ends = [nearest(grid, (10, 5)), nearest(grid, (30, 5))]
    road = grid.distances(ends)[0, ends[1]]
    tip = 20.0 + 0.6
    a, b = grid.points_m[ends]
    shortest = math.dist(a, (19.5, tip)) + 1.0 + math.dist((20.5, tip), b)
    assert shortest * 0.97 < road < shortest * 1.05


def test_walls_part_the_ground() -> None:
    grid = ground([shapely.box(19.5, 0, 20.5, 30)])
    left, right = nearest(grid, (5, 5)), nearest(grid, (35, 5))
    assert grid.largest[left] != grid.largest[right]
    assert np.isinf(grid.distances([left])[0, right])


def test_thin_walls_are_not_jumped() -> None:
    """A wall thinner than a cell still has its margin on both sides."""
    grid = ground([shapely.box(19.99, 0, 20.01, 30)], margin_m=0.55)
    assert np.isinf(grid.distances([nearest(grid, (5, 5))])[0, nearest(grid, (35, 5))])


def test_clearance_beside_the_map_is_none() -> None:
    grid = ground()
    assert grid.clearance_at(np.array([[20.0, 15.0], [-3.0, 5.0]])).tolist() == [
        pytest.approx(14.75),
        -math.inf,
    ]


def test_road_to_nearest() -> None:
    grid = ground()
    targets = np.array([nearest(grid, (5, 5)), nearest(grid, (35, 25))])
    found = grid.road_to_nearest(targets)
    assert found == pytest.approx(grid.distances(targets).min(axis=0))
    assert np.isinf(grid.road_to_nearest(np.array([], dtype=int))).all()


def test_costs_between_many_places_lead_over_places() -> None:
    """A wall with a gap at one end stands between two halves."""
    wall = shapely.box(20, 0, 21, 34)
    ground = Ground.over((0, 0, 40, 40), [wall], [], margin_m=1.0)
    free = np.flatnonzero(ground.free)
    places = np.random.default_rng(0).choice(free, 400, replace=False).tolist()
    some = places[:8]
    exact = ground.distances(some)[:, places]
    over = ground.between(places)[:8]
    assert (over >= exact - 1e-9).all()
    far = exact > 20.0
    assert np.median(over[far] / exact[far]) < 1.02
    assert (over[far] / exact[far]).max() < 1.06
