"""The compiled geometry against shapely: random maps, random poses."""

from __future__ import annotations

from collections.abc import Callable
from math import hypot
from typing import Any

import numpy as np
import pytest
import shapely

from mrmg.world import _kernels, _polygon_kernels
from mrmg.world.world import BUCKET_M, CELL_M

CAR = np.array([(-0.3, -0.55), (1.5, -0.55), (1.5, 0.55), (-0.3, 0.55)])
KITE = np.array([(-0.8, 0.0), (0.0, -0.4), (1.1, 0.0), (0.0, 0.4)])
LATH = np.array([(-0.3, -0.1), (0.3, -0.1), (0.3, 0.1), (-0.3, 0.1)])
MARGIN_M = 0.25

TIE_M = 1e-9
"""Poses this near the threshold may be told either way."""

FIELD_ERROR_M = 1e-9


def random_convex(rng: np.random.Generator) -> np.ndarray:
    """Return the corners of a convex polygon, counter-clockwise."""
    cloud = rng.uniform(-3.0, 3.0, 2) + rng.normal(0.0, 1.0, (8, 2))
    hull = shapely.convex_hull(shapely.MultiPoint(cloud))
    return np.asarray(shapely.orient_polygons(hull).exterior.coords)[:-1]


def segment_is_clear(
    space: Any, ax: float, ay: float, bx: float, by: float, needed: float
) -> bool:
    """Return whether a segment keeps `needed` clearance [m]."""
    found = _kernels.segment_clearance(space, ax, ay, bx, by, needed, needed)
    return bool(found >= needed)


def distance(first: np.ndarray, second: np.ndarray) -> float:
    """Return the distance of two convex polygons, however large."""
    return float(_polygon_kernels.convex_distance(first, second, np.inf))


# --- distances of polygons ---------------------------------------------------------


def test_convex_polygons_are_as_far_apart_as_shapely_says() -> None:
    rng = np.random.default_rng(1)
    apart = []
    for _ in range(1500):
        first, second = random_convex(rng), random_convex(rng)
        exact = shapely.distance(shapely.Polygon(first), shapely.Polygon(second))
        assert distance(first, second) == pytest.approx(exact, abs=1e-12)
        enough = rng.uniform(0.0, 2.0)
        found = _polygon_kernels.convex_distance(first, second, enough)
        assert found == pytest.approx(exact, abs=1e-12) or enough <= found <= exact
        apart.append(exact > 0.0)
    assert 300 < sum(apart) < 1200, "both cases must be drawn"


@pytest.mark.parametrize(
    ("second", "expected"),
    [
        (CAR, 0.0),  # the same polygon
        (0.2 * CAR + (0.4, 0.0), 0.0),  # wholly inside
        (CAR + (1.8, 0.0), 0.0),  # a common side
        (CAR + (1.8, 1.1), 0.0),  # a common corner
        (CAR + (0.0, 1.1 + 0.3), 0.3),  # side beside side
        (CAR + (1.8 + 0.3, 1.1 + 0.4), 0.5),  # corner to corner
        (CAR * (0.2, 3.0) + (0.5, 0.0), 0.0),  # a cross: no corner in the other
    ],
)
def test_convex_polygons_in_special_positions(
    second: np.ndarray, expected: float
) -> None:
    for one, other in ((CAR, second), (second, CAR)):
        found = distance(one, np.ascontiguousarray(other))
        assert found == pytest.approx(expected, abs=1e-12)


def test_segments_are_as_far_from_polygons_as_shapely_says() -> None:
    rng = np.random.default_rng(2)
    for _ in range(1500):
        corners = random_convex(rng)
        ends = rng.uniform(-5.0, 5.0, (2, 2))
        exact = shapely.distance(shapely.Polygon(corners), shapely.LineString(ends))
        assert distance(corners, ends) == pytest.approx(exact, abs=1e-12)


def test_points_are_as_far_from_polygons_as_shapely_says() -> None:
    rng = np.random.default_rng(3)
    for _ in range(1500):
        corners, (x, y) = random_convex(rng), rng.uniform(-5.0, 5.0, 2)
        exact = shapely.distance(shapely.Polygon(corners), shapely.Point(x, y))
        assert _polygon_kernels.point_convex_distance(x, y, corners) == pytest.approx(
            exact, abs=1e-12
        )


