"""Terrain by polygon and by grid."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.world import _kernels
from mrmg.world.terrain import multiplier_at, multipliers_at
from mrmg.world.world import CELL_M, World

MUD = {"id": "mud", "box": {"center": [20, 10], "size": [16, 12]}, "multiplier": 4}
PLANK = {"id": "plank", "box": {"center": [20, 10], "size": [20, 2]}, "multiplier": 1.5}
SAND = {
    "id": "sand",
    "polygon": [[2, 2], [14, 3], [9, 17]],
    "multiplier": 2,
}
POND = {"id": "pond", "circle": {"center": [31, 5], "radius": 4}, "multiplier": 3}


def scene(*terrain: dict) -> Scene:
    document = {
        "format": 1,
        "name": "fields",
        "bounds": [0, 0, 40, 20],
        "terrain": list(terrain),
        "goals": [{"id": "g", "circle": {"center": [35, 15], "radius": 1}}],
        "battery": {"capacity_m": 200},
        "robots": [{"id": "r1", "model": "car", "pose": [5, 10, 0]}],
    }
    return scene_from_document(document, source="fields")


@pytest.mark.parametrize(
    ("order", "expected"), [((MUD, PLANK), 1.5), ((PLANK, MUD), 4.0)]
)
def test_the_later_area_counts_where_two_overlap(
    order: tuple[dict, ...], expected: float
) -> None:
    both, mud_only, plank_only, plain = (20, 10), (20, 15), (29.5, 10), (39, 1)
    points = np.array([both, mud_only, plank_only, plain], float)
    fields = scene(*order)
    assert multiplier_at(fields, points).tolist() == [expected, 4.0, 1.5, 1.0]
    grid = World.from_scene(fields).terrain
    assert [_kernels.multiplier_in(grid, x, y) for x, y in points] == [
        expected,
        4.0,
        1.5,
        1.0,
    ]


def test_terrain_may_resist_turning_by_a_factor_of_its_own() -> None:
    fields = scene({**MUD, "turning_multiplier": 3}, PLANK)
    points = np.array([(20, 10), (20, 15), (39, 1)], float)
    rolling, turning = multipliers_at(fields, points)
    assert rolling.tolist() == multiplier_at(fields, points).tolist() == [1.5, 4.0, 1.0]
    assert turning.tolist() == [1.0, 3.0, 1.0]
    grid = World.from_scene(fields).terrain
    found = [_kernels.turning_multiplier_in(grid, x, y) for x, y in points]
    assert found == [1.0, 3.0, 1.0]


def test_a_turning_factor_of_one_leaves_a_scene_as_it_was() -> None:
    plain, said = scene(MUD), scene({**MUD, "turning_multiplier": 1.0})
    assert said.digest == plain.digest
    assert scene({**MUD, "turning_multiplier": 2.0}).digest != plain.digest


def test_one_point_is_enough() -> None:
    assert multiplier_at(scene(MUD), np.array([20.0, 10.0])).tolist() == [4.0]


def test_grid_agrees_with_polygons_at_cell_centres() -> None:
    fields = scene(SAND, MUD, POND, PLANK)
    grid = World.from_scene(fields).terrain
    rows, columns = grid.multiplier.shape
    x = (np.arange(columns) + 0.5) * CELL_M
    y = (np.arange(rows) + 0.5) * CELL_M
    centres = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    exact = multiplier_at(fields, centres)
    edges = shapely.union_all([area.shape.boundary for area in fields.terrain])
    off_edge = shapely.distance(edges, shapely.points(centres)) > 1e-9
    assert (grid.multiplier.reshape(-1) == exact)[off_edge].all()
    assert set(np.unique(exact)) == {1.0, 1.5, 2.0, 3.0, 4.0}


def test_outside_the_grid_the_nearest_cell_counts() -> None:
    fields = scene({**MUD, "box": {"center": [20, 10], "size": [40, 20]}})
    grid = World.from_scene(fields).terrain
    for x, y in ((-5.0, 10.0), (45.0, 10.0), (20.0, -5.0), (20.0, 25.0)):
        assert _kernels.multiplier_in(grid, x, y) == 4.0


def test_weighted_length_of_segments_against_exact_intersections() -> None:
    """Off by at most one step of two cells at each border crossed."""
    fields = scene(SAND, MUD, POND, PLANK)
    grid = World.from_scene(fields).terrain
    remaining = shapely.box(0, 0, 40, 20)
    patches = []
    for area in reversed(fields.terrain):
        patches.append((area.shape & remaining, area.multiplier))
        remaining = remaining - area.shape
    patches.append((remaining, 1.0))
    borders = shapely.union_all([shape.boundary for shape, _ in patches])
    rng = np.random.default_rng(1)
    relative = []
    for a, b in rng.uniform((1, 1), (39, 19), (400, 2, 2)):
        line = shapely.LineString([a, b])
        exact = sum(k * line.intersection(shape).length for shape, k in patches)
        found = _kernels.segment_cost(grid, *a, *b, 0.0, 0.0)
        crossed = shapely.get_num_geometries(line.intersection(borders))
        assert abs(found - exact) <= 2.0 * CELL_M * 3.0 * crossed + 1e-9
        relative.append((found - exact) / exact)
    assert abs(np.mean(relative)) < 0.01, "no bias"
    assert np.std(relative) < 0.05


@pytest.mark.parametrize("length_m", [0.0, 0.1, 0.5, 7.3])
def test_weighted_length_on_one_kind_of_ground_is_exact(length_m: float) -> None:
    grid = World.from_scene(scene(MUD)).terrain
    plain = _kernels.segment_cost(grid, 1.0, 1.0, 1.0 + length_m, 1.0, 0.0, 0.0)
    muddy = _kernels.segment_cost(grid, 14.0, 9.0, 14.0 + length_m, 9.0, 0.0, 0.0)
    assert plain == pytest.approx(length_m)
    assert muddy == pytest.approx(4.0 * length_m)
