"""The certified minimum against dense sampling, on random motions.

The oracle samples every step 40 times. A point of a footprint moves at most
`_FASTEST_M_S` times a fortieth of a step between samples, so that the oracle's minimum
lies above the true one by at most that; the certified one lies below by at most its
stated accuracy.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shapely.geometry import Point, box

from mrmg.motion.dynamics import DERIVATIVES
from mrmg.scene.types import Obstacle
from mrmg.verification.clearance import (
    MINIMUM_ACCURACY_M,
    BoundsGap,
    Gap,
    ObstacleGap,
    PairGap,
    bounded_minimum,
)
from mrmg.verification.swept_footprint import SweptFootprint

SAMPLES_PER_STEP = 40
_FASTEST_M_S = 4.0  # speed and yaw of random driving below, at the footprint's corner

random_driving = st.lists(
    st.tuples(st.floats(-1.5, 1.5), st.floats(-1.0, 1.0)), min_size=3, max_size=14
)
quiet = settings(
    max_examples=60,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


def held(controls: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Hold the steering inside its limits, whatever was drawn."""
    psi = 0.0
    kept = []
    for u1, u2 in controls:
        psi_next = float(np.clip(psi + 0.1 * u2, -0.6, 0.6))
        kept.append((u1, (psi_next - psi) / 0.1))
        psi = psi_next
    return kept


def dense_minimum(gap: Gap, steps: int) -> float:
    step = np.repeat(np.arange(steps), SAMPLES_PER_STEP + 1)
    time_s = np.tile(np.linspace(0.0, 0.1, SAMPLES_PER_STEP + 1), steps)
    return float(gap.at(step, time_s).min())


def assert_certified(gap: Gap, steps: int) -> None:
    found = bounded_minimum(gap, np.arange(steps), 0.1)
    sampled_m = dense_minimum(gap, steps)
    if len(found.contact_step):
        assert sampled_m <= _FASTEST_M_S * 0.1 / SAMPLES_PER_STEP
        assert found.lower_bound_m <= 0.0
    else:
        assert 0.0 < found.lower_bound_m <= sampled_m + 1e-9
        dense_error_m = _FASTEST_M_S * 0.1 / SAMPLES_PER_STEP
        assert found.lower_bound_m >= sampled_m - dense_error_m - MINIMUM_ACCURACY_M
    if sampled_m <= 0.0:
        assert len(found.contact_step)


@pytest.fixture
def swept(make_scene: Any, drive: Any) -> Any:
    """Return a maker of swept footprints that start at a pose."""

    def make(
        controls: list[tuple[float, float]],
        x: float,
        y: float,
        yaw: float,
        motion_model: str = "car",
    ) -> SweptFootprint:
        robots = [{"id": "r1", "model": "car", "pose": [x, y, yaw]}]
        robot = make_scene(robots=robots).robots[0]
        model = replace(robot.model, motion_model=motion_model)
        robot = replace(robot, model=model)
        return SweptFootprint(robot.model, drive(robot, held(controls)))

    return make


@quiet
@given(random_driving, st.floats(0.5, 9.0), st.floats(-2.0, 2.0), st.floats(0.05, 1.0))
def test_obstacle_minimum_is_certified(
    swept: Any, controls: Any, ahead: float, aside: float, radius: float
) -> None:
    footprint = swept(controls, 10.0, 10.0, 0.0)
    post = Point(10.0 + ahead, 10.0 + aside).buffer(radius)
    far = box(30.0, 2.0, 31.0, 3.0)
    gap = ObstacleGap(
        footprint,
        [
            Obstacle(id=name, shape=shape, height_m=1.0)
            for name, shape in (("far", far), ("post", post))
        ],
    )
    assert_certified(gap, len(controls))


@quiet
@given(random_driving, st.floats(0.5, 4.0), st.floats(-3.2, 3.2))
def test_bounds_minimum_is_certified(
    swept: Any, controls: Any, margin: float, yaw: float
) -> None:
    footprint = swept(controls, 10.0, 10.0, yaw)
    low, high = 10.0 - margin, 10.0 + margin
    assert_certified(BoundsGap(footprint, (low, low, high, high)), len(controls))


