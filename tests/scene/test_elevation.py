"""The elevation between its nodes, against scipy and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from mrmg.scene.elevation import Elevation
from mrmg.scene.loading import scene_from_document
from mrmg.scene.slopes import bend_warnings

BOUNDS = (-3.0, 2.0, 9.0, 10.0)


@pytest.fixture
def rough() -> Elevation:
    heights = np.random.default_rng(1).normal(size=(9, 7))
    return Elevation(bounds=BOUNDS, height_m=heights)


def inside(n: int, seed: int) -> np.ndarray:
    low, high = np.array(BOUNDS[:2]), np.array(BOUNDS[2:])
    return np.random.default_rng(seed).uniform(low, high, (n, 2))


def test_it_is_bilinear_between_nodes_that_reach_from_bound_to_bound(
    rough: Elevation,
) -> None:
    x, y = np.linspace(-3.0, 9.0, 7), np.linspace(2.0, 10.0, 9)
    expected = RegularGridInterpolator((y, x), rough.height_m)
    points = inside(500, 2)
    np.testing.assert_allclose(
        rough.height_at(points), expected(points[:, ::-1]), atol=1e-12
    )
    assert rough.height_at(np.array([[9.0, 10.0]])) == rough.height_m[-1, -1]
    assert rough.height_at(np.array([-3.0, 2.0])) == rough.height_m[0, 0]


def test_outside_the_bounds_it_goes_on_level(rough: Elevation) -> None:
    beyond = np.array([[-9.0, 5.0], [4.0, 99.0], [20.0, -4.0]])
    edge = np.clip(beyond, BOUNDS[:2], BOUNDS[2:])
    np.testing.assert_array_equal(rough.height_at(beyond), rough.height_at(edge))


def test_gradients_are_those_of_the_heights(rough: Elevation) -> None:
    points, h = inside(300, 3), 1e-6
    dx, dy = rough.cell_m
    place = (points - BOUNDS[:2]) / (dx, dy)
    clear = (np.abs(place - np.round(place)) > 1e-3).all(axis=1)
    points = points[clear]
    for axis, step in enumerate(([h, 0.0], [0.0, h])):
        rise = rough.height_at(points + step) - rough.height_at(points - step)
        slope = rough.gradient_at(points)[:, axis]
        np.testing.assert_allclose(slope, rise / (2.0 * h), atol=1e-8)


def test_no_place_of_a_cell_is_steeper_than_said(rough: Elevation) -> None:
    points = inside(5000, 4)
    dx, dy = rough.cell_m
    column, row = np.floor((points - BOUNDS[:2]) / (dx, dy)).astype(int).T
    slope = np.hypot(*rough.gradient_at(points).T)
    said = rough.steepest()
    assert (slope <= said[row, column] + 1e-12).all()
    assert slope.max() > 0.9 * said.max()


def test_boxes_hold_no_higher_and_no_lower_ground_than_said(rough: Elevation) -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        corners = np.sort(rng.uniform((-5.0, 0.0), (11.0, 12.0), (2, 2)), axis=0)
        low, high = rough.span_within((*corners[0], *corners[1]))
        heights = rough.height_at(rng.uniform(*corners, (400, 2)))
        assert low - 1e-12 <= heights.min()
        assert heights.max() <= high + 1e-12
    assert rough.span_within(BOUNDS) == (rough.height_m.min(), rough.height_m.max())


def test_a_small_box_in_a_large_cell_has_its_own_heights() -> None:
    ramp = Elevation(
        bounds=(0.0, 0.0, 100.0, 10.0), height_m=np.array([[0.0, 10.0]] * 2)
    )
    assert ramp.span_within((20.0, 2.0, 30.0, 4.0)) == pytest.approx((2.0, 3.0))


def test_cell_centres_lie_amid_their_nodes(rough: Elevation) -> None:
    heights = rough.height_at(rough.cell_centres().reshape(-1, 2)).reshape(8, 6)
    h = rough.height_m
    means = (h[:-1, :-1] + h[:-1, 1:] + h[1:, :-1] + h[1:, 1:]) / 4.0
    np.testing.assert_allclose(heights, means)


def test_the_slope_at_one_point_is_that_of_many(rough: Elevation) -> None:
    """Nodes, edges and places beyond the bounds included."""
    nodes = np.array([[-3.0, 2.0], [9.0, 10.0], [1.0, 4.0], [9.0, 3.3]])
    beyond = np.array([[-9.0, 5.0], [4.0, 99.0], [20.0, -4.0]])
    points = np.concatenate([inside(300, 5), nodes, beyond])
    slopes = [rough.slope_at(x, y) for x, y in points.tolist()]
    np.testing.assert_allclose(slopes, rough.gradient_at(points), atol=1e-12)


def test_a_place_that_is_no_number_has_some_slope(rough: Elevation) -> None:
    """A simulation that diverged is ended by whoever looks at its state."""
    assert np.shape(rough.slope_at(np.nan, np.nan)) == (2,)


@pytest.mark.parametrize("fine", [1, 8])
@pytest.mark.parametrize(("slope", "warned"), [(0.09, False), (0.17, True)])
def test_ground_that_bends_sharply_is_warned_of_with_its_limit(
    fine: int, slope: float, warned: bool
) -> None:
    """Level up to x = 10 and rising from there, whatever the cells: 2 m or 0.25 m."""
    x = np.linspace(0.0, 20.0, 10 * fine + 1)
    document = {
        "format": 1,
        "name": "kink",
        "bounds": [0, 0, 20, 20],
        "elevation": {"grid": [(slope * np.maximum(x - 10.0, 0.0)).tolist()] * 2},
        "robots": [{"id": "r1", "model": "car", "pose": [3, 10, 0]}],
    }
    scene = scene_from_document(document, source="kink", base=None)
    found = [str(fault) for fault in bend_warnings(scene)]
    assert bool(found) == warned
    if warned:
        assert "the slope changes by 17 % at (10.0, " in found[0]
        assert "more than 10 %" in found[0]
    wall = {"id": "w", "polygon": [[8, 0], [12, 0], [12, 20], [8, 20]]}
    assert not bend_warnings(scene.with_(obstacles=[wall]))