def test_a_segment_without_length_is_a_point() -> None:
    assert _polygon_kernels.point_segment_distance(3.0, 4.0, 0.0, 0.0, 0.0, 0.0) == 5.0


# --- the distance field ------------------------------------------------------------


def test_field_holds_exact_signed_distances(maps: list) -> None:
    for world_map in maps:
        space = world_map.space
        rows, columns = space.distance.shape
        x = space.x_min + (np.arange(columns) + 0.5) * space.cell
        y = space.y_min + (np.arange(rows) + 0.5) * space.cell
        centres = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        exact = world_map.signed_distance_m(centres)
        assert space.distance.reshape(-1) == pytest.approx(exact, abs=FIELD_ERROR_M)


def test_field_is_exact_near_crowded_edges(make_map: Callable) -> None:
    """A hundred slivers: sweeps alone lose the nearest edge here and there."""
    for seed in (3, 10, 22):
        rng = np.random.default_rng(seed)
        spread = rng.uniform(0.2, 3.0, (100, 1, 1))
        corners = rng.uniform(0.0, 40.0, (100, 1, 2))
        slivers = shapely.polygons(corners + spread * rng.normal(size=(100, 3, 2)))
        bounds = (0.0, 0.0, 40.0, 40.0)
        world_map = make_map(bounds, shapely.union_all(slivers), 2.0)
        centre = (np.arange(160) + 0.5) * CELL_M
        points = np.stack(np.meshgrid(centre, centre), axis=-1).reshape(-1, 2)
        exact = world_map.signed_distance_m(points)
        near = np.abs(exact) <= 2.0
        field = world_map.space.distance.reshape(-1)
        assert field[near] == pytest.approx(exact[near], abs=FIELD_ERROR_M)


def test_clearance_bound_is_low_but_not_by_two_cells(maps: list) -> None:
    rng = np.random.default_rng(3)
    for world_map in maps:
        points = world_map.random_points(rng, 800)
        exact = world_map.signed_distance_m(points)
        bound = np.array(
            [_kernels.clearance_at_least(world_map.space, x, y) for x, y in points]
        )
        assert (bound <= exact + FIELD_ERROR_M).all()
        assert (bound >= exact - 2.0 * CELL_M).all()


def test_clearance_bound_holds_outside_the_bounds(maps: list) -> None:
    rng = np.random.default_rng(4)
    for world_map in maps:
        x_min, y_min, x_max, y_max = world_map.bounds
        points = rng.uniform((x_min - 9, y_min - 9), (x_max + 9, y_max + 9), (300, 2))
        exact = world_map.signed_distance_m(points)
        for (x, y), distance in zip(points, exact, strict=True):
            bound = _kernels.clearance_at_least(world_map.space, x, y)
            assert bound <= distance + FIELD_ERROR_M


def test_clearance_estimate_is_within_a_cell(maps: list) -> None:
    """Bilinear in a 1-Lipschitz field: off by less than the cell's half diagonal."""
    rng = np.random.default_rng(5)
    worst = 0.0
    for world_map in maps:
        points = world_map.random_points(rng, 800)
        exact = world_map.signed_distance_m(points)
        estimate = np.array(
            [_kernels.clearance_estimate(world_map.space, x, y) for x, y in points]
        )
        worst = max(worst, float(np.abs(estimate - exact).max()))
    assert worst <= CELL_M / np.sqrt(2.0)


# --- buckets -----------------------------------------------------------------------


def test_buckets_hold_every_edge_within_reach(maps: list) -> None:
    rng = np.random.default_rng(6)
    for world_map in maps:
        space = world_map.space
        lines = shapely.linestrings(space.edge.reshape(-1, 2, 2))
        for x, y in world_map.random_points(rng, 200):
            column = int((x - space.x_min) / BUCKET_M)
            row = int((y - space.y_min) / BUCKET_M)
            b = row * space.bucket_columns + column
            held = space.bucket_edge[space.bucket_start[b] : space.bucket_start[b + 1]]
            near = shapely.distance(lines, shapely.Point(x, y)) <= space.reach
            assert set(np.flatnonzero(near)) <= set(held)
            assert len(held) == len(set(held))