@quiet
@given(
    st.lists(
        st.tuples(*[st.floats(-1.5, 1.5), st.floats(-1.0, 1.0)] * 2),
        min_size=3,
        max_size=12,
    ),
    st.floats(-5.0, 5.0),
    st.floats(-5.0, 5.0),
    st.floats(-3.2, 3.2),
)
def test_pair_minimum_is_certified(
    swept: Any, controls: Any, dx: float, dy: float, yaw: float
) -> None:
    one = swept([item[:2] for item in controls], 15.0, 10.0, 0.0)
    other = swept([item[2:] for item in controls], 15.0 + dx, 10.0 + dy, yaw)
    gap = PairGap(one, other)
    assert_certified(gap, len(controls))
    at_all = bounded_minimum(gap, np.arange(len(controls)), 0.1)
    at_close = bounded_minimum(gap, gap.close_steps(), 0.1)
    assert at_close.lower_bound_m == pytest.approx(
        at_all.lower_bound_m, abs=MINIMUM_ACCURACY_M
    )
    assert bool(len(at_close.contact_step)) == bool(len(at_all.contact_step))


@quiet
@given(random_driving, st.floats(-3.2, 3.2), st.sampled_from(sorted(DERIVATIVES)))
def test_swept_hull_holds_the_motion(
    swept: Any, controls: Any, yaw: float, motion_model: str
) -> None:
    footprint = swept(controls, 10.0, 10.0, yaw, motion_model)
    step = np.arange(len(controls))
    start, end = np.zeros(len(step)), np.full(len(step), 0.1)
    corners = np.concatenate(
        [footprint.corners_at(step, start), footprint.corners_at(step, end)], axis=1
    )
    hulls = shapely.convex_hull(shapely.linestrings(corners))
    slack_m = footprint.sagitta(step, end)
    for share in np.linspace(0.0, 0.1, 11):
        inner = footprint.corners_at(step, np.full(len(step), share))
        for corner in range(inner.shape[1]):
            strayed = shapely.distance(hulls, shapely.points(inner[:, corner]))
            assert (strayed <= slack_m).all()


def test_touch_without_overlap_is_contact(swept: Any) -> None:
    """A footprint that comes to rest against a wall, edge on edge."""
    footprint = swept([(0.0, 0.0)] * 3, 10.0, 10.0, 0.0)
    wall = Obstacle(id="wall", shape=box(11.5, 5.0, 12.0, 15.0), height_m=1.0)
    found = bounded_minimum(ObstacleGap(footprint, [wall]), np.arange(3), 0.1)
    assert found.contact_step.tolist() == [0, 1, 2]


def test_a_millimetre_is_clear_and_a_hundredth_of_one_is_not(swept: Any) -> None:
    """At constant speed straight on, in the second step, even the latter is proven."""
    footprint = swept([(1.0, 0.0), (0.0, 0.0), (-1.0, 0.0)], 10.0, 10.0, 0.0)
    for gap_m, contacts in ((1e-3, set()), (1e-5, {0, 2})):
        rail = Obstacle(
            id="rail", shape=box(5.0, 5.0, 20.0, 9.45 - gap_m), height_m=1.0
        )
        found = bounded_minimum(ObstacleGap(footprint, [rail]), np.arange(3), 0.1)
        assert set(found.contact_step.tolist()) == contacts


class _Undecided:
    """A gap whose bound never closes at one instant, as where numbers lie far apart."""

    instant_s = 0.0333

    def at(self, step: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        return np.ones(len(step))

    def over(
        self, step: np.ndarray, start_s: np.ndarray, end_s: np.ndarray
    ) -> np.ndarray:
        inside = (start_s <= self.instant_s) & (self.instant_s <= end_s)
        return np.where(inside, -1.0, 1.0)


def test_what_cannot_be_decided_counts_as_contact() -> None:
    found = bounded_minimum(_Undecided(), np.array([4]), 0.1)
    assert found.contact_step.tolist() == [4]
    assert found.contact_time_s == pytest.approx([0.0333], abs=1e-8)
    assert found.lower_bound_m == -1.0
