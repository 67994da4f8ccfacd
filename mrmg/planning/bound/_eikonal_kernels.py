"""Compiled part of the lower bound: certified distance fields.

A field u over a grid is certified if it is nowhere steeper than the ground is dear:
then u(b) - u(a) is at most the cost of any way from a to b through free cells, however
u was found. Fields are linear on triangles: every cell of the grid is cut in two along
the diagonal that leaves it the flatter.

Nodes are numbered row by row. Cells have a rim of blocked ones about them, so that the
four cells about node n of row i are n + i, n + i + 1 and as many in the next row, and
no node beyond the grid is ever looked at.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.roadmap._heap_kernels import pop, push

UNREACHED = 1e18
"""Field value of nodes that no free cell joins to the source."""


@kernel
def certified_field(price, cell, seed, rounds, band):
    """Return a field that is nearly the cost from a source, and what certifies it.

    Solves the eikonal equation, lowers the price where the solution is too steep for
    the given price, and solves again, as fronts that spread are too steep behind. What
    steepness is left, mostly where fronts meet, is divided out level by level: f(u) is
    certified if f grows no faster than 1 / (largest excess among cells on a level).

    Args:
        price: cost per metre of each cell, inf where blocked, shape (Y, X).
        cell: side of a cell [m].
        seed: values near the source, UNREACHED elsewhere, shape (Y + 1, X + 1).
        rounds: solutions.
        band: width of a level.

    Returns:
        (u, level, certified): the field, shape (Y + 1, X + 1), and f at rising levels;
        it is linear between them.
    """
    step = np.full((price.shape[0] + 2, price.shape[1] + 2), np.inf)
    for row in range(price.shape[0]):
        for column in range(price.shape[1]):
            step[row + 1, column + 1] = price[row, column] * cell
    field = seed.copy()
    _march(step.ravel(), field)
    for _ in range(rounds - 1):
        _lower_where_steep(field, price, cell, step)
        field = seed.copy()
        _march(step.ravel(), field)
    low = high = field.min()
    for value in field.ravel():
        if value < UNREACHED:
            high = max(high, value)
    excess = np.ones(int((high - low) / band) + 2)
    for row in range(price.shape[0]):
        for column in range(price.shape[1]):
            if price[row, column] == np.inf or field[row, column] >= UNREACHED:
                continue
            ratio = steepness(field, cell, row, column) / price[row, column]
            if ratio <= 1.0:
                continue
            a, b = field[row, column], field[row, column + 1]
            c, d = field[row + 1, column], field[row + 1, column + 1]
            first = int((min(min(a, b), min(c, d)) - low) / band)
            last = int((max(max(a, b), max(c, d)) - low) / band)
            for k in range(first, last + 1):
                excess[k] = max(excess[k], ratio)
    level = low + band * np.arange(len(excess) + 1)
    certified = np.zeros(len(level))
    for k in range(len(excess)):
        certified[k + 1] = certified[k] + band / excess[k]
    return field, level, certified


@kernel
def steepness(field, cell, row, column):
    """Return the largest gradient in a cell, cut along the better diagonal.

    Where fronts meet, the other cut, or a bilinear field, would be the steeper by up to
    a factor of sqrt(2).
    """
    a, b = field[row, column], field[row, column + 1]
    c, d = field[row + 1, column], field[row + 1, column + 1]
    low, high = (b - a) * (b - a), (d - c) * (d - c)
    left, right = (c - a) * (c - a), (d - b) * (d - b)
    from_a = max(low + right, high + left)
    from_b = max(low + left, high + right)
    return sqrt(min(from_a, from_b)) / cell


@kernel
def _lower_where_steep(field, price, cell, step):
    """Lower the working price of too steep cells, by sqrt(2) at most."""
    for row in range(price.shape[0]):
        for column in range(price.shape[1]):
            if price[row, column] == np.inf:
                continue
            ratio = steepness(field, cell, row, column) / price[row, column]
            if ratio > 1.0:
                least = price[row, column] * cell / sqrt(2.0)
                lower = step[row + 1, column + 1] / ratio
                step[row + 1, column + 1] = max(least, lower)


@kernel
def _march(step, field):
    """Solve |grad u| = price from given seeds: fast marching (Sethian 1996).

    Args:
        step: price of each cell and of the rim, times the cell's side, flat.
        field: seeds, UNREACHED elsewhere; receives the solution, shape (Y + 1, X + 1).
    """
    width = field.shape[1]
    flat = field.ravel()
    done = np.zeros(len(flat), np.bool_)
    key = np.empty(5 * len(flat) + 1)  # a node is improved from each side at most
    entry = np.empty(len(key), np.int32)
    size = 0
    for node in range(len(flat)):
        if flat[node] < UNREACHED:
            size = push(key, entry, size, flat[node], node)
    while size > 0:
        node = entry[0]
        size = pop(key, entry, size)
        if done[node]:
            continue
        done[node] = True
        above = node + node // width
        below = above + width + 1
        for side in range(4):
            if side == 0:
                to, turn, one, other = node - width, 1, above, above + 1
            elif side == 1:
                to, turn, one, other = node + width, 1, below, below + 1
            elif side == 2:
                to, turn, one, other = node - 1, width, above, below
            else:
                to, turn, one, other = node + 1, width, above + 1, below + 1
            value = UNREACHED
            if step[one] < np.inf and not done[to]:
                value = _corner_value(flat[node], flat[to - turn], step[one])
            if step[other] < np.inf and not done[to]:
                value = min(
                    value, _corner_value(flat[node], flat[to + turn], step[other])
                )
            if value < UNREACHED and value < flat[to]:
                flat[to] = value
                size = push(key, entry, size, value, to)


@kernel
def _corner_value(a, b, step):
    """Return the value of a cell's corner between corners of known values."""
    if abs(a - b) < step:
        return 0.5 * (a + b + sqrt(2.0 * step * step - (a - b) * (a - b)))
    return min(a, b) + step