def test_edges_are_those_of_frame_and_obstacles(maps: list) -> None:
    for world_map in maps:
        edge = world_map.space.edge
        lengths = np.hypot(edge[:, 2] - edge[:, 0], edge[:, 3] - edge[:, 1])
        frame = shapely.box(*world_map.bounds).length
        assert lengths.sum() == pytest.approx(frame + world_map.obstacles.length)


# --- footprints --------------------------------------------------------------------


def is_clear(
    space: _kernels.FreeSpace,
    outline: np.ndarray,
    pose: np.ndarray,
    margin_m: float = MARGIN_M,
) -> tuple[bool, shapely.Polygon]:
    middle = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    placed, centre = np.empty_like(outline), np.empty((1, 2))
    _polygon_kernels.place_footprint(outline, *pose, placed)
    _polygon_kernels.place_footprint(middle[None], *pose, centre)
    radius = float(np.hypot(*(outline - middle).T).max())
    answer = _kernels.footprint_is_clear(space, placed, *centre[0], radius, margin_m)
    return bool(answer), shapely.Polygon(placed)


def exact_clearance_m(world_map, placed: shapely.Polygon) -> float:  # type: ignore[no-untyped-def]
    frame = shapely.box(*world_map.bounds)
    if not frame.contains(placed) or placed.intersects(world_map.obstacles):
        return -1.0
    lines = shapely.union_all([frame.exterior, shapely.boundary(world_map.obstacles)])
    return float(placed.distance(lines))


@pytest.mark.parametrize(
    ("outline", "margin_m"), [(CAR, 0.25), (CAR, 0.9), (KITE, 0.25), (LATH, 0.2)]
)
def test_footprints_are_clear_exactly_when_shapely_says(
    maps: list, outline: np.ndarray, margin_m: float
) -> None:
    rng = np.random.default_rng(7)
    output = []
    for world_map in maps:
        for point in world_map.random_points(rng, 250):
            pose = np.array([*point, rng.uniform(-4.0, 4.0)])
            clear, placed = is_clear(world_map.space, outline, pose, margin_m)
            exact = exact_clearance_m(world_map, placed)
            if abs(exact - margin_m) > TIE_M:
                assert clear == (exact > margin_m), (world_map.bounds, pose, exact)
                output.append(clear)
    assert 0.2 < np.mean(output) < 0.8, "both answers must be drawn"


def test_a_lath_just_inside_an_obstacle_is_not_clear(make_map: Callable) -> None:
    """No edge is within its margin; only the sign of the field tells."""
    world_map = make_map((0.0, 0.0, 30.0, 20.0), shapely.box(10.0, 5.0, 20.0, 15.0))
    for depth_m in np.linspace(0.301, 0.6, 30):
        inside = np.array([15.0, 5.0 + depth_m, 0.0])
        outside = np.array([15.0, 5.0 - depth_m, 0.0])
        assert not is_clear(world_map.space, LATH, inside, 0.2)[0]
        assert is_clear(world_map.space, LATH, outside, 0.2)[0]


def test_footprints_at_the_threshold(make_map: Callable) -> None:
    """A wall's exact distance is told to a millionth of a millimetre."""
    world_map = make_map((0.0, 0.0, 30.0, 20.0), shapely.box(14.0, 5.0, 16.0, 15.0))
    touching_x = 14.0 - 1.5 - MARGIN_M
    for offset, expected in ((-TIE_M, True), (TIE_M, False)):
        pose = np.array([touching_x + offset, 10.0, 0.0])
        assert is_clear(world_map.space, CAR, pose)[0] is expected


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ((12.0, 10.0, 0.3), True),  # in the hole
        ((9.0, 10.0, 0.0), False),  # half in the hole
        ((6.0, 10.0, 0.0), False),  # in the ring's solid part
        ((2.0, 10.0, 0.0), True),  # outside the ring
    ],
)
def test_holes_of_obstacles_are_free(
    make_map: Callable, pose: tuple[float, float, float], expected: bool
) -> None:
    ring = shapely.box(4.0, 2.0, 20.0, 18.0) - shapely.box(9.0, 7.0, 15.0, 13.0)
    world_map = make_map((0.0, 0.0, 24.0, 20.0), ring)
    assert is_clear(world_map.space, CAR, np.array(pose))[0] is expected


