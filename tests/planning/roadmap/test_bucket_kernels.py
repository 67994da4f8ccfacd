"""Nearest points in buckets against brute force."""

from __future__ import annotations

import numpy as np
import pytest

from mrmg.planning.roadmap._bucket_kernels import (
    Buckets,
    nearest_points,
    nearest_vertices,
)

SEEDS = range(8)


def points(seed: int, kind: str) -> np.ndarray:
    """Return scattered points, points of a grid (with ties), or points on a line."""
    rng = np.random.default_rng(seed)
    vertex = rng.uniform(-20.0, 80.0, (150, 2)) * (1.0, 0.3)
    if kind == "grid":
        vertex = np.round(vertex / 4.0) * 4.0  # some lie on one another
    if kind == "line":
        vertex[:, 1] = 3.0
    return vertex


def bucketed(vertex: np.ndarray, side: float = 5.0) -> Buckets:
    """Sort points into squares, one by one."""
    low, high = vertex.min(axis=0), vertex.max(axis=0)
    columns, rows = (1 + (high - low) // side).astype(int).tolist()
    held: list[list[int]] = [[] for _ in range(rows * columns)]
    for v, (x, y) in enumerate(vertex - low):
        held[int(y / side) * columns + int(x / side)].append(v)
    start = np.cumsum([0, *map(len, held)])
    member = np.array([v for bucket in held for v in bucket])
    return Buckets(float(low[0]), float(low[1]), side, columns, rows, start, member)


@pytest.mark.parametrize("kind", ["scattered", "grid", "line"])
@pytest.mark.parametrize("count", [1, 7, 149])
def test_neighbours_are_those_that_brute_force_finds(kind: str, count: int) -> None:
    for seed in SEEDS:
        vertex = points(seed, kind)
        offset = vertex[:, None] - vertex
        square = offset[..., 0] ** 2 + offset[..., 1] ** 2
        np.fill_diagonal(square, -1.0)
        expected = np.argsort(square, axis=1, kind="stable")[:, 1 : count + 1]
        found = nearest_vertices(bucketed(vertex), vertex, count)
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("seed", SEEDS)
def test_only_usable_points_are_near_to_any_place(seed: int) -> None:
    """Also to places outside of all squares."""
    vertex = points(seed, "scattered")
    usable = np.arange(len(vertex)) % 3 > 0
    for x, y in np.random.default_rng(seed).uniform(-60.0, 120.0, (40, 2)):
        nearest, square = np.full(2, -1), np.empty(2)
        assert nearest_points(bucketed(vertex), vertex, usable, x, y, nearest, square)
        away = np.where(usable, np.hypot(*(vertex - (x, y)).T), np.inf)
        assert nearest.tolist() == np.argsort(away)[:2].tolist()


def test_vertices_in_one_place_have_the_neighbours_there_are() -> None:
    vertex = np.ones((3, 2))
    np.testing.assert_array_equal(
        nearest_vertices(bucketed(vertex), vertex, 2), [[1, 2], [0, 2], [0, 1]]
    )
