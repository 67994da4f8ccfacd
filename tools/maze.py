"""Mazes of square cells, which walls part or not; all of them are joined."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import minimum_spanning_tree

SIDE = 5
"""Cells along each side."""

WALL_SHARE = 0.1
"""Width of walls, as a share of a cell's side."""

OPEN_SHARE = 0.1
"""Share of the walls that are left out beside those that joining all cells takes."""


@dataclass(frozen=True, slots=True)
class Maze:
    """A maze.

    Attributes:
        side_m: of the whole maze, from 0 in x and in y.
        middle: of the cells [m], shape (n, 2).
        joined: numbers of cells side by side without a wall in between, shape (k, 2).
        wall: (x, y) of the middles of walls, and their lengths in x and y [m],
            shape (w, 4).
    """

    side_m: float
    middle: np.ndarray
    joined: np.ndarray
    wall: np.ndarray


def drawn_maze(rng: np.random.Generator, cell_m: float) -> Maze:
    """Return a maze of cells of a side, drawn as the least tree of random weights."""
    cell = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    beside = [(cell[:, :-1], cell[:, 1:]), (cell[:-1], cell[1:])]
    pair = np.vstack([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in beside])
    weights = csr_array((rng.random(len(pair)), pair.T), shape=(cell.size, cell.size))
    is_open = minimum_spanning_tree(weights).toarray()[*pair.T] > 0.0
    is_open |= rng.random(len(pair)) < OPEN_SHARE
    row, column = np.divmod(cell.ravel(), SIDE)
    middle = (np.stack([column, row], axis=1) + 0.5) * cell_m
    apart = np.abs(middle[pair[:, 1]] - middle[pair[:, 0]])
    sides = apart[:, ::-1] + WALL_SHARE * cell_m
    wall = np.hstack([middle[pair].mean(axis=1), sides])[~is_open]
    return Maze(SIDE * cell_m, middle, pair[is_open], wall)
