"""The cost of an elastic band and its gradient against closed forms."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

from mrmg.planning.path_following import (
    _band_kernels,
    _bending_kernels,
    _relax_kernels,
)
from mrmg.planning.path_following._band_kernels import CostMap, Stops
from mrmg.planning.problem._target_kernels import TARGET, Targets


def cost_map(**changes: Any) -> CostMap:
    """Return open, plain ground of 20 x 20 m."""
    given = {
        "x_min": 0.0,
        "y_min": 0.0,
        "cell": 0.25,
        "distance": np.full((80, 80), 9.0),
        "multiplier": np.ones((80, 80)),
        "disc": np.array([0.1, 0.6, 1.1]),
        "length": 1.5,
        "room": 0.9,
        "turning_room": 1.5,
        "curvature": 0.4,
        "curvature_rate": 0.4,
        "scrub": 0.3,
    }
    return CostMap(**{**given, **changes})


def stops(
    *circles: tuple[int, float, float, float],
    deeper: float = 0.0,
    aim: float = float("nan"),
) -> Stops:
    """Return circular targets, each (node, x, y, radius), with an aim at all."""
    n = len(circles)
    target = np.zeros(n, TARGET).view(np.recarray)
    for i, (_, x, y, radius) in enumerate(circles):
        target[i]["center"], target[i]["reach"] = (x, y), radius
    return Stops(
        targets=Targets(n, n, np.zeros(0, np.int64), target, np.zeros((n, 3, 2))),
        node=np.array([c[0] for c in circles], np.int64),
        target=np.arange(n),
        deeper=np.full(n, deeper),
        aim=np.full(n, aim),
    )


EAST = np.array([[1.0, 0.0], [0.0, 0.0]])
"""Heading at the start; that at the end is free."""

NO_PIVOT = np.zeros(40, np.bool_)
"""Of paths that never turn on the spot."""


def cost(
    ground: CostMap,
    marks: Stops,
    p: np.ndarray,
    gear: np.ndarray,
    pivot: np.ndarray = NO_PIVOT,
    nose: np.ndarray = EAST,
) -> Any:
    """Return (cost, gradient) of a path that starts heading east."""
    gradient = np.zeros_like(p)
    shape = _bending_kernels.new_shape(len(p))
    value = _band_kernels.band_cost(
        ground, marks, p, gear, pivot[: len(gear)], nose, shape, gradient
    )
    return value, gradient


@pytest.mark.parametrize("seed", range(6))
def test_gradient_is_that_of_the_cost(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 12
    ground = cost_map(
        distance=5.0 * rng.random((80, 80)), multiplier=1.0 + rng.random((80, 80))
    )
    marks = stops((6, 5.0, 5.0, 0.5), (9, 9.0, 9.0, 0.4), deeper=0.1, aim=0.3)
    marks.targets.corner[1] = [[8, 8], [9, 8], [8.5, 9]]
    marks.targets.target[1]["corners"] = 3
    p = 3.0 + np.cumsum(0.4 + 0.8 * rng.random((n, 2)), axis=0)
    gear = np.where(np.arange(n - 1) < 6, 1, -1)
    pivot = np.arange(n - 1) % 5 == 3
    # Of a third of the cases the end is free.
    nose = np.array([[1.0, 0.0], [cos(seed), sin(seed)]]) * [[1.0], [seed % 3 > 0]]
    _, gradient = cost(ground, marks, p, gear, pivot, nose)
    slopes = np.zeros_like(p)
    for i in range(1, n):
        for j in range(2):
            ends = []
            for sign in (1.0, -1.0):
                q = p.copy()
                q[i, j] += sign * 1e-6
                ends.append(cost(ground, marks, q, gear, pivot, nose)[0])
            slopes[i, j] = (ends[0] - ends[1]) / 2e-6
    scale = np.abs(gradient).max()
    assert np.abs(slopes - gradient).max() < 1e-6 * scale
    assert gradient[0].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("gear", [1, -1])
def test_a_straight_way_costs_its_length(gear: int) -> None:
    x = 10.0 + gear * np.arange(9.0)
    p = np.stack([x, np.full(9, 5.0)], axis=1)
    value, _ = cost(cost_map(), stops(), p, np.full(8, gear))
    assert value == pytest.approx(8.0)


@pytest.mark.parametrize("gear", [1, -1])
def test_a_way_bends_to_the_heading_at_its_end(gear: int) -> None:
    """A quarter of a circle ends without a jump of curvature, whatever the gear."""
    angle = np.linspace(0.0, pi / 2.0, 11)
    p = np.stack([5.0 + 3.0 * np.sin(angle), 8.0 - 3.0 * np.cos(angle)], axis=1)
    ground, way = cost_map(curvature=0.4, scrub=0.0), np.full(10, gear)
    start = [float(gear), 0.0]
    costs = [
        cost(ground, stops(), p, way, nose=np.array([start, [0.0, north]]))[0]
        for north in (float(gear), 0.0, -float(gear))
    ]
    assert costs[0] == pytest.approx(costs[1], rel=0.05)
    assert costs[2] > 10.0 * costs[0]


def test_turns_on_the_spot_need_room() -> None:
    p = np.stack([np.arange(1.0, 10.0), np.full(9, 5.0)], axis=1)
    ground = cost_map(distance=np.full((80, 80), 1.2), disc=np.zeros(1))
    pivot = np.arange(8) == 4
    costs = [
        cost(ground, stops(), p, np.ones(8, np.int64), turns)[0]
        for turns in (NO_PIVOT, pivot)
    ]
    lacking_m = ground.turning_room - 1.2
    weight = _band_kernels.TURNING_WEIGHT
    assert costs[1] - costs[0] == pytest.approx(weight * lacking_m**2)


def test_robots_set_out_straight_where_they_have_no_room_to_turn() -> None:
    turn = 0.3
    p = np.array([[5.0, 5.0], [5.0 + cos(turn), 5.0 + sin(turn)]])
    costs = []
    for room in (1.2, 1.5):
        ground = cost_map(distance=np.full((80, 80), 1.2), disc=np.zeros(1))
        ground = ground._replace(turning_room=room)
        costs.append(cost(ground, stops(), p, np.ones(1, np.int64))[0])
    added = 0.3 * _band_kernels.TURNING_WEIGHT * turn**2
    assert costs[1] - costs[0] == pytest.approx(added)


def test_terrain_multiplies_the_length() -> None:
    p = np.stack([np.arange(1.0, 10.0), np.full(9, 5.0)], axis=1)
    ground = cost_map(multiplier=np.full((80, 80), 2.5))
    value, _ = cost(ground, stops(), p, np.ones(8, np.int64))
    assert value == pytest.approx(20.0)


def test_an_arc_costs_length_and_scrub_and_more_beyond_the_limit() -> None:
    angle = np.linspace(0.0, 0.5 * pi, 40)
    costs = []
    for radius in (4.0, 2.0):
        p = np.stack(
            [5 + radius * np.sin(angle), 5 + radius * (1 - np.cos(angle))], axis=1
        )
        ground = cost_map(curvature_rate=1e3)
        value, _ = cost(ground, stops(), p, np.ones(39, np.int64))
        costs.append(value - 0.5 * pi * radius)
    assert 0.0 < costs[0] <= 0.3 * 0.5 * pi
    # Radius 2 m bends by 0.5 / m where 0.4 / m is allowed.
    over = _bending_kernels.CURVATURE_WEIGHT * 0.25**2 * pi
    assert costs[1] - costs[0] == pytest.approx(over, rel=0.05)


def test_a_change_of_gear_turns_the_heading_not_the_way() -> None:
    there = [(5.0 + 0.5 * i, 5.0) for i in range(9)]
    back = there[-2::-1]
    p = np.array(there + back)
    gear = np.array([1] * 8 + [-1] * 8)
    assert cost(cost_map(), stops(), p, gear)[0] == pytest.approx(8.0)
    assert cost(cost_map(), stops(), p, np.ones(16, np.int64))[0] > 50.0


def relaxed(ground: CostMap, marks: Stops, p: np.ndarray, gear: np.ndarray) -> Any:
    node = p.copy()
    value = _relax_kernels.relax(
        ground, marks, node, gear, NO_PIVOT[: len(gear)], EAST, 400
    )
    return value, node


def test_a_slack_band_becomes_straight() -> None:
    x = np.linspace(2.0, 18.0, 21)
    p = np.stack([x, 10.0 + 2.0 * np.sin(0.9 * x) * (x - 2.0) / 16.0], axis=1)
    value, node = relaxed(cost_map(), stops((20, 18.0, 10.0, 0.5)), p, np.ones(20, int))
    assert value == pytest.approx(15.5, abs=0.02)
    assert np.abs(node[:, 1] - 10.0).max() < 0.1


def test_a_band_round_a_disc_touches_it_and_no_more() -> None:
    """About a disc of room 3 m the shortest way is two tangents and an arc."""
    x, y = np.meshgrid((np.arange(80) + 0.5) * 0.25, (np.arange(80) + 0.5) * 0.25)
    distance = np.hypot(x - 10.0, y - 10.0) - 2.0
    ground = cost_map(distance=distance, disc=np.zeros(1), room=1.0, scrub=0.0)
    angle = np.linspace(pi, 0.0, 31)
    p = np.stack([10.0 + 8.0 * np.cos(angle), 10.0 + 4.5 * np.sin(angle)], axis=1)
    p = np.concatenate([[[1.5, 10.0]], p])
    ground = ground._replace(curvature=50.0, curvature_rate=500.0)
    value, node = relaxed(ground, stops((31, 18.0, 10.0, 0.1)), p, np.ones(31, int))
    reach = np.hypot(*(node - 10.0).T).min()
    assert 2.8 < reach < 3.05
    tangent = (8.5**2 - 9.0) ** 0.5 + (7.9**2 - 9.0) ** 0.5
    arc = 3.0 * (pi - np.arccos(3 / 8.5) - np.arccos(3 / 7.9))
    assert value == pytest.approx(tangent + arc, rel=0.02)


@pytest.mark.parametrize("spacing_m", [0.8, 2.4])
def test_a_band_through_a_door_stays_in_it(spacing_m: float) -> None:
    """A wall 0.5 m thick, thinner than a segment is long, and a door 4 m aside."""
    x, y = np.meshgrid((np.arange(80) + 0.5) * 0.25, (np.arange(80) + 0.5) * 0.25)
    wall = np.abs(x - 10.0) - 0.25
    jamb = np.hypot(np.maximum(wall, 0.0), np.maximum(0.8 - np.abs(y - 14.0), 0.0))
    distance = np.where(np.abs(y - 14.0) < 0.8, jamb, wall)
    ground = cost_map(
        distance=distance, disc=np.array([-0.15, 0.15]), length=0.6, room=0.6
    )
    x = np.concatenate([np.arange(4.0, 10.0, spacing_m), [10.0]])
    half = np.stack([x, 14.0 - 4.0 * (10.0 - x) / 6.0], axis=1)
    p = np.concatenate([half, half[-2::-1] * [-1.0, 1.0] + [20.0, 0.0]])
    last = len(p) - 1
    end = stops((last, *p[-1], 0.1))
    _, node = relaxed(ground, end, p, np.ones(last, np.int64))
    at_wall = np.interp(10.0, node[:, 0], node[:, 1])
    assert abs(at_wall - 14.0) < 0.5


@pytest.mark.parametrize("seed", range(4))
def test_relaxing_never_costs_more_and_keeps_the_start(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * pi)
    p = 10.0 + np.cumsum(rng.normal(0.2, 0.5, (15, 2)), axis=0)
    gear = rng.choice([1, -1], 14)
    ground = cost_map(distance=np.cumsum(rng.normal(0.0, 0.1, (80, 80)), axis=1) + 1.5)
    shape, gradient = _bending_kernels.new_shape(15), np.zeros_like(p)
    nose = np.array([[cos(angle), sin(angle)], [0.0, 0.0]])
    before = _band_kernels.band_cost(
        ground, stops(), p, gear, NO_PIVOT[:14], nose, shape, gradient
    )
    node = p.copy()
    after = _relax_kernels.relax(ground, stops(), node, gear, NO_PIVOT[:14], nose, 50)
    assert after <= before
    assert node[0].tolist() == p[0].tolist()
    again = _band_kernels.band_cost(
        ground, stops(), node, gear, NO_PIVOT[:14], nose, shape, gradient
    )
    assert again == after
