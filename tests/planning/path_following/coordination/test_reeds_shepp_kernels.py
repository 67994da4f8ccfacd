"""Shortest curves lead where they should, and are as long as they say."""

from __future__ import annotations

from math import cos, hypot, pi, remainder, sin, tau

import numpy as np
import pytest

from mrmg.planning.path_following.coordination._reeds_shepp_kernels import reeds_shepp
from mrmg.planning.problem._control_kernels import wrap


def end_of(
    start: float, radius: float, turn: np.ndarray, length: np.ndarray
) -> np.ndarray:
    """Return the pose that pieces lead to from the origin."""
    x, y, heading = 0.0, 0.0, start
    for side, way in zip(turn, length, strict=True):
        after = heading + side * way / radius
        if side == 0.0:
            x, y = x + way * cos(heading), y + way * sin(heading)
        else:
            x += radius * side * (sin(after) - sin(heading))
            y -= radius * side * (cos(after) - cos(heading))
        heading = after
    return np.array([x, y, heading])


def test_curves_end_where_they_are_asked_to_and_are_no_longer_mirrored() -> None:
    rng = np.random.default_rng(0)
    turn, length = np.zeros(3), np.zeros(3)
    found = 0
    for _ in range(2000):
        (dx, dy), (start, goal) = rng.uniform(-6, 6, 2), rng.uniform(-pi, pi, 2)
        way = reeds_shepp(dx, dy, start, goal, 1.3, True, turn, length)
        if not np.isfinite(way):
            continue
        found += 1
        x, y, heading = end_of(start, 1.3, turn, length)
        assert hypot(x - dx, y - dy) < 1e-6
        assert abs(remainder(heading - goal, tau)) < 1e-6
        assert abs(np.abs(length).sum() - way) < 1e-9
        assert way >= hypot(dx, dy) - 1e-9
        mirrored = reeds_shepp(dx, -dy, -start, -goal, 1.3, True, turn, length)
        assert abs(mirrored - way) < 1e-6
        back = reeds_shepp(-dx, -dy, goal, start, 1.3, True, turn, length)
        assert back <= way + 1e-6
    assert found > 1900


def test_straight_ahead_and_back_are_straight() -> None:
    turn, length = np.zeros(3), np.zeros(3)
    for way in (5.0, -5.0):
        found = reeds_shepp(way, 0.0, 0.0, 0.0, 1.0, True, turn, length)
        assert abs(found - 5.0) < 1e-9
        assert abs(length.sum() - way) < 1e-9


def test_cars_that_cannot_reverse_drive_forwards_all_the_way() -> None:
    rng = np.random.default_rng(1)
    turn, length = np.zeros(3), np.zeros(3)
    for _ in range(1000):
        (dx, dy), (start, goal) = rng.uniform(-6, 6, 2), rng.uniform(-pi, pi, 2)
        way = reeds_shepp(dx, dy, start, goal, 1.3, False, turn, length)
        assert np.isfinite(way)
        assert (length >= 0.0).all()
        assert abs(length.sum() - way) < 1e-9
        x, y, heading = end_of(start, 1.3, turn, length)
        assert hypot(x - dx, y - dy) < 1e-6
        assert abs(remainder(heading - goal, tau)) < 1e-6
        reversing = reeds_shepp(dx, dy, start, goal, 1.3, True, turn, length)
        assert way >= reversing - 1e-9 or np.isinf(reversing)


def test_they_drive_curves_as_short_as_any_there_is() -> None:
    """Poses that random curves lead to are not farther than these."""
    rng = np.random.default_rng(2)
    turn, length = np.zeros(3), np.zeros(3)
    sides = [(1, 0, 1), (-1, 0, -1), (1, 0, -1), (-1, 0, 1), (1, -1, 1), (-1, 1, -1)]
    for _ in range(2000):
        one = np.array(sides[rng.integers(len(sides))], float)
        driven = rng.uniform(0.0, 1.3 * pi, 3)
        x, y, heading = end_of(0.4, 1.3, one, driven)
        way = reeds_shepp(x, y, 0.4, heading, 1.3, False, turn, length)
        assert way <= driven.sum() + 1e-6


SHAPES = {
    "straight": (0.0,),
    "arc": (1.0,),
    "arcs": (1.0, 1.0),
    "straight and arc": (0.0, -1.0),
    "arc and straight": (1.0, 0.0),
}


@pytest.mark.parametrize("reverses", [True, False])
@pytest.mark.parametrize("sides", SHAPES.values(), ids=SHAPES)
def test_rounding_adds_no_circles(sides: tuple[float, ...], reverses: bool) -> None:
    """Curves with fewer than three pieces are found where they are the shortest."""
    rng = np.random.default_rng(2)
    turn, length = np.zeros(3), np.zeros(3)
    for _ in range(500):
        start, radius = rng.uniform(-pi, pi), rng.uniform(0.5, 5.0)
        own = radius * rng.uniform(0.1, 0.7, len(sides))
        x, y, heading = end_of(start, radius, np.array(sides), own)
        way = reeds_shepp(x, y, start, heading, radius, reverses, turn, length)
        assert way <= own.sum() * (1.0 + 1e-6)
        end = end_of(start, radius, turn, length)
        assert hypot(end[0] - x, end[1] - y) < 1e-5 * radius


def test_large_angles_are_wrapped_at_once() -> None:
    for angle in (1e12, -1e12, 1e3, -4.0, 4.0):
        assert abs(remainder(wrap(angle) - angle, tau)) < 1e-3
        assert -pi - 1e-9 < wrap(angle) <= pi