def test_footprints_deep_inside_a_large_obstacle_are_not_clear(
    make_map: Callable,
) -> None:
    """No edge is near there: the sign of the field must tell."""
    world_map = make_map((0.0, 0.0, 40.0, 40.0), shapely.box(5.0, 5.0, 35.0, 35.0))
    assert not is_clear(world_map.space, CAR, np.array([20.0, 20.0, 1.0]))[0]


@pytest.mark.parametrize("size_m", [11.0, 11.25, 11.2, 12.0, 10.9])
def test_footprints_wholly_outside_the_bounds_are_not_clear(
    make_map: Callable, size_m: float
) -> None:
    """Wherever the last cell and the last bucket end."""
    world_map = make_map((0.0, 0.0, size_m, size_m), shapely.MultiPolygon())
    for beyond_m in np.linspace(0.01, 8.0, 160):
        for x, y in (
            (size_m + beyond_m, 5.0),
            (5.0, size_m + beyond_m),
            (-beyond_m, 5.0),
            (5.0, -beyond_m),
        ):
            for theta in (0.0, np.pi / 2.0):
                assert not is_clear(world_map.space, CAR, np.array([x, y, theta]))[0]


# --- segments ----------------------------------------------------------------------


def exact_segment_clearance_m(world_map, a: np.ndarray, b: np.ndarray) -> float:  # type: ignore[no-untyped-def]
    """Return the least signed distance along a segment, sampled every 5 mm."""
    n = int(np.ceil(hypot(*(b - a)) / 0.005)) + 1
    return float(world_map.signed_distance_m(np.linspace(a, b, n)).min())


def test_segment_clearance_is_exact_within_half_a_cell(maps: list) -> None:
    rng = np.random.default_rng(8)
    blocked = []
    for world_map in maps:
        for a, b in world_map.random_points(rng, 60).reshape(-1, 2, 2):
            exact = exact_segment_clearance_m(world_map, a, b)
            found = _kernels.segment_clearance(world_map.space, *a, *b, 0.0, 1.5)
            blocked.append(exact <= 0.0)
            if exact <= -0.5 * CELL_M:
                assert found < 0.5 * CELL_M
            else:
                assert found == pytest.approx(min(exact, 1.5), abs=0.5 * CELL_M)
    assert 0.1 < np.mean(blocked) < 0.9


def test_segments_are_clear_within_half_a_cell(maps: list) -> None:
    rng = np.random.default_rng(9)
    output = []
    for world_map in maps:
        for a, b in world_map.random_points(rng, 60).reshape(-1, 2, 2):
            exact = exact_segment_clearance_m(world_map, a, b)
            for needed in (0.3, 0.85):
                clear = segment_is_clear(world_map.space, *a, *b, needed)
                if abs(exact - needed) > 0.5 * CELL_M:
                    assert clear == (exact > needed)
                    output.append(clear)
    assert 0.1 < np.mean(output) < 0.9


def test_segments_without_length_are_points(make_map: Callable) -> None:
    space = make_map((0.0, 0.0, 20.0, 20.0), shapely.box(8.0, 8.0, 12.0, 12.0)).space
    for x, expected in ((10.0, False), (4.0, True)):
        assert segment_is_clear(space, x, 10.0, x, 10.0, 0.5) == expected
    clearance = _kernels.segment_clearance(space, 4.0, 10.0, 4.0, 10.0, 0.0, 9.0)
    assert clearance == pytest.approx(4.0, abs=0.5 * CELL_M)


def test_segments_are_not_stepped_along_past_their_tightest_place(
    make_map: Callable,
) -> None:
    """A step as long as the clearance would pass over a thin post beside the way."""
    post = shapely.box(19.99, 12.5, 20.01, 14.0)
    space = make_map((0.0, 0.0, 40.0, 40.0), post).space
    for ahead_m in (0.6, 1.25, 2.0):
        ends = (20.0 - ahead_m, 10.0, 26.0, 10.0)
        found = _kernels.segment_clearance(space, *ends, 0.0, 9.0)
        assert found == pytest.approx(2.5, abs=0.2 * CELL_M)
        assert segment_is_clear(space, *ends, 2.4)
        assert not segment_is_clear(space, *ends, 2.56)
