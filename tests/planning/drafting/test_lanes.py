"""What robots cover along their paths."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import ndimage
from shapely import Polygon, affinity
from shapely.ops import unary_union

from mrmg.planning import PlannerParams
from mrmg.planning.drafting.drafting import tour_path
from mrmg.planning.drafting.errand import Errand
from mrmg.planning.drafting.lanes import Lane, apart_m, clashes, hull, lane_of
from mrmg.planning.drafting.refine import surfaces_of
from mrmg.planning.problem.problem import state_mission
from mrmg.scene.types import Scene


@given(arrays(bool, (7, 9)), st.integers(0, 6), st.integers(0, 8))
def test_the_hull_holds_all_clashes_joined_to_one(
    clash: np.ndarray, row: int, column: int
) -> None:
    clash[row, column] = True
    low, high = hull(clash, row, column)
    part, _ = ndimage.label(clash, structure=np.ones((3, 3)))
    rows, columns = np.nonzero(part == part[row, column])
    assert low[0] <= rows.min() <= rows.max() <= high[0]
    assert low[1] <= columns.min() <= columns.max() <= high[1]
    around = np.pad(clash, 1)[low[0] : high[0] + 3, low[1] : high[1] + 3]
    inner = clash[low[0] : high[0] + 1, low[1] : high[1] + 1]
    assert around.sum() == inner.sum()  # nothing that touches it is left out


@given(arrays(float, (4, 2, 2), elements=st.floats(-5, 5)), st.floats(0, 3))
def test_robots_clash_where_any_of_their_discs_are_too_near(
    disc: np.ndarray, spacing: float
) -> None:
    first, second = Lane(np.zeros(2), disc[:2], 0.5), Lane(np.zeros(2), disc[2:], 0.3)
    clash = clashes(first, second, spacing)
    for i, own in enumerate(disc[:2]):
        for j, its in enumerate(disc[2:]):
            assert clash[i, j] == (apart_m(own, its).min() < 0.8 + spacing)


def test_discs_cover_the_footprint_along_the_path(yard: Callable[..., Scene]) -> None:
    scene = yard()
    problem = state_mission(scene, 0, PlannerParams(samples=200))
    errand = Errand([0], tour_path(problem, 0, [0]), surfaces_of(problem)[0])
    lane = lane_of(problem, errand, 0, 2.0, 6.0)
    assert lane.way_m[0] == 2.0
    assert lane.way_m[-1] == 6.0
    outline = Polygon(scene.robots[0].model.footprint_m)
    for way_m, discs in zip(lane.way_m, lane.disc, strict=True):
        point = errand.path.points(np.array([way_m]))[0]
        ahead = discs[-1] - discs[0]
        turned = affinity.rotate(
            outline, np.arctan2(*ahead[::-1]), origin=(0, 0), use_radians=True
        )
        placed = affinity.translate(turned, *point)
        cover = unary_union(
            [affinity.translate(disc_of(lane.radius_m), *one) for one in discs]
        )
        assert placed.difference(cover).area < 1e-3


def disc_of(radius_m: float) -> Polygon:
    from shapely import Point

    return Point(0, 0).buffer(radius_m, quad_segs=32)
