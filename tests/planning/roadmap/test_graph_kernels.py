"""Neighbours and ways in graphs against brute force and scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from mrmg.planning.roadmap._bucket_kernels import Buckets, nearest_points
from mrmg.planning.roadmap._graph_kernels import (
    cheapest_paths,
    nearest_vertices,
    parts,
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


def graph(seed: int) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
    """Return a directed graph of several parts, with ways for nothing in it."""
    rng = np.random.default_rng(seed)
    vertices = 60
    pair = np.unique(rng.integers(0, vertices, (70, 2)), axis=0)
    low, high = np.unique(np.sort(pair[pair[:, 0] != pair[:, 1]], axis=1), axis=0).T
    cost = rng.uniform(0.0, 9.0, (len(low), 2))
    cost[rng.random(len(low)) < 0.1] = 0.0
    return vertices, np.ascontiguousarray(low), np.ascontiguousarray(high), cost


@pytest.mark.parametrize("seed", SEEDS)
def test_ways_cost_what_scipy_says_and_successors_lead_along_them(seed: int) -> None:
    vertices, low, high, cost = graph(seed)
    entries = [np.array([0]), np.array([5, 17]), np.array([3])]
    both = np.concatenate([low, high])
    start = np.searchsorted(np.sort(both), np.arange(vertices + 1))
    edge = np.argsort(both, kind="stable") % len(low)
    total, successor = cheapest_paths(
        low, high, cost, start, edge, np.concatenate(entries), np.array([0, 1, 3, 4])
    )
    ends = np.concatenate([high, low]), np.concatenate([low, high])  # backwards
    against = csr_array((cost.T.ravel(), ends), shape=(vertices, vertices))
    for t, sources in enumerate(entries):
        expected = dijkstra(against, indices=sources, min_only=True)
        np.testing.assert_allclose(total[t], expected, rtol=1e-12)
        for v in range(vertices):
            here, driven = v, 0.0
            while successor[t, here] >= 0:
                ahead = int(successor[t, here])
                first, last = min(here, ahead), max(here, ahead)
                (e,) = np.flatnonzero((low == first) & (high == last))
                driven += cost[e, 0 if here == low[e] else 1]
                here = ahead
            if np.isfinite(total[t, v]):
                assert here in sources
                assert driven == pytest.approx(total[t, v])
            else:
                assert here == v


@pytest.mark.parametrize("seed", SEEDS)
def test_parts_are_what_edges_join(seed: int) -> None:
    vertices, low, high, _ = graph(seed)
    found = parts(vertices, low, high)
    shape = (vertices, vertices)
    joined = csr_array((np.ones(len(low)), (low, high)), shape=shape)
    _, expected = connected_components(joined, directed=False)
    for name in np.unique(expected):
        members = np.flatnonzero(expected == name)
        assert set(found[members].tolist()) == {int(members[0])}
