"""Convex pieces tile the polygon: area, disjointness and convexity are the oracles."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from mrmg.simulation.convex import convex_pieces, triangles

SQUARE = Polygon([(0, 0), (4, 0), (4, 4), (0, 4)])
L_SHAPE = Polygon([(0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)])
FRAME = Polygon(SQUARE.exterior, [[(1, 1), (1, 3), (3, 3), (3, 1)]])
COMB = Polygon(
    [(0, 0), (7, 0), (7, 5), (6, 5), (6, 1), (4, 1), (4, 5), (3, 5), (3, 1), (1, 1)]
)


def star(seed: int, corners: int, holes: int) -> Polygon:
    """A star-shaped polygon with small triangular holes near its centre."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(0, 2 * np.pi, corners, endpoint=False)
    radius = rng.uniform(2.0, 6.0, corners)
    outline = Polygon(np.stack([np.cos(angle), np.sin(angle)], 1) * radius[:, None])
    for k in range(holes):
        at = 1.2 * np.array([np.cos(2.1 * k), np.sin(2.1 * k)])
        turn = rng.uniform(0, 2) + np.arange(3) * 2 * np.pi / 3
        corner = at + 0.3 * np.stack([np.cos(turn), np.sin(turn)], 1)
        outline = outline.difference(Polygon(corner))
    return max(shapely.get_parts(outline), key=lambda part: part.area)


def assert_tiles(polygon: Polygon) -> list[Polygon]:
    pieces = [Polygon(ring) for ring in convex_pieces(polygon)]
    assert sum(piece.area for piece in pieces) == pytest.approx(polygon.area, rel=1e-9)
    assert shapely.union_all(pieces).symmetric_difference(polygon).area < 1e-9
    for piece in pieces:
        assert piece.convex_hull.area == pytest.approx(piece.area, rel=1e-9)
        assert piece.exterior.is_ccw
    return pieces


@pytest.mark.parametrize(
    ("polygon", "most"),
    [
        (SQUARE, 1),  # already convex
        (L_SHAPE, 2),  # one reflex corner
        (FRAME, 8),  # a hole has four
        (COMB, 5),
    ],
)
def test_known_shapes_need_few_pieces(polygon: Polygon, most: int) -> None:
    assert len(assert_tiles(polygon)) <= most


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.integers(5, 40), st.integers(0, 3))
def test_random_shapes_are_tiled(seed: int, corners: int, holes: int) -> None:
    polygon = star(seed, corners, holes)
    pieces = assert_tiles(polygon)
    reflex_bound = len(triangles(polygon))
    assert len(pieces) <= reflex_bound


def test_collinear_corners_are_dropped() -> None:
    polygon = Polygon([(0, 0), (1, 0), (2, 0), (4, 0), (4, 4), (0, 4)])
    assert len(assert_tiles(polygon)) == 1
