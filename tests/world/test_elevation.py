"""Heights and slope costs of the kernels against those of the scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.world import _kernels
from mrmg.world.elevation import gradient_at, height_at, lifted, load_points
from mrmg.world.world import World

HILLS = {
    "hills": [
        {"center": [15, 10], "height": 0.9, "radius": 9},
        {"center": [32, 14], "height": -0.6, "radius": 6},
    ]
}
MUD = {"id": "mud", "box": {"center": [20, 10], "size": [10, 8]}, "multiplier": 1.5}


def make_scene(elevation: dict | None = HILLS) -> Scene:
    document = {
        "format": 1,
        "name": "downs",
        "bounds": [0, 0, 40, 20],
        "terrain": [MUD],
        "robots": [{"id": "r1", "model": "car", "pose": [3, 10, 0]}],
    }
    if elevation is not None:
        document["elevation"] = elevation
    return scene_from_document(document, source="downs")


def test_kernels_and_scene_agree_on_heights_to_the_last_bit() -> None:
    scene = make_scene()
    grid = World.from_scene(scene).terrain
    points = np.random.default_rng(1).uniform((-2, -2), (42, 22), (2000, 2))
    found = [_kernels.height_in(grid, x, y) for x, y in points]
    np.testing.assert_array_equal(found, height_at(scene, points))


def test_flat_ground_has_height_zero_and_costs_its_weighted_length() -> None:
    scene = make_scene(None)
    grid = World.from_scene(scene).terrain
    points = np.array([[3.0, 4.0], [30.0, 12.0]])
    assert not height_at(scene, points).any()
    assert not gradient_at(scene, points).any()
    assert _kernels.height_in(grid, 30.0, 12.0) == 0.0
    way = _kernels.segment_cost(grid, 3.0, 4.0, 30.0, 12.0, 17.0, 0.1)
    assert way == _kernels.segment_cost(grid, 3.0, 4.0, 30.0, 12.0, 0.0, 0.0)


@given(
    st.tuples(st.floats(0.5, 39.5), st.floats(0.5, 19.5)),
    st.tuples(st.floats(0.5, 39.5), st.floats(0.5, 19.5)),
)
def test_segments_cost_what_their_pieces_cost(
    a: tuple[float, float], b: tuple[float, float]
) -> None:
    """Against a sum over short pieces; there and back differ by the climb alone."""
    scene, grid, price, floor = CASE
    t = np.linspace(0.0, 1.0, 4001)
    points = np.array(a) + t[:, None] * (np.array(b) - a)
    rise = np.diff(height_at(scene, points))
    middle = 0.5 * (points[1:] + points[:-1])
    k = np.array([_kernels.multiplier_in(grid, x, y) for x, y in middle])
    way = k * np.hypot(*np.diff(points, axis=0).T)
    exact = np.maximum(way + price * rise, floor * way).sum()
    found = _kernels.segment_cost(grid, *a, *b, price, floor)
    assert found == pytest.approx(exact, rel=0.03, abs=0.8)
    assert found >= floor * way.sum() - 0.8
    if (np.abs(rise) * price < (1.0 - floor) * way).all():  # nowhere does it coast
        back = _kernels.segment_cost(grid, *b, *a, price, floor)
        assert found - back == pytest.approx(2.0 * price * rise.sum(), abs=1e-6)


CASE = (make_scene(), World.from_scene(make_scene()).terrain, 1.0 / 0.06, 0.1)


def test_the_whole_never_costs_more_than_its_pieces() -> None:
    """What the roadmap's search for vertices in sight rests on."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        way, rise = rng.uniform(0.1, 3.0, 5), rng.uniform(-0.3, 0.3, 5)
        pieces = sum(
            _kernels.sloped_length(w, h, 12.0, 0.2)
            for w, h in zip(way, rise, strict=True)
        )
        whole = _kernels.sloped_length(way.sum(), rise.sum(), 12.0, 0.2)
        assert whole <= pieces + 1e-9


def test_load_lies_ahead_of_the_reference_point() -> None:
    model = replace(make_scene().robots[0].model, center_of_mass_m=0.5)
    state = np.array([[1.0, 2.0, 0.0, 1, 0], [1.0, 2.0, np.pi / 2, 1, 0]])
    np.testing.assert_allclose(load_points(model, state), [[1.5, 2.0], [1.0, 2.5]])


def test_lifted_points_follow_the_ground() -> None:
    scene = make_scene()
    points = np.array([[15.0, 10.0], [39.0, 1.0]])
    np.testing.assert_allclose(
        lifted(scene, points, 0.3), [[15.0, 10.0, 1.2], [39.0, 1.0, 0.3]]
    )
